"""Text tables as instruments and spreadsheets write them: the header is found, or named, or there is none."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.logs import read_log
from tests.expected_errors import refused

ROWS = [(0.01 * k, 0.5 * k, -3.0 + k) for k in range(6)]


def table(separator: str = ",", end: str = "\n", tail: str = "") -> str:
    return "".join(separator.join(f"{v:g}" for v in row) + tail + end for row in ROWS)


READ = {
    "preamble": "Date:;2020-07-08\nRate:;100;Hz;x\n\n;w raw\nt;x;w\n" + table(";"),
    "preamble with a comment": "rig 3\n# a note\nt,x,w\n# another\n" + table(),
    "preamble as wide as the table": "Exported by;Scope X;v2.1\nDrive;Axis 1;rig\nt;x;w\n" + table(";"),
    "preamble as wide as the table, and units": "Drive;Axis 1;rig\nt;x;w\ns;m;N\n" + table(";"),
    "units": "t;x;w\ns;m;N\n" + table(";"),
    "units in brackets": "t,x,w\n[s],[m],[N]\n" + table(),
    "preamble and units": 'Date:;now\r\nTrigger:;1;"a;b"\r\nt;x;w\r\ns;m;%\r\n' + table(";", "\r\n"),
    "trailing commas": "t,x,w,,\n" + table(tail=",,"),
    "trailing commas in rows only": "t,x,w\n" + table(tail=","),
    "trailing commas in the header only": "t,x,w,\n" + table(),
    "a spreadsheet around it": 'Trigger:;1,,\n"Names:;""a""",,\nt;x;w,,\ns;m;-,,\n' + table(";", tail=",,"),
    "comma and blank": "t, x, w\n" + table(", "),
    "blanks": "t x w\n" + table("   "),
    "blanks and a comment": "# t x w\n" + table(" "),
    "a comment with commas over blanks": "# t, x, w\n" + table(" "),
    "a comment with blanks over commas": "# rig 3\n# t x w\n" + table(),
    "a comment with blanks over tabs": "% t x w\n" + table("\t"),
    "tabs": "a preamble\nt\tx\tw\n" + table("\t"),
    "quotes": '"t","x","w"\n' + "".join(",".join(f'"{v:g}"' for v in row) + "\n" for row in ROWS),
    "index without a name": ",t,x,w\n" + "".join(f"{k},{line}\n" for k, line in enumerate(table().splitlines())),
}


@pytest.mark.parametrize("separator", [",", " ", ";"])
def test_a_comment_names_the_columns_with_units_in_brackets(tmp_path, spec, separator):
    """As ``numpy.savetxt`` writes a header; it was not found, or each unit was taken for a name."""
    path = tmp_path / "log.txt"
    path.write_text("# Stand 3, axis X\n# t [s]  x [mm]  w [N]\n" + table(separator))
    log = read_log(path, spec)
    assert np.array_equal(log.inputs[:, 0], [row[2] for row in ROWS])
    assert np.allclose(log.positions[:, 0], [1e-3 * row[1] for row in ROWS], rtol=1e-12)


def test_a_comment_names_the_one_column_of_a_file(tmp_path, spec):
    """A file of one column beside the log; with a unit the comment had two words for one column, and was refused."""
    (tmp_path / "log.csv").write_text("t,x\n" + "".join(f"{t:g},{x:g}\n" for t, x, _ in ROWS))
    (tmp_path / "force.txt").write_text("# w [mN]\n" + "".join(f"{w:g}\n" for *_, w in ROWS))
    (tmp_path / "meta.yaml").write_text("beside: {f: force.txt}\ncolumns: {w: 'f.w [mN]'}\n")
    log = read_log(tmp_path / "log.csv", spec)
    assert np.allclose(log.inputs[:, 0], [1e-3 * row[2] for row in ROWS], rtol=1e-12)


@pytest.mark.parametrize("ending", [".csv", ".txt"])
@pytest.mark.parametrize("case", READ)
def test_the_header_is_found(tmp_path, spec, case, ending):
    path = tmp_path / f"a{ending}"
    path.write_bytes(READ[case].encode())
    log = read_log(path, spec)
    assert np.allclose(log.positions[:, 0], [r[1] for r in ROWS]) and np.allclose(
        log.inputs[:, 0], [r[2] for r in ROWS]
    )
    assert log.sample_time == pytest.approx(0.01)


