"""JSON and .npz logs: what is read from them, and one message for what is not."""

from __future__ import annotations

import io
import json
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import FORMATS, read_log
from codegen.logs.formats import source as log_source
from tests.expected_errors import matches, refused
from tests.slow_cases import examples

MADE = {name: values[:200] for name, values in rows().items()}
RECORDS = [dict(zip(MADE, map(float, row), strict=True)) for row in zip(*MADE.values(), strict=True)]
LISTS = {name: values.tolist() for name, values in MADE.items()}
TABLES = {
    "a list of records": (RECORDS, ""),
    "records beside scalars": ({"mass": 2, "name": "rig", "entries": RECORDS}, ""),
    "an object of lists": (LISTS, ""),
    "an object of lists beside scalars": ({"mass": 2, **LISTS}, ""),
    "an object of lists under a key": ({"mass": 2, "data": LISTS}, ""),
    "one record of lists": ([LISTS], ""),
    "one record of lists beside others": ({"gains": [1, 2], "log": [{"rate": 500, **LISTS}]}, "records: log\n"),
    "one of two records of lists": ({"runs": [{k: v[:9] for k, v in LISTS.items()}, LISTS]}, "records: runs.1\n"),
    "a list of rows": ([list(r.values()) for r in RECORDS], "columns: {t: 1, x: 2, v: 3, w: 4}\n"),
    "a list of rows with names beside them": (
        {"index": [0, 1], "columns": list(RECORDS[0]), "data": [list(r.values()) for r in RECORDS]},
        "",
    ),
    "one of two tables": ({"a": RECORDS[:5], "b": RECORDS}, "records: b\n"),
    "records in records": (
        [{"t": r["t"], "axis": {"x": r["x"], "v": [0, r["v"]]}, "w": [[r["w"]]], "mode": "run"} for r in RECORDS],
        "columns: {x: axis.x, v: 'axis.v[1]', w: 'w[0][0]'}\n",
    ),
    "an object of lists of lists": (
        {
            "names": ["a", "b"],
            "t": LISTS["t"],
            "q": [[x, 0] for x in LISTS["x"]],
            "drive": {"w": LISTS["w"], "v": LISTS["v"]},
        },
        "columns: {x: 'q[0]', v: drive.v, w: drive.w}\n",
    ),
}


@pytest.mark.parametrize("case", TABLES)
def test_json(tmp_path, spec, case):
    content, about = TABLES[case]
    (tmp_path / "a.json").write_text(json.dumps(content))
    (tmp_path / "meta.yaml").write_text(about or "missing: refuse\n")
    log = read_log(tmp_path / "a.json", spec)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"])


@pytest.mark.parametrize("name", ["a.jsonl", "a.ndjson", "a.json"])
def test_a_record_a_line(tmp_path, spec, name):
    text = "".join(json.dumps(record) + "\n" for record in RECORDS)
    (tmp_path / name).write_text(text + '\n{"t": 0.4, "x": ')
    log = read_log(tmp_path / name, spec)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert "line 202, the last one, is cut off and not read" in log.notes
    (tmp_path / name).write_text('{"t": 0}\n{"t": 1, x}\n{"t": 2}\n')
    with refused(f"LOG001 {name}:2 JSON"):
        read_log(tmp_path / name, spec)


def test_json_words_for_numbers(tmp_path, spec):
    entries = [{"t": k / 100, "x": k % 2 == 0, "w": k} for k in range(8)] + [{"t": 0.08, "x": None, "w": 8}]
    (tmp_path / "a.json").write_text(json.dumps(entries))
    (tmp_path / "meta.yaml").write_text("missing: fill\n")
    with refused("LOG006 a.json: x(9): 1 9 1%"):
        read_log(tmp_path / "a.json", spec)
    (tmp_path / "a.json").write_text(json.dumps(entries[:8]))
    assert read_log(tmp_path / "a.json", spec).positions[:4, 0].tolist() == [1, 0, 1, 0]


