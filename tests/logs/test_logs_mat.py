"""MATLAB logs against what SciPy writes and reads."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.formats import mat_file
from codegen.logs.formats.mat_file import variables
from tests.expected_errors import matches, refused
from tests.slow_cases import examples


@pytest.mark.parametrize("form", [{"format": "4"}, {"format": "5"}, {"format": "5", "do_compression": True}])
def test_values_come_back(tmp_path, spec, form):
    made = rows()
    savemat(tmp_path / "a.mat", {**made, "note": "text", "gain": 2.0}, **form)
    log = read_log(tmp_path / "a.mat", spec)
    assert np.array_equal(log.positions[:, 0], made["x"]) and np.array_equal(log.inputs[:, 0], made["w"])
    assert np.array_equal(log.velocities[:, 0], made["v"])


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "bool"])
def test_every_number_type_as_scipy_reads_it(tmp_path, kind, compressed):
    values = (np.arange(37) * 3).astype(kind)
    savemat(
        tmp_path / "a.mat", {"x": values, "name_longer_than_four": values.reshape(-1, 1)}, do_compression=compressed
    )
    found = {v.name: v for v in variables((tmp_path / "a.mat").read_bytes(), lambda size: None)}
    for name, theirs in loadmat(tmp_path / "a.mat").items():
        if not name.startswith("__"):
            assert np.array_equal(found[name].vector(), theirs.reshape(-1).astype(float))
            assert found[name].shape == theirs.shape


REFUSED = {
    "complex": ({"x": np.arange(9) * 1j}, "LOG005 a.mat 1×9"),
    "matrix": ({"x": np.ones((9, 2))}, "LOG005 a.mat 9×2"),
    "empty": ({"x": np.zeros((0, 1))}, "LOG005"),
    "struct": ({"x": {"a": 1}}, "LOG005 1×1"),
    "cell": ({"x": np.array(["a", 1.0], dtype=object)}, "LOG005 1×2"),
    "text": ({"x": "hello"}, "LOG005"),
    "short": ({"x": np.arange(8.0)}, "LOG011 8 9 `t`"),
    "missing": ({"pos": np.arange(9.0)}, "LOG003 `x`"),
    "nan": ({"x": np.where(np.arange(9) == 4, np.nan, 1.0)}, "LOG006 a.mat x(5) 1 9"),
    "backwards": ({"x": np.ones(9), "t": np.r_[0:8, 3]}, "LOG007 a.mat t(9)"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(tmp_path, spec, case):
    change, words = REFUSED[case]
    savemat(tmp_path / "a.mat", {"t": np.arange(9.0), "w": np.ones(9), **change})
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "a.mat", spec)
    assert matches(caught.value, words)


def test_format_7_3_and_garbage(tmp_path, spec):
    for data, words in (
        (b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n", "(?i)hdf5"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "(?i)hdf5"),
        (b"garbage" * 30, "damaged"),
        (b"", "empty"),
        (b"\x00" * 30, "no variable|empty|no vector"),
    ):
        (tmp_path / "a.mat").write_bytes(data)
        with pytest.raises(BadInput, match=words):
            read_log(tmp_path / "a.mat", spec)
    savemat(tmp_path / "b.mat", {"t": 1.0, "s": {"a": 1}})
    with refused("LOG001 b.mat: t (double 1×1), s (struct"):
        read_log(tmp_path / "b.mat", spec)


@settings(max_examples=examples(400), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_damage(tmp_path, spec, data):
    path = tmp_path / "f.mat"
    form = data.draw(st.sampled_from([{"format": "4"}, {"format": "5"}, {"format": "5", "do_compression": True}]))
    more = {} if form["format"] == "4" else {"s": {"a": np.arange(20.0), "b": {"c": 1.0}}}
    savemat(path, {"t": np.arange(20.0), "x": np.arange(20.0), "w": np.arange(20, dtype=np.int16), **more}, **form)
    damaged = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(
        bytes(damaged[: data.draw(st.integers(0, len(damaged)))]) if data.draw(st.booleans()) else bytes(damaged)
    )
    try:
        read_log(path, spec)
    except BadInput as error:
        assert "\n" not in str(error)


@settings(max_examples=examples(200), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=400), st.sampled_from([b"", b"M" * 124 + b"\x00\x01IM", b"M" * 124 + b"\x01\x00MI", b"\0\0\0\0"])
)
def test_any_bytes(tmp_path, spec, data, head):
    (tmp_path / "f.mat").write_bytes(head + data)
    with pytest.raises(BadInput):
        read_log(tmp_path / "f.mat", spec)


def test_fields_of_structs_and_columns_of_matrices(tmp_path, spec):
    made = rows()
    t, x, w = (made[name] for name in ("t", "x", "w"))
    channels = np.zeros(2, dtype=[("Name", object), ("Data", object)])
    channels[0], channels[1] = ("pos", x), ("force", w)
    content = {
        "log": {"t": t, "x": x, "w": w, "note": "a text"},
        "rec": {"X": {"Data": t}, "Y": channels},
        "table": np.column_stack([t, x, w]),
        "flat": np.vstack([t, x, w]).astype("f4"),
    }
    ways = [("log.t", "log.x", "log.w"), ("rec.X.Data", "rec.Y(1).Data", "rec.Y(2).Data")]
    ways += [tuple(f"{name}.{k}" for k in (1, 2, 3)) for name in ("table", "flat")]
    for compressed in (False, True):
        savemat(tmp_path / "a.mat", content, do_compression=compressed)
        for way in ways:
            log = read_log(tmp_path / "a.mat", spec, columns=dict(zip(("t", "x", "w"), way, strict=True)))
            limit = 1e-6 if way[0].startswith("flat") else 0.0
            assert np.abs(log.positions[:, 0] - x).max() <= limit and np.abs(log.inputs[:, 0] - w).max() <= limit
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.mat", spec)
    assert all(name in str(told.value) for way in ways for name in way), told.value
    for column, words in (("table", "`table.1` to `table.3`"), ("rec", "rec.X.Data")):
        with pytest.raises(BadInput) as told:
            read_log(tmp_path / "a.mat", spec, columns={"t": "log.t", "x": column, "w": "log.w"})
        assert words in str(told.value)


def test_joints_by_one_by_samples(tmp_path, spec):
    made = rows(duration=5.0)
    three = {name: np.stack([0 * v, v], axis=0)[:, None, :] for name, v in made.items() if name != "t"}
    savemat(tmp_path / "a.mat", {"log": {**three, "t": made["t"]}})
    where = {"t": "log.t", "x": "log.x.2", "v": "log.v.2", "w": "log.w.2"}
    log = read_log(tmp_path / "a.mat", spec, columns=where)
    assert np.array_equal(log.positions[:, 0], made["x"]) and np.array_equal(log.inputs[:, 0], made["w"])


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


@pytest.mark.parametrize("name", ["data", "logsout"])
def test_objects_of_matlab_say_how_to_save_their_vectors(tmp_path, spec, name):
    """An opaque variable as MATLAB writes a timeseries: flags, name, MCOS, class, and a reference."""
    inside = [element(6, struct.pack("<II", 17, 0)), element(1, name.encode()), element(1, b"MCOS")]
    inside += [element(1, b"timeseries"), element(14, b"")]
    savemat(tmp_path / "a.mat", {"t": 1.0})
    (tmp_path / "a.mat").write_bytes((tmp_path / "a.mat").read_bytes() + element(14, b"".join(inside)))
    with refused(f"LOG001 {name} timeseries ts.Time save"):
        read_log(tmp_path / "a.mat", spec)
    savemat(tmp_path / "a.mat", {"t": np.arange(9.0), "w": np.ones(9)})
    (tmp_path / "a.mat").write_bytes((tmp_path / "a.mat").read_bytes() + element(14, b"".join(inside)))
    with refused("LOG005 timeseries ts.Time save"):
        read_log(tmp_path / "a.mat", spec, columns={"x": name})


@pytest.mark.parametrize("number", [4, 6])  # text; double
def test_the_variables_within_structs_are_counted_too(number, monkeypatch):
    """A file of 5 MB took 150 s and 1.4 GB: structs in a struct, each with 9000 numbers."""
    inner = element(
        14,
        element(6, struct.pack("<II", number, 0))
        + element(5, struct.pack("<2i", 1, 1))
        + element(1, b"")
        + element(9, bytes(8)),
    )

    def struct_of(fields: list[bytes], name: bytes) -> bytes:
        names = b"".join(f"f{k}".encode().ljust(8, b"\0") for k in range(len(fields)))
        head = element(6, struct.pack("<II", 2, 0)) + element(5, struct.pack("<2i", 1, 1)) + element(1, name)
        return element(14, head + element(5, struct.pack("<i", 8)) + element(1, names) + b"".join(fields))

    read = []
    own = mat_file._matrix
    monkeypatch.setattr(mat_file, "_matrix", lambda *given: read.append(given) or own(*given))
    data = (
        b"MATLAB 5.0".ljust(124)
        + struct.pack("<H", 0x100)
        + b"IM"
        + struct_of([struct_of([inner] * 200, b"")] * 200, b"s")
    )
    with pytest.raises(ValueError, match="more than 10000 variables"):
        variables(data, lambda _: None)
    assert len(read) <= 10_000
