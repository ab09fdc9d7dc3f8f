"""Parquet logs that pyarrow wrote, in LeRobot's layout and others, and what is no log among them."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.description import LogDescription
from codegen.logs.file_formats import open_stream
from codegen.logs.formats import parquet_file
from codegen.logs.formats import source as log_source
from tests.expected_errors import refused

pa = pytest.importorskip("pyarrow", reason="needs the extra parquet")
pq = pytest.importorskip("pyarrow.parquet")

MADE = {name: values[:2500] for name, values in rows().items()}
NAMES = {"t": "timestamp", "x": "observation.state[1]", "v": "v", "w": "current"}


def lerobot(vectors: Any = None) -> Any:
    """Two episodes in one file, as LeRobot v3 writes them; the second is the sliding mass."""
    n = len(MADE["t"])
    state = np.stack([np.zeros(2 * n), np.tile(MADE["x"], 2)], axis=1)
    state[:n] = 0.5
    vectors = vectors or (lambda v: pa.FixedSizeListArray.from_arrays(pa.array(v.ravel()), 2))
    return pa.table(
        {
            "observation.state": vectors(state),
            "action": vectors(state + 0.01),
            "v": np.tile(MADE["v"], 2),
            "current": np.tile(MADE["w"], 2),
            "timestamp": np.tile(MADE["t"], 2),
            "episode_index": np.repeat(np.arange(2), n),
            "task": ["push"] * (2 * n),
        }
    )


LISTS = {
    "fixed": None,
    "lists": lambda v: pa.array(v.tolist()),
    "large lists": lambda v: pa.array(v.tolist(), pa.large_list(pa.float64())),
}


@pytest.mark.parametrize("kind", LISTS)
@pytest.mark.parametrize("compression", ["snappy", "zstd", "none"])
def test_lerobot(tmp_path: Path, spec: Any, kind: str, compression: str) -> None:
    pq.write_table(lerobot(LISTS[kind]), tmp_path / "a.parquet", compression=compression, row_group_size=900)
    with refused("LOG007 timestamp(2501): 4.998 0.0"):
        read_log(tmp_path / "a.parquet", spec, columns=NAMES)
    (tmp_path / "meta.yaml").write_text("rows: {episode_index: 1}\n")
    log = read_log(tmp_path / "a.parquet", spec, columns=NAMES)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"])


def test_an_action_is_no_torque(tmp_path: Path, spec: Any) -> None:
    """It is a position; the servo's law, said as an expression of columns, makes a torque of it."""
    pq.write_table(lerobot().slice(2500), tmp_path / "a.parquet")
    with refused("LOG012 `action[1]` w N 25*("):
        read_log(tmp_path / "a.parquet", spec, columns=NAMES | {"w": "action[1]"})
    law = "400*(action_1_ - observation_state_1_)"
    log = read_log(tmp_path / "a.parquet", spec, columns=NAMES | {"w": law})
    assert np.allclose(log.inputs, 4.0)


def test_times_as_such(tmp_path: Path, spec: Any) -> None:
    stamps = 1_700_000_000_000_000 + np.round(MADE["t"] * 1e6).astype(np.int64)
    for unit, array in (
        ("us", pa.array(stamps, pa.timestamp("us"))),
        ("ns", pa.array(stamps * 1000, pa.duration("ns"))),
    ):
        pq.write_table(pa.table({"t": array, "x": MADE["x"], "w": MADE["w"]}), tmp_path / f"{unit}.parquet")
        log = read_log(tmp_path / f"{unit}.parquet", spec)
        assert log.sample_time == pytest.approx(0.002, rel=1e-12) and np.array_equal(log.positions[:, 0], MADE["x"])


def test_missing_values(tmp_path: Path, spec: Any) -> None:
    x = MADE["x"].tolist()
    x[7] = None
    pq.write_table(pa.table({"t": MADE["t"], "x": x, "w": MADE["w"]}), tmp_path / "a.parquet")
    with refused("LOG006 x(8): 1 2500"):
        read_log(tmp_path / "a.parquet", spec)