def test_it_is_said_where_the_header_was_found(tmp_path, spec):
    (tmp_path / "a.csv").write_text(READ["preamble and units"])
    log = read_log(tmp_path / "a.csv", spec)
    notes = log.notes
    assert notes[0] == "the header is line 3 (t, x, w), 2 lines before it"
    assert notes[1] == "a line of units under the header (s, m, %)"
    doubt = "w in `%`, which is no unit that can be converted to N: its numbers are used unchanged"
    assert len([f for f in log.raw_data.findings if doubt in f.words]) == 1 and not any(doubt in n for n in notes)
    (tmp_path / "b.csv").write_text(READ["a spreadsheet around it"].replace(",,\n", ",,was -8\n"))
    assert any("`was -8` of line 5 is not read" in n for n in read_log(tmp_path / "b.csv", spec).notes)


def test_units_of_each_other_ask_whether_columns_are_exchanged(tmp_path, spec):
    (tmp_path / "a.csv").write_text("t,x,w\ns,N,mm\n" + table())
    words = {f.topic: f.words for f in read_log(tmp_path / "a.csv", spec).raw_data.findings}
    assert "unit of w" in words["unit of x"] and "unit of x" in words["unit of w"]
    (tmp_path / "c.csv").write_text("t,pos_kN,force_mm\n" + table())
    (tmp_path / "meta.yaml").write_text("columns: {x: pos_kN, w: force_mm}\n")
    words = {f.topic: f.words for f in read_log(tmp_path / "c.csv", spec).raw_data.findings}
    assert "unit of w" in words["unit of x"] and "unit of x" in words["unit of w"]
    (tmp_path / "meta.yaml").unlink()
    (tmp_path / "b.csv").write_text("t,x,w\ns,m,V\n" + table())
    (other,) = read_log(tmp_path / "b.csv", spec).raw_data.findings
    assert "exchanged" not in other.words


@pytest.mark.parametrize(
    ("units", "severity"),
    [
        ("s,m,V", "problem"),  # no factor of its own makes it a force
        ("s,1/min,N", "problem"),
        ("s,m,%", "warning"),  # of a force that the file does not state
        ("s,counts,N", "warning"),
        ("s,bit,N", "warning"),
        ("s,deg,N", "problem"),
        ("s,mm,kN", None),
    ],
)
def test_a_unit_of_another_dimension_is_a_problem_until_a_factor_is_stated(units, severity, tmp_path, spec):
    (tmp_path / "b.csv").write_text(f"t,x,w\n{units}\n" + table())
    found = [f.severity for f in read_log(tmp_path / "b.csv", spec).raw_data.findings if f.topic.startswith("unit of")]
    assert found == ([severity] if severity else [])
    words = " ".join(f.words for f in read_log(tmp_path / "b.csv", spec).raw_data.findings)
    assert ("are used unchanged" in words) == (severity == "warning")
    (tmp_path / "meta.yaml").write_text("scale: {x: 2, w: 3}\n")
    log = read_log(tmp_path / "b.csv", spec)
    assert not [f for f in log.raw_data.findings if f.topic.startswith("unit of")]


@pytest.mark.parametrize("above", ["Unit,s,mm,kN\nt,x,w\n", "Unit,mm,kN\nt,x,w\n", "t,x,w\nUnit,mm,kN\n"])
def test_the_label_of_a_line_of_units_stands_beside_them_or_in_the_place_of_the_time(above, tmp_path, spec):
    """The first was passed over, so that mm were read as m; of the last the time was said to be in `Unit`."""
    (tmp_path / "a.csv").write_text(above + table())
    (tmp_path / "b.csv").write_text("t,x,w\n" + table())
    log, plain = (read_log(tmp_path / name, spec) for name in ("a.csv", "b.csv"))
    assert np.allclose(log.positions, 1e-3 * plain.positions) and np.allclose(log.inputs, 1e3 * plain.inputs)
    assert not [f for f in log.raw_data.findings if f.topic.startswith("unit of")]


@pytest.mark.parametrize(
    ("name", "severity"),
    [("w (V)", "problem"), ("w [1/min]", "problem"), ("w (min)", "warning"), ("w (cal)", "warning"), ("w (fb)", None)],
)
def test_a_word_in_the_name_of_a_column_that_is_also_a_rare_unit_is_no_problem(name, severity, tmp_path, spec):
    """A calibrated signal, a minimum: nothing would be diagnosed. As the unit of a line of units they are meant."""
    (tmp_path / "b.csv").write_text(f"t,x,{name}\n" + table())
    log = read_log(tmp_path / "b.csv", spec, columns={"w": name})
    found = [f.severity for f in log.raw_data.findings if f.topic == "unit of w"]
    assert found == ([severity] if severity else [])
    (tmp_path / "c.csv").write_text("t,x,w\ns,m,cal\n" + table())
    assert [f.severity for f in read_log(tmp_path / "c.csv", spec).raw_data.findings] == ["problem"]


