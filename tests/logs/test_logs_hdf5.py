"""HDF5 logs that h5py wrote, MATLAB's layout of format 7.3 among them, and what is no log."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.formats import hdf5_file
from codegen.logs.formats import source as extras
from codegen.logs.formats import source as log_source
from tests.expected_errors import refused

h5py = pytest.importorskip("h5py", reason="needs the extra hdf5")

MADE = {name: values[:2500] for name, values in rows().items()}


def write(path: Path, **datasets: Any) -> Path:
    with h5py.File(path, "w") as file:
        for name, values in datasets.items():
            file[name] = values
    return path


def check(log: Any) -> None:
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"]) and log.sample_time == pytest.approx(0.002)


@pytest.mark.parametrize("compression", [None, "gzip", "lzf"])
def test_datasets(tmp_path: Path, spec: Any, compression: str | None, monkeypatch: Any) -> None:
    monkeypatch.setattr(hdf5_file, "ROWS", 700)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in MADE.items():
            file.create_dataset(name, data=values, compression=compression, chunks=(300,))
        file["self"] = h5py.SoftLink("/")
        file["again"] = file["/"]
    check(read_log(tmp_path / "a.h5", spec))


def test_groups_tables_and_fields(tmp_path: Path, spec: Any) -> None:
    fields = np.zeros(2500, dtype=[("w", "<f4"), ("flag", "i1"), ("name", "S4")])
    fields["w"] = MADE["w"]
    table = np.column_stack([MADE["t"], MADE["x"], MADE["v"]])
    path = write(
        tmp_path / "a.hdf5", **{"data/demo_0/joints": table, "data/demo_0/raw": fields, "column": table[:, :1]}
    )
    names = {"t": "column", "x": "data/demo_0/joints[1]", "v": "data/demo_0/joints[2]", "w": "data/demo_0/raw.w"}
    log = read_log(path, spec, columns=names)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.velocities[:, 0], MADE["v"])
    assert np.array_equal(log.inputs[:, 0], MADE["w"].astype(np.float32))


def test_matlab_7_3(tmp_path: Path, spec: Any) -> None:
    """Its layout: 512 bytes of text before, N × c stored as c × N, a structure as a group, cells as references."""
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"t": MADE["t"], "run/x": MADE["x"], "run/w": MADE["w"], "both": None}.items():
            data = np.stack([MADE["v"], MADE["w"]]) if values is None else values[None, :]
            dataset = file.create_dataset(name, data=data)
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
        file["#refs#/a"] = 1.0
        file.create_dataset("cell", data=[file["t"].ref], dtype=h5py.ref_dtype)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .")
    check(read_log(path, spec, columns={"x": "run/x", "w": "run/w", "v": "both[0]"}))
    with refused("LOG003 `cell` cell(1)"):
        read_log(path, spec, columns={"x": "cell"})


def test_matlab_7_3_arrays_of_structs_and_objects(tmp_path: Path, spec: Any) -> None:
    """A scope's structure with time: its signals are references, and some of them lead in a circle; a timeseries."""
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["scope/time"] = MADE["t"][None, :]
        for k, name in enumerate("xvw"):
            file[f"#refs#/{k}"] = MADE[name][None, :]
        targets = [file[f"#refs#/{k}"].ref for k in range(3)]
        values = file.create_dataset("scope/signals/values", data=[targets], dtype=h5py.ref_dtype)
        inner = file.create_dataset("#refs#/inner", data=[values.ref], dtype=h5py.ref_dtype)
        file.create_dataset("around", data=[inner.ref, file["scope"].ref], dtype=h5py.ref_dtype)
        inner[0] = inner.ref
        series = file.create_dataset("ts", data=np.arange(6, dtype=np.uint32)[:, None])
        series.attrs["MATLAB_object_decode"] = np.int32(3)
        file["names"] = ["x", "v", "w"]
    names = dict(zip("xvw", (f"scope/signals/values({k})" for k in (1, 2, 3)), strict=True))
    check(read_log(tmp_path / "a.mat", spec, columns={"t": "scope/time", **names}))
    for name, why in (("ts", "object ts.Time save"), ("names", "no numbers")):
        with refused(f"LOG003 `{name}` {why}"):
            read_log(tmp_path / "a.mat", spec, columns={"t": "scope/time", **names, "x": name})


def test_a_reference_to_what_was_removed_spoils_no_other_column(tmp_path: Path, spec: Any) -> None:
    """The whole file was refused as damaged."""
    with h5py.File(write(tmp_path / "a.h5", **MADE), "a") as file:
        file["gone"] = MADE["x"]
        file.create_dataset("cell", data=[file["x"].ref, file["gone"].ref], dtype=h5py.ref_dtype)
        del file["gone"]
    check(read_log(tmp_path / "a.h5", spec, columns={"x": "cell(1)"}))
    with refused("LOG003 `cell(2)` removed from the file"):
        read_log(tmp_path / "a.h5", spec, columns={"x": "cell(2)"})