def test_a_long_log_comes_in_blocks(tmp_path: Path) -> None:
    n = 200_000
    table = pa.table({"t": np.arange(n) / 1000, "x": np.arange(n), "w": np.arange(n) % 7})
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=70_000)
    blocks = list(open_stream(tmp_path / "a.parquet", LogDescription()).blocks(["w", "x"]))
    assert max(len(b.values) for b in blocks) <= parquet_file.ROWS < n
    assert np.array_equal(np.concatenate([b.values for b in blocks])[:, 1], np.arange(n))


def test_only_the_wanted_columns_are_decoded(tmp_path: Path, spec: Any) -> None:
    """A column that is damaged is none of the log's concern where it is not asked for."""
    other = np.random.default_rng(1).integers(0, 1 << 60, 2500)
    table = pa.table({"other": other, **{k: MADE[k] for k in "txw"}})
    pq.write_table(table, tmp_path / "a.parquet", compression="none", use_dictionary=False)
    data = bytearray((tmp_path / "a.parquet").read_bytes())
    data[4:400] = b"\xff" * 396
    (tmp_path / "a.parquet").write_bytes(data)
    assert np.array_equal(read_log(tmp_path / "a.parquet", spec).positions[:, 0], MADE["x"])
    with refused("LOG001 a.parquet:"):
        read_log(tmp_path / "a.parquet", spec, columns={"x": "other"})


def test_refusals(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(pickle, "loads", lambda *a, **k: pytest.fail("unpickled"))

    def written_is_refused(table: Any, expected: str) -> None:
        pq.write_table(table, tmp_path / "a.parquet")
        with refused(expected):
            read_log(tmp_path / "a.parquet", spec)

    written_is_refused(pa.table({"t": ["a"], "x": [b"\x80\x04."]}), "LOG001 t, x")
    written_is_refused(pa.table({name: pa.array([], pa.float64()) for name in "txw"}), "LOG009 a.parquet:")
    written_is_refused(pa.table({"t": [1.0], "x": ["a"], "w": [1.0]}), "LOG003 `x` string")
    four = [pa.array([0.0, 1.0]) for _ in range(4)]  # of w the second x was read
    written_is_refused(pa.Table.from_arrays(four, names=["t", "x", "w", "x"]), "LOG004 two columns called `x`")
    ragged = {"t": [0.0, 1.0], "x": [1.0, 2.0], "q": [[1.0, 2.0], [1.0]]}
    pq.write_table(pa.table(ragged), tmp_path / "b.parquet")
    with refused("LOG005 q[1](2): 1"):
        read_log(tmp_path / "b.parquet", spec, columns={"w": "q[1]"})
    for text in ("rows: {episode: 1}\n", "rows: {t: 17}\n"):
        (tmp_path / "meta.yaml").write_text(text)
        with pytest.raises(BadInput, match=r"meta\.yaml:1: rows"):
            read_log(tmp_path / "b.parquet", spec, columns={"w": "q[0]"})


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_cut_off(tmp_path: Path, spec: Any, share: float) -> None:
    pq.write_table(lerobot(), tmp_path / "a.parquet")
    data = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "a.parquet").write_bytes(data[: round(share * len(data))])
    with refused("LOG001 a.parquet:"):
        read_log(tmp_path / "a.parquet", spec, columns=NAMES)


def test_rows_are_counted_before_they_are_unpacked(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    """A run of one value takes some bytes for millions of rows."""
    n = 3_000_000
    pq.write_table(pa.table({name: np.zeros(n) for name in "txw"}), tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").stat().st_size < 100_000
    monkeypatch.setattr(log_source, "LARGEST", 40_000_000)
    monkeypatch.setattr(parquet_file.ParquetFile, "blocks", lambda *a: pytest.fail("unpacked"))
    with refused("LOG010 a.parquet: 72000000"):
        read_log(tmp_path / "a.parquet", spec)
