"""MDF 4, ULog and TDMS: logs that their reference writers wrote, at two rates, and what is no log.

Each skips where its library is not installed: `pip install -e '.[robots]'`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.formats import source as extras
from codegen.logs.formats import source as log_source
from tests.expected_errors import refused

MADE = {name: values[:2500] for name, values in rows().items()}
SLOW = {name: values[::10] for name, values in MADE.items()}
NAMES = {
    ".mf4": {"x": "x", "v": "v", "w": "w"},
    ".ulg": {"x": "motion.x", "v": "motion.v", "w": "drive[1].force[0]"},
    ".tdms": {"x": "motion.x", "v": "motion.v", "w": "drive.force"},
}
ENDINGS = list(NAMES)


def write_mdf(path: Path, fast: dict[str, Any], slow: dict[str, Any]) -> None:
    asammdf = pytest.importorskip("asammdf", reason="needs the extra mdf")
    linear = asammdf.blocks.conversion_utils.from_dict({"a": 0.5, "b": 1.0})
    formula = asammdf.blocks.conversion_utils.from_dict({"formula": "X1 * 2"})
    half = (2 * slow["w"] - 2).astype(np.float64)
    mdf = asammdf.MDF(version="4.10")
    mdf.append(
        [
            asammdf.Signal(samples=fast["x"], timestamps=fast["t"], name="x", unit="m"),
            asammdf.Signal(samples=fast["v"], timestamps=fast["t"], name="v", unit="m/s"),
            asammdf.Signal(samples=fast["v"], timestamps=fast["t"], name="twice"),
            asammdf.Signal(samples=fast["v"], timestamps=fast["t"], name="formula", conversion=formula),
        ]
    )
    mdf.append([asammdf.Signal(samples=half, timestamps=slow["t"], name="w", unit="N", conversion=linear)])
    mdf.append([asammdf.Signal(samples=slow["v"], timestamps=slow["t"], name="twice")])
    mdf.save(path, overwrite=True, compression=2)
    mdf.close()


def write_ulog(path: Path, fast: dict[str, Any], slow: dict[str, Any]) -> None:
    """What pyulog writes of the messages, sorted by time."""
    pyulog = pytest.importorskip("pyulog", reason="needs the extra ulog")
    pyulog.ULog(BytesIO(ulog_messages(fast, slow))).write_ulog(str(path))


def ulog_messages(fast: dict[str, Any], slow: dict[str, Any]) -> bytes:
    """By hand, after PX4's page of the format."""

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<Hc", len(body), kind.encode()) + body

    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    data += message("F", b"motion:uint64_t timestamp;double x;double v;")
    data += message("F", b"drive:uint64_t timestamp;double[2] force;")
    for instance, key, name in ((0, 0, b"motion"), (0, 1, b"drive"), (1, 2, b"drive")):
        data += message("A", struct.pack("<BH", instance, key) + name)
    for t, x, v in zip(fast["t"], fast["x"], fast["v"], strict=True):
        data += message("D", struct.pack("<HQdd", 0, round(t * 1e6) + 5_000_000, x, v))
    data += message("D", struct.pack("<HQdd", 1, 5_000_000, 0.0, 0.0))
    for t, w in zip(slow["t"], slow["w"], strict=True):
        data += message("D", struct.pack("<HQdd", 2, round(t * 1e6) + 5_000_000, w, -w))
    return data


def write_tdms(path: Path, fast: dict[str, Any], slow: dict[str, Any]) -> None:
    nptdms = pytest.importorskip("nptdms", reason="needs the extra tdms")
    step = {"wf_increment": 0.02, "wf_start_offset": 0.0, "unit_string": "N"}
    channels = [nptdms.ChannelObject("motion", name, fast[name]) for name in "txv"]
    channels += [nptdms.ChannelObject("drive", "force", slow["w"], properties=step)]
    channels += [nptdms.ChannelObject("drive", "alone", slow["w"]), nptdms.ChannelObject("drive", "text", ["a", "b"])]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)


WRITERS: dict[str, Callable[[Path, dict[str, Any], dict[str, Any]], None]] = {
    ".mf4": write_mdf,
    ".ulg": write_ulog,
    ".tdms": write_tdms,
}


@pytest.fixture(params=ENDINGS)
def ending(request: Any) -> str:
    return str(request.param)