REFUSED = {
    "": "LOG009",
    "{": "LOG001 a.json:1",
    "[1, 2]": "LOG001",
    "3": "LOG001",
    '{"a": []}': "LOG001",
    "[" * 100_000: "LOG001",
    "[" + "9" * 5000 + "]": "LOG001",
    '[{"t": 0}, 3]': "LOG005 1 `3`",
    "[[1, 2], [1]]": "LOG005 1 `[1]` 2",
    '{"a": [{"t": 0}], "b": [{"t": 0}]}': "LOG001 2 `records KEY`",
    '[{"t": [0, 1, 2], "x": [1, 2, 3]}, {"t": [0, 1, 2], "x": [1, 2, 3]}]': "LOG001 2 `records NUMBER` 0 1",
    '[{"id": 7, "t": [0, 1, 2], "x": [1, 2, 3]}, {"id": 8, "t": [0, 1], "x": [1, 2]}]': "LOG001 2 `records NUMBER`",
    '{"t": [0, 1], "x": [1], "w": [1, 2]}': "LOG011 1 2 `t`",
    '[{"t": 0, "x": "abc", "w": 1}, {"t": 1, "x": 2, "w": 1}]': 'LOG005 [0].x `"abc"`',
    '[{"t": 0, "w": 1}, {"t": 1, "w": 1}]': "LOG003 `x`",
    '[{"t": 0, "x": 1e999, "w": 1}, {"t": 1, "x": 0, "w": 1}]': "LOG006",
    '[{"t": 0, "x": 1' + "0" * 400 + ', "w": 1}, {"t": 1, "x": 0, "w": 1}]': "LOG006",
}


REFUSED |= {
    '[{"t": 0, "x": 0, "w": 1, "x": 5}, {"t": 1, "x": 0, "w": 1}]': "LOG004 the key `x` twice",
    '{"t": [0, 1], "x": [0, 1], "w": [1, 1], "x": [5, 6]}': "LOG004 the key `x` twice",
    '[{"t": 0, "w": 1, "x": 5}, {"t": 1, "x": 0, "w": 1, "w": 1}': "LOG004 the key `w` twice",
    '[{"t": "00:00:01.0", "w": 1, "x": 5}, {"t": 0.1, "x": 0, "w": 1}]': "LOG005 [1].t",
    '[{"t": 0, "w": 1, "x": "00:00:01.0"}, {"t": 0.1, "x": 0, "w": 1}]': "LOG005 [1].x",
    "[" + json.dumps([f"c{k}" for k in range(8000)]) + "]": "LOG010 4096",
    json.dumps({f"c{k}": [0, 1] for k in range(4094)} | {"t": [0, 1], "x": [0, 1], "w": [1, 1]}): "LOG010 4096",
    '[{t: 0, "x": 1}]': "LOG001 a.json:1 quotes)",
    '[["t", 1, 0], ["0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]': "LOG001 no JSON",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda t: t[:30])
def test_json_refusals(tmp_path, spec, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.json", spec)
    assert matches(told.value, REFUSED[text]) and "\n" not in str(told.value) and len(str(told.value)) < 500


@pytest.mark.parametrize(
    ("key", "words"),
    [(f"runs.{n}", "a number from 0 to 1") for n in ("2", "-1", "01", "+1", "0_1", "１", "x")]
    + [("run.0", "one of the keys runs"), ("runs.1.t.9", "a number from 0 to 2"), ("runs.0.y", "one of the keys t, x")],
)
def test_a_record_that_is_not_there_is_refused_with_those_that_are(tmp_path, spec, key, words):
    """-1 was the last one and 01 the second, without a word; 2 was asked to be a key."""
    record = {"t": [0, 1, 2], "x": [1, 2, 3]}
    (tmp_path / "a.json").write_text(json.dumps({"runs": [record, record]}))
    (tmp_path / "meta.yaml").write_text(f"records: '{key}'\n")
    with refused(f"LOG013 meta.yaml:1 records `{key}` {words}"):
        read_log(tmp_path / "a.json", spec)


def test_a_column_of_two_paths_is_refused(tmp_path, spec):
    """The last one was read without a word."""
    records = [{**r, "a.b": 1, "a": {"b": 2}} for r in RECORDS]
    (tmp_path / "a.json").write_text(json.dumps(records))
    assert read_log(tmp_path / "a.json", spec).positions.any()
    with refused("LOG004 a.json: a.b: a path of keys and also a key"):
        read_log(tmp_path / "a.json", spec, columns={"w": "a.b"})


@pytest.mark.parametrize("by_rows", [False, True])
def test_numbers_of_rows_sorted_as_texts_are_sorted_as_numbers(tmp_path, spec, by_rows):
    """``sort_keys`` writes "10" before "2": without a column of time the rows were read in this order."""
    columns = {n: {str(k): float(v) for k, v in enumerate(MADE[n])} for n in ("x", "w")}
    rows = {str(k): {n: float(MADE[n][k]) for n in ("x", "w")} for k in range(len(MADE["x"]))}
    (tmp_path / "a.json").write_text(json.dumps(rows if by_rows else columns, sort_keys=True))
    (tmp_path / "meta.yaml").write_text("sample_time: 2 ms\n")
    log = read_log(tmp_path / "a.json", spec)
    assert np.array_equal(log.positions[:, 0], MADE["x"])
    assert any("sorted by the numbers" in note for note in log.notes)


@pytest.mark.parametrize("way", ["an object", "a list"])
def test_units_beside_the_columns(tmp_path, spec, way):
    """They were ignored, and as a list they were taken for the names of the columns."""
    values = {"t": MADE["t"], "x": 1e3 * MADE["x"], "w": MADE["w"]}
    columns = {name: v.tolist() for name, v in values.items()}
    content = {**columns, "units": {"x": "mm", "w": "N"}}
    if way == "a list":
        content = {"data": np.column_stack(list(values.values())).tolist(), "units": ["s", "mm", "N"]}
        (tmp_path / "meta.yaml").write_text("columns: {t: 1, x: 2, w: 3}\n")
    (tmp_path / "a.json").write_text(json.dumps(content))
    log = read_log(tmp_path / "a.json", spec)
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=1e-12)