def test_units_that_the_file_states_are_applied_where_nobody_says_otherwise(tmp_path, spec):
    (tmp_path / "a.csv").write_text("t,x,w\nms,mm,kN\n" + table())
    log = read_log(tmp_path / "a.csv", spec)
    assert log.sample_time == pytest.approx(1e-5)
    assert log.positions[2, 0] == pytest.approx(1e-3) and log.inputs[0, 0] == pytest.approx(-3000)
    assert "t is in ms, as the file says: converted to s" in log.notes
    (tmp_path / "meta.yaml").write_text("scale: {t: 1, x: 2}\nunits: {w: mN}\n")
    log = read_log(tmp_path / "a.csv", spec)
    assert log.sample_time == pytest.approx(0.01)
    assert log.positions[2, 0] == pytest.approx(2) and log.inputs[0, 0] == pytest.approx(-3e-3)


def test_columns_by_number(tmp_path, spec):
    (tmp_path / "a.csv").write_text("# no names\n" + table())
    about = tmp_path / "about.yaml"
    for text in (
        "columns: {t: 1, x: 2, w: 3}\n",
        "columns: [t, x, w]\n",
        "header: none\ncolumns: {t: 1, x: 2, w: 3}\n",
    ):
        about.write_text(text)
        log = read_log(tmp_path / "a.csv", spec, description=about)
        assert np.allclose(log.positions[:, 0], [r[1] for r in ROWS])
        assert any("no header line" in n for n in log.notes)
    (tmp_path / "board.txt").write_text("Starting...\nREADY\n" + table())
    about.write_text("columns: {t: 1, x: 2, w: 3}\n")
    log = read_log(tmp_path / "board.txt", spec, description=about)  # "Starting..." was taken for the header
    assert np.allclose(log.positions[:, 0], [r[1] for r in ROWS])
    about.write_text("columns: [t, x]\n")
    with refused("LOG013 a.csv:2: 3 2 t, x"):
        read_log(tmp_path / "a.csv", spec, description=about)
    (tmp_path / "b.csv").write_text("t,x,x\n" + table())
    with refused("LOG004 2 `x` 2, 3"):
        read_log(tmp_path / "b.csv", spec, columns={"w": "3"})
    assert read_log(tmp_path / "b.csv", spec, columns={"x": "2", "w": "3"}).inputs[0, 0] == -3


@pytest.mark.parametrize("filled", [0, 4], ids=["the first row", "a later row"])
def test_columns_without_a_header_that_are_filled_in_few_rows(tmp_path, spec, filled):
    """A logger's settings stand in one row only, behind its numbers: the columns are counted in all rows."""
    lines = [line + (",12.1,12.2" if k == filled else ",,") for k, line in enumerate(table().splitlines())]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    about = tmp_path / "about.yaml"
    for text in ("columns: {t: 1, x: 2, w: 3}\n", "columns: [t, x, w, a, b]\n"):
        about.write_text(text)
        log = read_log(tmp_path / "a.csv", spec, description=about)
        assert np.allclose(log.positions[:, 0], [r[1] for r in ROWS])
        assert np.allclose(log.inputs[:, 0], [r[2] for r in ROWS])
    about.write_text("columns: [t, x]\n")
    with refused("LOG013 a.csv:1: 5 2 t, x"):
        read_log(tmp_path / "a.csv", spec, description=about)


def test_a_header_that_is_not_taken_is_named(tmp_path, spec):
    (tmp_path / "a.csv").write_text("t,x,w\nSek,Pos,Kraft\n" + table())
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    words = "`t`: line 2 is the header, by which it is column 1; `header: 1` in meta.yaml beside the log"
    assert words in str(told.value)
    about = tmp_path / "about.yaml"
    about.write_text("header: 1\n")
    assert read_log(tmp_path / "a.csv", spec, description=about).inputs[0, 0] == -3


def test_the_header_by_its_line(tmp_path, spec):
    (tmp_path / "a.csv").write_text("x,w,t\nt,x,w\n" + table())
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert "a.csv:2: two lines that may be the header, this one and line 1 (`x,w,t`)" in str(told.value)
    assert "expected `header: 2` or `header: 1` in meta.yaml beside the log" in str(told.value)
    about = tmp_path / "about.yaml"
    about.write_text("header: 2\n")
    assert read_log(tmp_path / "a.csv", spec, description=about).inputs[0, 0] == -3
    for line, words in ((99, "8 lines; expected the header on line 99"), (0, "counted from 1"), ("x", "a number")):
        about.write_text(f"header: {line}\n")
        with pytest.raises(BadInput, match=words):
            read_log(tmp_path / "a.csv", spec, description=about)


HEADS = {
    "increments": "Messung;Achse X;Stand 3\nDatum;12.03.2024;\nZeit;Weg;Strom\nms;mm;Inkr\n",
    "no unit but that of time": "Zeit;Weg;Strom\nms;Inkr;Ticks\n",
    "a preamble with as many fields": "Messung;Achse X;Stand 3\nZeit;Weg;Strom\n",
}