def test_values(tmp_path: Path, spec: Any, ending: str) -> None:
    """The motion as it was written; the force, logged at a tenth of the rate, on lines between its samples."""
    path = tmp_path / f"a{ending}"
    WRITERS[ending](path, MADE, SLOW)
    log = read_log(path, spec, columns=NAMES[ending])
    n = len(log.time)
    assert n == 2491 and log.sample_time == pytest.approx(0.002, rel=1e-9)
    assert np.allclose(log.positions[:, 0], MADE["x"][:n], atol=1e-15)
    assert np.allclose(log.velocities[:, 0], MADE["v"][:n], atol=1e-15)
    assert np.allclose(log.inputs[:, 0], np.interp(MADE["t"][:n], SLOW["t"], SLOW["w"]), atol=1e-8)
    assert any("(50 Hz) is converted to the times of" in note and "linear interpolation" in note for note in log.notes)


def test_names_that_are_not_there(tmp_path: Path, spec: Any, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    WRITERS[ending](path, MADE, SLOW)
    near = NAMES[ending]["v"]
    with refused(f"LOG003 `{near}y`"):
        read_log(path, spec, columns=NAMES[ending] | {"v": f"{near}y"})


def test_time_that_runs_backwards(tmp_path: Path, spec: Any, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    time = MADE["t"].copy()
    time[100] = 0.0
    WRITERS[ending](path, MADE | {"t": time}, SLOW)
    if ending == ".ulg":
        path.write_bytes(ulog_messages(MADE | {"t": time}, SLOW))
    with refused("LOG007 100"):
        read_log(path, spec, columns=NAMES[ending])


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.9])
def test_cut_off(tmp_path: Path, spec: Any, ending: str, share: float) -> None:
    """One message; what is whole of a ULog that ends early, as flights do, may be read."""
    path = tmp_path / f"a{ending}"
    WRITERS[ending](path, MADE, SLOW)
    path.write_bytes(path.read_bytes()[: round(share * path.stat().st_size)])
    try:
        log = read_log(path, spec, columns=NAMES[ending])
    except BadInput as error:
        assert f"a{ending}" in str(error) and "\n" not in str(error) and len(str(error)) < 700
    else:
        assert ending != ".mf4" and np.allclose(log.positions[:, 0], MADE["x"][: len(log.time)])


def test_counted(tmp_path: Path, spec: Any, ending: str, monkeypatch: Any) -> None:
    path = tmp_path / f"a{ending}"
    WRITERS[ending](path, MADE, SLOW)
    monkeypatch.setattr(log_source, "LARGEST", 50_000)
    with refused("LOG010 50000"):
        read_log(path, spec, columns=NAMES[ending])


def test_not_installed(tmp_path: Path, spec: Any, ending: str, monkeypatch: Any) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(extras.importlib, "import_module", absent)
    with refused("TOOL003 'stiction["):
        read_log(tmp_path / f"a{ending}", spec)


def test_no_such_format(tmp_path: Path, spec: Any, ending: str) -> None:
    pytest.importorskip({".mf4": "asammdf", ".ulg": "pyulog", ".tdms": "nptdms"}[ending])
    for data in (b"", b"no log at all", bytes(300)):
        (tmp_path / f"a{ending}").write_bytes(data)
        with refused(f"LOG001 a{ending}:"):
            read_log(tmp_path / f"a{ending}", spec)


def test_mdf_evaluates_no_formula(tmp_path: Path, spec: Any) -> None:
    write_mdf(tmp_path / "a.mf4", MADE, SLOW)
    with refused("LOG003 `formula`"):
        read_log(tmp_path / "a.mf4", spec, columns={"v": "formula"})
    log = read_log(tmp_path / "a.mf4", spec, columns={"v": "twice@2"})
    assert np.allclose(log.velocities[:, 0], np.interp(log.time, SLOW["t"], SLOW["v"]))


def test_tdms_without_times(tmp_path: Path, spec: Any) -> None:
    write_tdms(tmp_path / "a.tdms", MADE, SLOW)
    with refused("LOG003 `drive.alone` `wf_increment`"):
        read_log(tmp_path / "a.tdms", spec, columns=NAMES[".tdms"] | {"w": "drive.alone"})


def test_tdms_with_the_sample_time_of_the_description(tmp_path: Path, spec: Any) -> None:
    """Channels that a program wrote as plain arrays: the message was `no signal of numbers` alone."""
    nptdms = pytest.importorskip("nptdms", reason="needs the extra tdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("motion", name, MADE[name]) for name in ("x", "w")])
    names = {"x": "motion.x", "w": "motion.w"}
    with refused("LOG001 motion.x `wf_increment` `sample_time: SECONDS`"):
        read_log(tmp_path / "a.tdms", spec, columns=names)
    (tmp_path / "meta.yaml").write_text("sample_time: 2 ms\n")
    log = read_log(tmp_path / "a.tdms", spec, columns=names)
    assert log.sample_time == pytest.approx(0.002) and log.size == len(MADE["x"])
    assert np.allclose(log.positions[:, 0], MADE["x"])
