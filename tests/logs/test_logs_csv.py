"""CSV logs: what can be read, how fast, and what is said of what cannot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from slider_log import rows, write_csv

from codegen.base.errors import BadInput
from codegen.logs import read_log
from tests.expected_errors import matches, refused
from tests.slow_cases import examples


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_values_come_back(tmp_path, spec, delimiter):
    made = rows()
    log = read_log(write_csv(tmp_path / "a.csv", made, delimiter, "%.17g"), spec)
    assert np.array_equal(log.positions[:, 0], made["x"])
    assert np.array_equal(log.velocities[:, 0], made["v"])
    assert np.array_equal(log.inputs[:, 0], made["w"])
    assert log.sample_time == 0.002 and log.name == "a" and not log.notes and not log.gaps
    assert np.allclose(log.time, made["t"], atol=1e-12)


def test_without_velocities(tmp_path, spec):
    made = rows()
    del made["v"]
    assert read_log(write_csv(tmp_path / "a.csv", made), spec).velocities is None


def test_comments_quotes_blank_lines_bom_and_crlf(tmp_path, spec):
    (tmp_path / "a.csv").write_bytes(
        b'\xef\xbb\xbf# rig 2\r\n"t", "x","w"\r\n0,0,1 # start\r\n\r\n# pause\r\n0.1,"1",2\r\n0.2,2,3\r\n'
    )
    log = read_log(tmp_path / "a.csv", spec)
    assert log.positions[:, 0].tolist() == [0, 1, 2] and log.inputs[:, 0].tolist() == [1, 2, 3]


def test_header_as_numpy_writes_it(tmp_path, spec):
    np.savetxt(
        tmp_path / "a.csv", np.column_stack([np.arange(5), np.ones(5), np.ones(5)]), delimiter=",", header="t,x,w"
    )
    assert read_log(tmp_path / "a.csv", spec).size == 5


def test_text_in_columns_that_are_not_used(tmp_path, spec):
    (tmp_path / "a.csv").write_text("t,mode,x,w\n0,idle,1,2\n1,run,3,4\n")
    assert read_log(tmp_path / "a.csv", spec).positions[:, 0].tolist() == [1, 3]


REFUSED = {
    "empty": ("", "LOG009 a.csv"),
    "blank": (" \n\n", "LOG009"),
    "comments only": ("# a\n# b\n", "LOG001"),
    "header only": ("t,x,w\n", "LOG009 a.csv:1"),
    "one row": ("t,x,w\n0,1,2\n", "LOG009 a.csv:2"),
    "no header": ("0,1,2\n1,2,3\n", "LOG003 a.csv:1 `t` `columns NUMBER}`"),
    "missing column": ("t,pos,w\n0,1,2\n1,2,3\n", "LOG003 a.csv:1 `x`"),
    "case": ("T,x,w\n0,1,2\n1,2,3\n", "LOG003 `T` T}`"),
    "spaces": ("t x w\n0 1 2\n", "LOG001"),
    "text": ("t,x,w\n0,1,2\n1,abc,3\n", "LOG005 a.csv:3 `abc`"),
    "decimal comma": (
        "t;x;w\n0.1;1;2\n0,5;1;2\n",
        "LOG005 a.csv:3 `0,5` '0.5'?) `decimal: comma`",
    ),
    "underscore": ("t,x,w\n0,1,2\n1,1_0,3\n", "LOG005 a.csv:3 `1_0`"),
    "ragged": ("t,x,w\n0,1,2\n# note\n1,2\n", "LOG005 a.csv:4 2 3"),
    "long row": ("t,x,w\n0,1,2,9\n1,2,3\n", "LOG005 a.csv:2 4"),
    "twice": ("t,x,x,w\n0,1,2,3\n1,2,3,4\n", "LOG004 2 `x`"),
    "backwards": ("t,x,w\n0,1,2\n1,2,3\n0.5,2,3\n", "LOG007 a.csv:4 1.0 0.5"),
    "all at once": ("t,x,w\n0,1,2\n0,1,2\n0,1,2\n", "LOG009"),
    "repeats": ("t,x,w\n0,1,2\n0,5,2\n1,1,2\n1,4,2\n", "LOG007 a.csv:3 2 4"),
    "nan": ("t,x,w\n0,1,2\n1,nan,2\n2,1,2\n", "LOG006 a.csv:3 1 3"),
    "inf": ("t,x,w\n0,1,2\n1,1e999,2\n2,1,2\n", "LOG006 a.csv:3 1 3"),
    "jump": ("t,x,w\n0,1,2\n1,1,2\n2,1,2\n1e9,1,2\n", "LOG008 a.csv:5 1e+09"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(tmp_path, spec, case):
    text, words = REFUSED[case]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "a.csv", spec)
    assert matches(caught.value, words)
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path, spec):
    for name, words in (("none.csv", "no such file"), ("none.xyz", "no such file"), (".", "a folder")):
        with pytest.raises(BadInput, match=words):
            read_log(tmp_path / name, spec)
    (tmp_path / "d.csv").mkdir()
    with refused("FILE001 d.csv"):
        read_log(tmp_path / "d.csv", spec)
    (tmp_path / "a.cvs").write_bytes(b"t\0")
    with refused("LOG002 `.cvs` '.csv'?"):
        read_log(tmp_path / "a.cvs", spec)
    (tmp_path / "b.csv").write_bytes(b"t,x,w\n0,1,\x81\n")
    with refused("LOG001 b.csv:2: 10 UTF-8"):
        read_log(tmp_path / "b.csv", spec)
    (tmp_path / "b.csv").write_bytes(b"t,x,w\n0,1,\xff\n1,1,1\n")
    with refused("LOG005 b.csv:2: w: `ÿ`"):
        read_log(tmp_path / "b.csv", spec)
    (tmp_path / "c.csv").write_bytes("t,x,w\n0,1,2\n".encode("utf-16-le"))
    with refused("LOG001 c.csv:1: UTF-16"):
        read_log(tmp_path / "c.csv", spec)
    with pytest.raises(BadInput):
        read_log("a\0b.csv", spec)


def test_long_runs_of_missing_values(tmp_path, spec):
    made = rows()
    made["x"][100:106] = np.nan
    with refused("LOG006 a.csv:102: x: 6 5000 5"):
        read_log(write_csv(tmp_path / "a.csv", made), spec)


def test_isolated_missing_values(tmp_path, spec):
    made = rows()
    kept = made["x"].copy()
    made["x"][[7, 300]] = np.nan
    made["w"][40] = np.inf
    made["t"][50] = np.nan
    path = write_csv(tmp_path / "a.csv", made)
    with refused("LOG006 a.csv:52: t: 1 5000 `missing: fill`"):
        read_log(path, spec)
    (tmp_path / "meta.yaml").write_text("missing: fill\n")
    log = read_log(path, spec)
    assert abs(log.positions[7, 0] - kept[7]) < 1e-5
    assert log.inputs[40, 0] == pytest.approx(made["w"][39], abs=1e-8)
    assert log.raw_data.repaired == {"x": 2, "w": 1} and log.raw_data.dropped == 1
    assert log.size == 5000 and len(log.notes) == 4
    assert "a.csv:9: x" in log.notes[1] and "a.csv:52" in log.notes[0]


def test_repeated_rows(tmp_path, spec):
    made = rows(1)
    order = np.sort(np.concatenate([np.arange(500), [10, 20]]))
    made = {k: v[order].copy() for k, v in made.items()}
    made["x"][21 + 1] += 1.0  # the repetition of row 20 with other data
    log = read_log(write_csv(tmp_path / "a.csv", made), spec)
    assert log.size == 500 and log.raw_data.dropped == 2
    assert any("that repeat another" in n for n in log.notes) and any(
        "other data at the same time" in n for n in log.notes
    )
    assert np.abs(log.positions).max() < 0.2


@settings(max_examples=examples(300), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.binary(max_size=300), st.text(max_size=300).map(lambda s: s.encode("utf-8", "surrogatepass"))))
def test_any_bytes(tmp_path, spec, data):
    for head in (b"", b"t,x,w\n", b"t,x,w\n0,1,2\n1,2,3\n"):
        (tmp_path / "f.csv").write_bytes(head + data)
        try:
            log = read_log(tmp_path / "f.csv", spec)
        except BadInput as error:
            assert "\n" not in str(error)
        else:
            assert np.isfinite(log.positions).all() and np.isfinite(log.inputs).all()


FIELDS = st.sampled_from(
    ["0", "1", "-2.5", "1e30", "1e-300", "nan", "inf", "", "x", '"', "#", "1,2", "\x0b", "\u2028", "٣"]
)


@settings(max_examples=examples(300), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(FIELDS, FIELDS, FIELDS), max_size=12), st.sampled_from([",", ";", "\t"]))
def test_any_table(tmp_path, spec, table, delimiter):
    text = "\n".join(delimiter.join(r) for r in [("t", "x", "w"), *table])
    (tmp_path / "f.csv").write_text(text, encoding="utf-8")
    try:
        log = read_log(tmp_path / "f.csv", spec)
    except BadInput as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(log.positions).all() and (np.diff(log.time) > 0).all()


def test_a_word_in_a_row_is_told_how_a_damaged_row_is_left_out(tmp_path, spec):
    """`ERR` of a sensor: docs/logs.md has the remedy, and the message had none."""
    lines = write_csv(tmp_path / "a.csv", rows()).read_text().splitlines()
    cells = lines[30].split(",")
    lines[30] = ",".join([cells[0], "ERR", *cells[2:]])
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with refused("LOG005 a.csv:31: `ERR` `missing: fill`"):
        read_log(tmp_path / "a.csv", spec)
    (tmp_path / "meta.yaml").write_text("missing: fill\n")
    assert any("line 31 is a damaged row" in note for note in read_log(tmp_path / "a.csv", spec).notes)