@pytest.mark.parametrize("head", HEADS)
def test_of_two_lines_the_header_is_the_one_with_the_names_that_a_description_asks_for(tmp_path, spec, head):
    (tmp_path / "a.csv").write_text(HEADS[head] + table(";"))
    about = tmp_path / "about.yaml"
    about.write_text("columns: {t: Zeit, x: Weg, w: Strom}\nscale: {w: 0.5}\n")
    log = read_log(tmp_path / "a.csv", spec, description=about)
    assert log.inputs[0, 0] == -1.5
    assert log.sample_time == pytest.approx(1e-5 if "ms" in HEADS[head] else 0.01)


def test_a_line_of_units_may_have_a_word_that_is_none(tmp_path, spec):
    (tmp_path / "a.csv").write_text(HEADS["increments"] + table(";"))
    asked = {"x": "Weg", "w": "Strom"}
    assert read_log(tmp_path / "a.csv", spec, columns=asked).positions[2, 0] == pytest.approx(1e-3)
    (tmp_path / "b.csv").write_text(HEADS["no unit but that of time"] + table(";"))
    log = read_log(tmp_path / "b.csv", spec, columns=asked)  # by names, as a description's
    assert [f.topic for f in log.raw_data.findings] == ["unit of x", "unit of w"]
    with refused("LOG003 Weg 2 1 `header: 1`"):
        read_log(tmp_path / "b.csv", spec, columns={"x": "Weg", "w": "Ticks"})


def test_a_row_of_another_length_is_told_as_before(tmp_path, spec):
    (tmp_path / "a.csv").write_text("preamble\nt,x,w\n" + table() + "1,2\n")
    with refused("LOG005 a.csv:9: 2 3"):
        read_log(tmp_path / "a.csv", spec)


DEVICES = "Devices\n100\n,,Rig,,\nFrame,Sub Frame,t,x,w\n,,s,mm,N\n" + "".join(
    f"{k // 2 + 1},{k % 2},{t:g},{1e3 * x:g},{w:g}\n" for k, (t, x, w) in enumerate(ROWS)
)
TRAJECTORIES = "Trajectories\n50\n,,Rig:hand,,,Rig:foot\nFrame,Sub Frame,X,Y,Z,X\n,,mm,mm,mm,mm\n" + "".join(
    f"{k + 1},0,{1e3 * x:g},1,2,3\n" for k, (_, x, _) in enumerate(ROWS)
)


def test_names_may_repeat_above_a_line_of_units(tmp_path, spec):
    """As in the trajectories of a motion capture."""
    (tmp_path / "a.csv").write_text(TRAJECTORIES)
    (tmp_path / "meta.yaml").write_text("columns: {x: 3, w: 4}\nsample_time: 0.01\n")
    log = read_log(tmp_path / "a.csv", spec)
    assert np.allclose(log.positions[:, 0], [row[1] for row in ROWS])


def test_of_two_tables_as_vicon_writes_them_the_second_is_read_by_its_line(tmp_path, spec):
    """Without a line both are refused: what stands between them is no row."""
    path = tmp_path / "a.csv"
    path.write_text(f"{TRAJECTORIES}\n{DEVICES}")
    (tmp_path / "meta.yaml").write_text("header: 16\n")
    log = read_log(path, spec)
    assert log.size == len(ROWS) and np.allclose(log.positions[:, 0], [row[1] for row in ROWS])
    (tmp_path / "meta.yaml").unlink()
    path.write_text(f"{DEVICES}\n{TRAJECTORIES}")
    with refused("LOG005 a.csv:14"):
        read_log(path, spec)


def test_a_header_line_beyond_the_file_is_refused_with_comma_times_too(tmp_path, spec):
    """It was an IndexError, since the milliseconds behind a comma were compared with that line first."""
    path = tmp_path / "a.csv"
    path.write_text("".join(f"2026-03-04 23:59:58,{k:03d},0.{k},{k}\n" for k in range(6)))
    (tmp_path / "meta.yaml").write_text("header: 50\n")
    with refused("LOG013 a.csv:6: 6 lines the header on line 50"):
        read_log(path, spec)


def test_times_of_their_own_are_in_the_unit_under_them(tmp_path, spec):
    """Of the first of several columns `time` the unit was lost, and milliseconds were read as seconds."""
    path = tmp_path / "a.csv"
    rows = "".join(f"{k},{k * k / 100:g},{k},{k / 2:g}\n" for k in range(100))
    path.write_text("time,x,time,w\nms,mm,ms,N\n" + rows)
    log = read_log(path, spec)
    assert np.isclose(log.sample_time, 1e-3) and np.isclose(log.positions[-1, 0], 99 * 99 / 1e5)
