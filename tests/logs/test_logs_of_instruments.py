"""Files as drives, oscilloscopes and spreadsheets write them: read to the same numbers, or refused by a message that
names what to add. The numbers are those of a slider's log in closed form."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from slider_log import TEXT, rows

from codegen.base.errors import BadInput
from codegen.logs import preflight, read_log
from codegen.spec.reader import parse_spec
from tests.app.command import stiction
from tests.diagnosis.stage import among
from tests.expected_errors import matches

MADE = rows()
STEP = 0.002
STARTED = datetime(2026, 3, 4, 23, 59, 58)


def lines(separator: str = ",", digits: str = "%.9f", comma: bool = False, scale=(1, 1, 1), stamp=None, tail="") -> str:
    """t, x and w of every row; ``stamp`` writes the time in its own way."""
    numbers = np.column_stack([MADE[name] * s for name, s in zip("txw", scale, strict=True)]).tolist()
    form = separator.join([digits] * 3)
    texts = [form % tuple(row) for row in numbers]
    if comma:
        texts = [text.replace(".", ",") for text in texts]
    if stamp is not None:
        texts = [stamp(k) + separator + text.split(separator, 1)[1] for k, text in enumerate(texts)]
    return "".join(f"{text}{tail}\n" for text in texts)


def iso(k: int, between: str = "T", mark: str = ".", zone: str = "") -> str:
    at = STARTED + timedelta(seconds=k * STEP)
    return at.strftime(f"%Y-%m-%d{between}%H:%M:%S{mark}%f") + zone


EUROPE = lines(";", comma=True)
TWINCAT = (
    "Name;Scope project\nFile;C:\\scope\\axis.svdx\nStarttime of export;133000000000;Montag\n\n"
    "Name;Axis 1.ActPos;Name;Axis 1.ActForce\nNetId;5.1.1.1.1.1;NetId;5.1.1.1.1.1\nData-Type;REAL64;Data-Type;REAL64\n"
    "SampleTime[ms];2;SampleTime[ms];2\nSymbolBased;True;SymbolBased;True\nUnit;mm;Unit;N\n\n"
)
TWINCAT_ROWS = "".join(
    f"{1e3 * t:.6f};{1e3 * x:.9f};{1e3 * t:.6f};{w:.9f}\n".replace(".", ",")
    for t, x, w in zip(MADE["t"], MADE["x"], MADE["w"], strict=True)
)
INDEXED = "".join(f"{k};{line}\n" for k, line in enumerate(EUROPE.splitlines()))
RESTARTED = "\n".join((*lines().splitlines()[:2500], "t,x,w", *lines().splitlines()[2500:])) + "\n"

READ = {
    # name: content (bytes or text), meta.yaml, words among the notes
    "labview": ("t\tx\tw\n" + lines("\t", comma=True), "", "decimal commas"),
    "european excel": ("t;x;w\n" + EUROPE, "", "decimal commas"),
    "integers among decimal commas": ("t;x;w\n" + EUROPE.replace("0,000000000", "0"), "", "decimal commas"),
    "integers for long at the start": (
        "t;x;w\n" + "".join(f"{k};0;0\n" for k in range(-30, 0)) + EUROPE,
        "",
        "decimal commas",
    ),
    "commas and exponents": (
        "t;x;w\n" + lines(";", "%.8e", comma=True),
        "",
        "decimal commas",
    ),
    "excel with units": ("Zeit;x;w\nms;mm;kN\n" + lines(";", "%.9f", True, (1e3, 1e3, 1e-3)), "", "column `Zeit` is t"),
    "units in brackets": ("Time [ms],x [mm],w (kN)\n" + lines(scale=(1e3, 1e3, 1e-3)), "", "column `Time [ms]` is t"),
    "time": ("time,x,w\n" + lines(), "", "column `time` is t"),
    "Time": ("Time,x,w\n" + lines(), "", "column `Time` is t"),
    "time [s]": ("time [s],x,w\n" + lines(), "", "column `time [s]` is t"),
    "timestamp": ("timestamp,x,w\n" + lines(), "", "column `timestamp` is t"),
    "t_s": ("t_s,x,w\n" + lines(), "", "column `t_s` is t"),
    "t_ms": ("t_ms,x,w\n" + lines(scale=(1e3, 1, 1)), "", "t is in ms"),
    "time_us": ("time_us,x,w\n" + lines(scale=(1e6, 1, 1)), "", "t is in us"),
    "windows-1252": (
        (
            "Prüfstand 3 – „Hubachse“, 5 €\nZeit [s];x [mm];w;Temperatur [°C]\n"
            + lines(";", "%.9f", True, (1, 1e3, 1), tail=";20,5")
        ).encode("cp1252"),
        "",
        "Windows-1252",
    ),
    "utf-16 of excel": (("t\tx\tw\n" + lines("\t", comma=True)).encode("utf-16"), "", "UTF-16"),
    "utf-16, the other order": (b"\xfe\xff" + ("t,x,w\n" + lines()).encode("utf-16-be"), "", "UTF-16"),
    "quoted decimal commas": (
        "t;x;w\n" + "".join(";".join(f'"{v}"' for v in line.split(";")) + "\n" for line in EUROPE.splitlines()),
        "",
        "decimal commas",
    ),
    "quoted decimal commas between commas": (
        "t,x,w\n" + "".join(",".join(f'"{v}"' for v in line.split(";")) + "\n" for line in EUROPE.splitlines()),
        "decimal: comma\n",
        "decimal commas",
    ),
    "quoted decimal commas between commas, found": (
        "t,x,w\n" + "".join(",".join(f'"{v}"' for v in line.split(";")) + "\n" for line in EUROPE.splitlines()),
        "",
        "decimal commas",
    ),
    "decimal commas between commas, quoted where they are": (
        "t,x,w\n" + re.sub(r"([^;\n]*,[^;\n]*)", r'"\1"', EUROPE.replace("0,000000000", "0")).replace(";", ","),
        "",
        "decimal commas",
    ),
    "trailing separators": ("t;x;w;\n" + lines(";", comma=True, tail=";"), "", "decimal commas"),
    "percent comments": ("% rig 3\n% t,x,w\n" + lines().replace("\n", "\n% pause\n", 3), "", ""),
    "slash comments": ("// rig 3\nt,x,w\n" + lines(), "", ""),
    "an index column": ("Index;t;x;w\n" + INDEXED, "", "decimal commas"),
    "a header again in the middle": ("t,x,w\n" + RESTARTED, "", "line 2502"),
    "iso 8601": ("time,x,w\n" + lines(stamp=iso), "", "date and time of day"),
    "iso 8601 with a zone": (
        "time;x;w\n" + lines(";", comma=True, stamp=lambda k: iso(k, " ", ".", "+01:00")),
        "",
        "date and time of day",
    ),
    "iso 8601 below a preamble": ("Rig;3\n\nt;x;w\n" + lines(";", stamp=lambda k: iso(k, " ", ",")), "", "line 3"),
    "milliseconds since 1970": (
        "timestamp,x,w\n" + lines(stamp=lambda k: str(1772668798000 + 2 * k)),
        "",
        "milliseconds since 1970",
    ),
    "nanoseconds since 1970": (
        "timestamp,x,w\n" + lines(stamp=lambda k: str((1772668798000 + 2 * k) * 10**6)),
        "",
        "nanoseconds since 1970",
    ),
    "twincat": (
        TWINCAT + TWINCAT_ROWS,
        "header: 5\ncolumns: {t: 1, x: Axis 1.ActPos, w: Axis 1.ActForce}\nunits: {t: ms, x: mm}\n",
        "header is line 5",
    ),
    "twincat, without a word": (
        TWINCAT + TWINCAT_ROWS + "EOF\n",
        "columns: {x: Axis 1.ActPos, w: Axis 1.ActForce}\n",
        "a scope's export, its times in ms | the header is line 5",
    ),
    "twincat, one time and full stamps": (
        TWINCAT.replace(";Name;", ";")
        .replace(";NetId;", ";")
        .replace(";Data-Type;", ";")
        .replace("ms];2;Sam", "ms];2;")
        .replace("2;pleTime[ms];2", "2;2")
        .replace(";SymbolBased;", ";")
        .replace(";Unit;", ";")
        .replace("mm", "(None)")
        + lines(";", comma=True, stamp=lambda k: str(133000000000000000 + 20000 * k)),
        "columns: {t: Time, x: Axis 1.ActPos, w: Axis 1.ActForce}\n",
        "FILETIME",
    ),
    "twincat, names alone": (
        TWINCAT.split("NetId")[0] + "\n" + TWINCAT_ROWS,
        "columns: {x: Axis 1.ActPos, w: Axis 1.ActForce}\nunits: {x: mm}\n",
        "a scope's export, its times in ms",
    ),
    "american dates": (
        "t,x,w\n" + lines(stamp=lambda k: f"{STARTED + timedelta(seconds=k * STEP):%m/%d/%Y %I:%M:%S.%f %p}"),
        "",
        "column `t` is time of day",
    ),
    "dates of Excel": (
        "t;x;w\n"
        + lines(";", comma=True, stamp=lambda k: f"{STARTED + timedelta(seconds=k * STEP):%d.%m.%Y %H:%M:%S,%f}"),
        "",
        "column `t` is time of day",
    ),
    "minutes and seconds past the hour": (
        "t;x;w\n" + lines(";", stamp=lambda k: iso(k)[14:]),
        "",
        "column `t` is time of day",
    ),
    "a colon before the milliseconds": (
        "t;x;w\n" + lines(";", stamp=lambda k: iso(k, mark=":")[11:]),
        "",
        "column `t` is time of day",
    ),
    "units below a line": ("t / s;x / mm;w / N\n" + lines(";", comma=True, scale=(1, 1e3, 1)), "", "x is in mm"),
    "units below a line without blanks": (
        "t/ms;x/mm;w/N\n" + lines(";", comma=True, scale=(1e3, 1e3, 1)),
        "",
        "t is in ms",
    ),
    "a remark at the end, with units": (
        "Rig 3;run 17\nDate;04.03.2026\n\nZeit;x;w;Remark\n[ms];[mm];[N];\n"
        + lines(";", comma=True, scale=(1e3, 1e3, 1), tail=";"),
        "",
        "the header is line 4",
    ),
    "a remark in the first row": (
        "Rig 3;run 17\nDate;04.03.2026\n\nZeit;x;w;Remark\n[ms];[mm];[N];\n"
        + lines(";", comma=True, scale=(1e3, 1e3, 1), tail=";").replace(";\n", ";start\n", 1),
        "",
        "the header is line 4",
    ),
    "units of a comment under the header": (
        "t,x,w\n# units: ms, mm, N\n" + lines(scale=(1e3, 1e3, 1)),
        "",
        "t is in ms",
    ),
    "units of a comment": ("# units: ms, mm, N\nt,x,w\n" + lines(scale=(1e3, 1e3, 1)), "", "t is in ms"),
    "bars": ("t|x|w\n" + lines("|"), "", ""),
    "a typographer's minus": ("t,x,w\n" + lines().replace("-", "−"), "", ""),
    "a time of day past midnight": (
        "Time;x;w\n" + lines(";", stamp=lambda k: iso(k)[11:]),
        "",
        "`Time` is time of day",
    ),
    "siemens": (
        '"Trace";"1"\n"Time [ms]";"Axis.ActualPosition [mm]";"Axis.Force [N]"\n'
        + lines(";", "%.9f", True, (1e3, 1e3, 1)),
        "columns: {x: 'Axis.ActualPosition [mm]', w: 'Axis.Force [N]'}\n",
        "x is in mm",
    ),
}


@pytest.mark.parametrize("case", READ)
def test_read_to_the_same_numbers(tmp_path, spec, case):
    content, meta, words = READ[case]
    (tmp_path / "a.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    if meta:
        (tmp_path / "meta.yaml").write_text(meta)
    log = read_log(tmp_path / "a.csv", spec)
    last = len(MADE["t"])
    assert log.sample_time == pytest.approx(STEP, rel=1e-6) or "long at the start" in case
    assert np.allclose(log.positions[-last:, 0], MADE["x"], atol=2e-9)
    assert np.allclose(log.inputs[-last:, 0], MADE["w"], atol=1e-6)
    assert words in " | ".join(log.notes), log.notes


REFUSED = {
    "thousands and decimals": ("t;x;w\n0,1;1.234,5;1\n0,2;1.234,6;1\n", "", "LOG005 a.csv:2 `1.234,5` thousands"),
    "thousands in quotes": ('t,x,w\n0.1,"1,234.5",1\n0.2,"1,235.5",1\n', "", "LOG005 a.csv:2 `1,234.5` thousands"),
    "thousands or decimals": (
        "t;x;w\n1;1,234;5\n2;1,235;5\n3;1,240;5\n",
        "",
        "LOG005 a.csv:2 `1,234` `decimal: comma`",
    ),
    "thousands or decimals in quotes": ('t,x,w\n1,"1,234",5\n2,"1,235",5\n', "", "LOG005 a.csv:2 `1,234` comma`"),
    "points among commas": ("t;x;w\n0,1;0,5;1\n0,2;1.234;1\n", "", "LOG005 a.csv:3 `1.234` thousands"),
    "commas among points": ("t;x;w\n0.1;0.5;1\n0.2;1,23;1\n", "", "LOG005 a.csv:3 `1,23`"),
    "grouped by blanks": ("t;x;w\n0,1;1 234,5;1\n0,2;1 234,6;1\n", "", "LOG005 a.csv:2 thousands"),
    "grouped by apostrophes": ("t,x,w\n0.1,1'234.5,1\n0.2,1'234.6,1\n", "", "LOG005 a.csv:2 thousands"),
    "points said": ("t;x;w\n0,1;0,5;1\n0,2;0,7;1\n", "decimal: point\n", "LOG005 a.csv:2 `0,1` comma"),
    "whole numbers with points between thousands": (
        "t;x;w\n" + "".join(f"{k};{100 * k:,};1\n".replace(",", ".") for k in range(30)),
        "",
        "LOG005 a.csv:12 x `1.000` `0` thousands `decimal: point`",
    ),
    "round thousands beside whole numbers": (
        "t,x,w\n" + "".join(f"{k},{v},1\n" for k, v in enumerate(("0", "50", "300.000", "999", "120.000"))),
        "",
        "LOG005 a.csv:4 x `300.000` `0` thousands `decimal: point`",
    ),
    "two columns of time": ("Time,timestamp,x,w\n0,0,1,2\n1,1,3,4\n", "", "LOG003 `Time` `timestamp` columns:"),
    "two times of one name": (TWINCAT + TWINCAT_ROWS, "header: 5\n", "LOG003 a.csv:5"),
    "nan words in front": ("t,x,w\n0,1,2\n#N/A,1,2\n2,1,2\n", "", "LOG006 a.csv:3 fill"),
    "dates without a time of day": ("t,x,w\n03/04/2026,1,2\n03/04/2026,1,2\n", "", "LOG005 a.csv:2 ISO sample_time"),
    "exponents of Fortran": ("t,x,w\n0.0D0,1,2\n1.0D0,1,2\n", "", "LOG005 a.csv:2 '0.0E0'"),
    "nan words": ("t,x,w\n0,1,2\n1,#N/A,2\n2,1,2\n", "", "LOG006 a.csv:3 fill"),
    "nan words of a compiler": ("t,x,w\n0,1,2\n1,-1.#IND,2\n2,1,2\n", "", "LOG006 a.csv:3 fill"),
    "points among quoted commas": ('t,x,w\n0,"0,5",1.5\n1,"0,6",1.5\n', "", "LOG005 a.csv:2 `0,5` decimal: comma"),
    "decimal commas between commas": ("t,x,w\n0,1,0,5,1,0\n0,2,0,5,1,0\n", "", "LOG005 a.csv:2 6 decimal"),
    "utf-16 without its mark": ("t,x,w\n0,1,2\n".encode("utf-16-le"), "", "LOG001 UTF-16"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_by_a_message_that_helps(tmp_path, spec, case):
    content, meta, words = REFUSED[case]
    (tmp_path / "a.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    if meta:
        (tmp_path / "meta.yaml").write_text(meta)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, words), told.value


def test_decimal_commas_may_be_said(tmp_path, spec):
    (tmp_path / "a.csv").write_text("t;x;w\n1;1,234;5\n2;1,235;5\n3;1,240;5\n")
    (tmp_path / "meta.yaml").write_text("decimal: comma\n")
    assert read_log(tmp_path / "a.csv", spec).positions[:, 0].tolist() == [1.234, 1.235, 1.24]


def test_the_scale_that_is_said_stands_above_the_unit_of_a_name(tmp_path, spec):
    (tmp_path / "a.csv").write_text("time_ms,x [mm],w\n" + lines(scale=(1, 1e3, 1)))
    (tmp_path / "meta.yaml").write_text("scale: {t: 1}\n")
    log = read_log(tmp_path / "a.csv", spec)
    assert log.sample_time == STEP and np.allclose(log.positions[:, 0], MADE["x"], atol=1e-9)


@pytest.mark.parametrize("unit", ["counts", "bit", "%"])
def test_a_unit_without_a_size_is_a_warning(tmp_path, spec, unit):
    (tmp_path / "a.csv").write_text(f"t,x,w [{unit}]\n" + lines())
    found = preflight(read_log(tmp_path / "a.csv", spec, columns={"w": f"w [{unit}]"}), spec)
    words = [f.words for f in found if f.severity == "warning" and f.topic == "unit of w"]
    assert len(words) == 1 and f"`{unit}`" in words[0] and "scale: {w: " in words[0]


def test_counts_are_no_angle(tmp_path):
    text = TEXT.replace("unit: m}", "unit: rad}").replace("unit: N", "unit: N*m").replace("unit: kg", "unit: kg*m^2")
    rotor = parse_spec(text, Path("rotor.yaml"))
    (tmp_path / "a.csv").write_text("t,x [counts],w\n" + lines())
    found = preflight(read_log(tmp_path / "a.csv", rotor), rotor)
    assert [f.severity for f in found if f.topic == "unit of x"] == ["warning"]
    (tmp_path / "a.csv").write_text("t,x [°],w\n" + lines(scale=(1, 180 / np.pi, 1)))
    log = read_log(tmp_path / "a.csv", rotor)
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=1e-9)
    (tmp_path / "a.csv").write_text("t,x_deg,w\n" + lines(scale=(1, 180 / np.pi, 1)))
    log = read_log(tmp_path / "a.csv", rotor, columns={"x": "x_deg"})
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=1e-9)


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1e3, "milliseconds 0.001"), (1e6, "microseconds 1e-6"), (1e9, "nanoseconds 1e-9"), (1 / 86400, "days 86400")],
)
def test_a_time_in_another_unit_that_nobody_says_is_a_problem(tmp_path, spec, factor, words):
    (tmp_path / "a.csv").write_text("t,x,w\n" + lines(digits="%.15g", scale=(factor, 1, 1)))
    found = [f for f in preflight(read_log(tmp_path / "a.csv", spec), spec) if f.topic == "sample rate"]
    assert found[0].severity == "problem" and all(w in found[0].words for w in words.split())


def test_three_decimals_are_no_thousands(tmp_path, spec):
    few = [f"{k};{0.25 * k:.3f};{k}" for k in range(40)]
    (tmp_path / "a.csv").write_text("t;x;w\n" + "\n".join(few) + "\n")
    assert read_log(tmp_path / "a.csv", spec).positions[5, 0] == 1.25
    (tmp_path / "b.csv").write_text("t;x;w\n" + "".join(f"{k};{1.125 * k:g};1\n" for k in range(30)))
    assert read_log(tmp_path / "b.csv", spec).positions[1, 0] == 1.125
    (tmp_path / "c.csv").write_text("t;x;w\n" + "".join(f"{k};{v};1\n" for k, v in enumerate(("0", "1.125", "2"))))
    (tmp_path / "said.yaml").write_text("decimal: point\n")
    read = read_log(tmp_path / "c.csv", spec, description=tmp_path / "said.yaml")
    assert read.positions[:, 0].tolist() == [0, 1.125, 2]


def test_the_command_says_how_a_log_was_read(tmp_path):
    (tmp_path / "slider.yaml").write_text(TEXT)
    (tmp_path / "a.csv").write_text("Zeit [ms];x [mm];w\n" + lines(";", comma=True, scale=(1e3, 1e3, 1)))
    with among("offset"):
        done = stiction("diagnose", tmp_path / "slider.yaml", tmp_path / "a.csv", "-o", tmp_path / "out")
    assert done.code == 0 and "verdict: none" in done.out, done.err
    for words in ("decimal commas", "column `Zeit [ms]` is t, by its name", "x is in mm", "t is in ms"):
        assert any(words in line for line in done.out.splitlines() if line.startswith("reading, train log: "))
    assert done.out.count("reading, train log: ") == 5


@pytest.mark.parametrize("delimiter", [",", ";"])
def test_a_time_with_whole_seconds_is_no_grouped_number(tmp_path: Path, delimiter: str) -> None:
    """2.999, 3, 3.001: a column that rises has decimals; 998, 999, 1.000 would fall."""
    rows = [delimiter.join((f"{t / 1000:g}", "0.5", "1.25")) for t in range(2500, 3500)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([delimiter.join("txw"), *rows]) + "\n", encoding="utf-8")
    log = read_log(path, parse_spec(TEXT, Path("slider.yaml")))
    assert log.time[[0, 500, -1]] == pytest.approx([2.5, 3.0, 3.499])


@pytest.mark.parametrize("by", ["option", "spec"])
def test_columns_of_the_command_or_the_spec_tell_the_header_and_the_times(tmp_path: Path, by: str) -> None:
    """As those of meta.yaml do; such a header was not found, and its times were `2 columns called X_Value`."""
    head = "path,Root/Time,Root/x,Root/w\nname,x_axis,pos,force\nunit,s,m,N\ntype,float,float,float\nvalues,,,\n"
    (tmp_path / "a.csv").write_text(head + "".join(f",{line}\n" for line in lines().splitlines()))
    pairs = [f"{a},{b},{a},{c}" for a, b, c in (line.split(",") for line in lines().splitlines())]
    (tmp_path / "b.csv").write_text("X_Value,pos,X_Value,force\n" + "\n".join(pairs) + "\n")
    for name, clock in (("a.csv", "x_axis"), ("b.csv", "X_Value")):
        columns = {"t": clock, "x": "pos", "w": "force"}
        text = TEXT if by == "option" else f"{TEXT}log: {{columns: {{t: {clock}, x: pos, w: force}}}}\n"
        log = read_log(tmp_path / name, parse_spec(text, Path("s.yaml")), columns=columns if by == "option" else None)
        assert log.sample_time == pytest.approx(STEP, rel=1e-6)
        assert np.allclose(log.positions[:, 0], MADE["x"], atol=2e-9)