def test_json_is_counted_before_it_is_parsed(tmp_path, spec, monkeypatch):
    (tmp_path / "a.json").write_text("[" + "{}," * 10_000 + "{}]")
    monkeypatch.setattr(log_source, "LARGEST", 1_000_000)
    monkeypatch.setattr(json, "loads", lambda text: pytest.fail("parsed"))
    with refused("LOG010 a.json: 1000000"):
        read_log(tmp_path / "a.json", spec)


KEYS = st.sampled_from(["t", "x", "w", "v", ""])
VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=20,
)


@settings(max_examples=examples(100), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(VALUES)
def test_any_json(tmp_path, spec, content):
    (tmp_path / "f.json").write_text(json.dumps(content))
    try:
        log = read_log(tmp_path / "f.json", spec)
    except BadInput as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(log.positions).all()


PACKED = {
    "plain": lambda path: np.savez(path, **MADE),
    "compressed": lambda path: np.savez_compressed(path, **MADE, mass=2.0, names=np.array(["a"])),
    "columns and rows": lambda path: np.savez(
        path, **{k: v.reshape((1, -1) if k == "x" else (-1, 1)) for k, v in MADE.items()}
    ),
}


@pytest.mark.parametrize("case", PACKED)
def test_npz(tmp_path, spec, case):
    PACKED[case](tmp_path / "a.npz")
    log = read_log(tmp_path / "a.npz", spec)
    assert np.array_equal(log.positions[:, 0], MADE["x"]) and np.array_equal(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"]) and log.sample_time == 0.002


@pytest.mark.parametrize("order", ["C", "F"])
def test_npz_tables(tmp_path, spec, order):
    table = np.array(list(MADE.values()), order=order).T
    fields = np.zeros(200, dtype=[("x", "f4"), ("w", "i2")])
    fields["x"], fields["w"] = MADE["x"], np.arange(200)
    np.savez(tmp_path / "a.npz", run=table, raw=fields)
    log = read_log(tmp_path / "a.npz", spec, columns={"t": "run.1", "x": "raw.x", "v": "run.3", "w": "run_4 + 0*raw_w"})
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=1e-7) and np.allclose(log.inputs[:, 0], MADE["w"])
    assert np.array_equal(log.velocities[:, 0], MADE["v"])


def test_a_table_of_records_is_no_column(tmp_path, spec):
    """It ended in a traceback, since its records were counted by its first length."""
    np.savez(tmp_path / "a.npz", **MADE, run=np.zeros((2, 100), dtype=[("x", "f8"), ("w", "f8")]))
    assert np.array_equal(read_log(tmp_path / "a.npz", spec).positions[:, 0], MADE["x"])
    with refused("LOG005 a.npz: run: an array that is not of one dimension"):
        read_log(tmp_path / "a.npz", spec, columns={"x": "run"})
    with refused("LOG003 `run.x`"):
        read_log(tmp_path / "a.npz", spec, columns={"x": "run.x"})


def test_npy_tables_without_names(tmp_path, spec):
    np.save(tmp_path / "a.npy", np.column_stack(list(MADE.values())))
    with refused("LOG003 a.npy: `t` `columns: {t: NUMBER}` 4"):
        read_log(tmp_path / "a.npy", spec)
    log = read_log(tmp_path / "a.npy", spec, columns={"t": "1", "x": "2", "w": "4"})
    assert np.array_equal(log.inputs[:, 0], MADE["w"])


def archive(members: dict[str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", packing) as made:
        for name, data in members.items():
            made.writestr(name, data)
    return stream.getvalue()


def array(values: np.ndarray, said: str | None = None) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, values, allow_pickle=True)
    data = stream.getvalue()
    return data if said is None else data.replace(str(values.shape).encode(), said.encode())


GOOD = {name: array(values) for name, values in MADE.items()}
DAMAGED = archive({f"{n}.npy": d for n, d in GOOD.items()}, 0).replace(GOOD["x"][200:260], b"\xff" * 60)
HOSTILE = {
    "no archive": (b"PK\3\4 and no more", "File is not a zip file"),
    "cut off": (archive({"t.npy": GOOD["t"]})[:-30], "File is not a zip file"),
    "nothing in it": (archive({}), "no vector among its members: no array"),
    "objects": (archive({"t.npy": array(np.array([Path("a")]))}), r"t \(pickled objects, which are never read\)"),
    "text": (archive({"t.npy": array(np.array(["a"]))}), "no vector"),
    "no header": (archive({"t.npy": b"x"}), "no .npy file"),
    "shorter than it says": (
        archive({f"{n}.npy": array(v, "(300,)") for n, v in MADE.items()}),
        "EOF: reading array data",
    ),
    "longer than it says": (archive({f"{n}.npy": array(v, "(100,)") for n, v in MADE.items()}), "longer than it says"),
    "huge": (archive({f"{n}.npy": array(v, f"({'9' * 14},)") for n, v in MADE.items()}), "bytes when unpacked"),
    "other lengths": (archive({f"{n}.npy": array(v[:9] if n == "x" else v) for n, v in MADE.items()}), "9 values"),
    "packed otherwise": (archive({"t.npy": GOOD["t"]}, zipfile.ZIP_LZMA), "compression method 14"),
    "a damaged member": (DAMAGED, "Bad CRC-32"),
    "a damaged list": (archive({"t.npy": GOOD["t"]}).replace(b"PK\1\2", b"PK\7\7"), "a damaged file"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_archives(tmp_path, spec, case, monkeypatch):
    monkeypatch.setattr(pickle, "load", lambda *a, **k: pytest.fail("unpickled"))
    data, words = HOSTILE[case]
    (tmp_path / "a.npz").write_bytes(data)
    with pytest.raises(BadInput, match=words) as told:
        read_log(tmp_path / "a.npz", spec)
    assert len(str(told.value)) < 500


def test_an_archive_of_many_members(tmp_path, spec):
    (tmp_path / "a.npz").write_bytes(archive({f"{k}.npy": b"" for k in range(20_000)}))
    with pytest.raises(BadInput, match="an archive of 20000 files") as told:
        read_log(tmp_path / "a.npz", spec)
    assert len(str(told.value)) < 500


def test_an_archive_is_counted_before_it_is_unpacked(tmp_path, spec, monkeypatch):
    np.savez_compressed(tmp_path / "a.npz", **{n: np.zeros(1_000_000) for n in "txw"})
    assert (tmp_path / "a.npz").stat().st_size < 50_000
    monkeypatch.setattr(log_source, "LARGEST", 40_000_000)
    with refused("LOG010 a.npz: 40000000"):
        read_log(tmp_path / "a.npz", spec)


@settings(max_examples=examples(150), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 1 << 30), st.binary(min_size=1, max_size=8))
def test_any_damage_to_an_archive(tmp_path, spec, at, patch):
    data = bytearray(archive({f"{n}.npy": array(v[:20]) for n, v in MADE.items()}))
    at %= len(data)
    data[at : at + len(patch)] = patch
    (tmp_path / "f.npz").write_bytes(data)
    try:
        read_log(tmp_path / "f.npz", spec)
    except BadInput as error:
        assert "\n" not in str(error)


def test_all_formats_are_registered():
    assert {".json", ".npz", ".npy", ".csv", ".txt", ".mat"} <= set(FORMATS)
    assert struct.calcsize("<4s4H2LH") == 22  # the end record that the list's length is taken from