@pytest.mark.parametrize("matlab", [True, False])
def test_joints_by_one_by_samples(tmp_path: Path, spec: Any, matlab: bool) -> None:
    """MATLAB's joints × 1 × samples, as YARP's telemetry writes them, and the same of another writer."""
    with h5py.File(tmp_path / "a.mat", "w") as file:
        for name, values in MADE.items():
            three = np.stack([0 * values, values, 0 * values], axis=1)[:, None, :]
            file[f"log/{name}"] = values if name == "t" else three
            if matlab:
                file[f"log/{name}"].attrs["MATLAB_class"] = np.bytes_("double")
    where = {"t": "log/t", "x": "log/x[1]", "v": "log/v[1]", "w": "log/w[1]"}
    check(read_log(tmp_path / "a.mat", spec, columns=where))


def test_nothing_outside_the_file_is_read(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(pickle, "loads", lambda *a, **k: pytest.fail("unpickled"))
    write(tmp_path / "other.h5", x=MADE["x"])
    (tmp_path / "raw").write_bytes(MADE["x"].tobytes())
    layout = h5py.VirtualLayout(shape=(2500,), dtype="f8")
    layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "x", shape=(2500,))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["w"] = MADE["t"], MADE["w"]
        file["link"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "x")
        file.create_dataset("raw", shape=(2500,), dtype="f8", external=[(str(tmp_path / "raw"), 0, 20_000)])
        file.create_virtual_dataset("virtual", layout)
        file["object"] = np.void(pickle.dumps(Path("a")))
    for name, words in {
        "link": "no column `link`",
        "raw": "no column `raw`: its numbers lie in other files",
        "virtual": "no column `virtual`: its numbers lie in other files",
        "object": "no column `object`: a single value",
    }.items():
        with pytest.raises(BadInput, match=words):
            read_log(tmp_path / "a.h5", spec, columns={"x": name})


def test_refusals(tmp_path: Path, spec: Any) -> None:
    cases = {
        "no dataset of numbers": {"t": ["a", "b"]},
        "no dataset of numbers .no dataset.": {},
        "9 values; expected 2500 values as in `t`": {**MADE, "x": MADE["x"][:9]},
        "no column `x`: it is empty": {**MADE, "x": np.zeros(0)},
        "no column `x`: it has 3 dimensions": {**MADE, "x": np.zeros((2, 2, 2))},
        r"t\(1301\): time runs backwards": {**MADE, "t": np.where(np.arange(2500) == 1300, 0.0, MADE["t"])},
    }
    for words, datasets in cases.items():
        with pytest.raises(BadInput, match=words):
            read_log(write(tmp_path / "a.h5", **datasets), spec)
    (tmp_path / "b.h5").write_bytes(b"no HDF5")
    with refused("LOG001 b.h5:"):
        read_log(tmp_path / "b.h5", spec)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_cut_off(tmp_path: Path, spec: Any, share: float) -> None:
    data = write(tmp_path / "a.h5", **MADE).read_bytes()
    (tmp_path / "a.h5").write_bytes(data[: round(share * len(data))])
    with refused("LOG001 a.h5:"):
        read_log(tmp_path / "a.h5", spec)


def test_a_chunk_that_swells(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    """A chunk that unpacks to 400 MB where 800 bytes belong, with 200 MB allowed."""
    import zlib

    monkeypatch.setattr(extras, "MOST_MEMORY", 200_000_000)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "txw":
            dataset = file.create_dataset(name, shape=(100,), chunks=(100,), dtype="f8", compression="gzip")
            dataset.id.write_direct_chunk((0,), zlib.compress(bytes(400_000_000 if name == "x" else 800), 1))
    with refused("LOG001 a.h5:"):
        read_log(tmp_path / "a.h5", spec)


def test_rows_are_counted_before_they_are_read(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "txw":
            file.create_dataset(name, shape=(10**12,), chunks=(1000,), dtype="f8")
    with refused("LOG010 a.h5: 24000000000000"):
        read_log(tmp_path / "a.h5", spec)
    assert log_source.LARGEST == 10**9


def test_a_long_chunk_is_unpacked_once(tmp_path: Path, spec: Any, monkeypatch: Any) -> None:
    """A file of 240 kB, a chunk of 10 million rows for each column, took 140 s: unpacked for each block of rows."""
    many = len(MADE["t"])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in MADE.items():
            file.create_dataset(name, data=values, chunks=(many,), compression="gzip")
    read: list[slice] = []
    own = hdf5_file._Column.values
    monkeypatch.setattr(hdf5_file._Column, "values", lambda self, *given: read.append(given[1]) or own(self, *given))
    monkeypatch.setattr(hdf5_file, "ROWS", many // 10)
    check(read_log(tmp_path / "a.h5", spec))
    assert set(map(repr, read)) == {repr(slice(0, many))}
