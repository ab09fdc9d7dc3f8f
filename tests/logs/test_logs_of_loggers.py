"""Logs of firmware, loggers and libraries: layouts that were met in public repositories, with made numbers.

Each is read to the numbers of a slider's log in closed form, with the description that its user would write.
"""

from __future__ import annotations

import io
import json
from datetime import datetime, timedelta

import numpy as np
import pytest
from test_logs_of_rigs import STEP, T, W, X, lines

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.description import LogDescription
from codegen.logs.file_formats import open_stream
from tests.expected_errors import matches, refused

ROWS = lines("{ms},{x:.9f},{w:.9f}").splitlines()
STARTED = datetime(2026, 3, 4, 10, 15, 16)


def stamped(form: str) -> str:
    """Rows with the time by a format of ``datetime``, the milliseconds as ``MMM``."""
    out = []
    for t, x, w in zip(T, X, W, strict=True):
        at = STARTED + timedelta(seconds=round(t, 3))
        out.append(f"{at.strftime(form).replace('MMM', f'{at.microsecond // 1000:03d}')};{x:.9f};{w:.9f}\n")
    return "".join(out)


def saved(**arrays: np.ndarray) -> bytes:
    """An .npz archive, or an .npy file of the array called ``npy``."""
    file = io.BytesIO()
    np.save(file, arrays["npy"]) if "npy" in arrays else np.savez(file, **arrays)
    return file.getvalue()


def shuffled(moved: dict[int, int]) -> str:
    """The rows with some of them written later."""
    rows = list(ROWS)
    for k, by in moved.items():
        rows.insert(k + by, rows.pop(k))
    return "ms,x,w\n" + "\n".join(rows)


def with_lines(added: dict[int, str]) -> str:
    """The rows with lines of text before some of them."""
    return "".join(f"{added[k]}\n{row}\n" if k in added else f"{row}\n" for k, row in enumerate(ROWS))


MS = "units: {t: ms}\n"
RECORDS = [{"t": t, "x": x, "w": w} for t, x, w in zip(T.tolist(), X.tolist(), W.tolist(), strict=True)]
KEYED = {name: {str(k): v for k, v in enumerate(c.tolist())} for name, c in (("t", T), ("x", X), ("w", W))}
SCHEMA = {"fields": [{"name": "index", "type": "integer"}], "primaryKey": ["index"], "pandas_version": "1.4.0"}
SPLIT = {"columns": ["t", "x", "w"], "index": list(range(len(T))), "data": [[*r.values()] for r in RECORDS]}
INDENTED = "".join(json.dumps(r, indent=1) + "\n" for r in RECORDS)
CUT = json.dumps([*RECORDS, RECORDS[0]], indent=0)[:-24]
PAIRS = [[r["t"], {"pos": r["x"], "axes": [{"force": r["w"]}]}] for r in RECORDS]
READ = {
    "a servo drive's trend with its names in two lines": (  # MR Configurator
        "a.csv",
        "Axis1\nNumber of sampling data,4000\nSampling time interval(ms),2.000\nTime,Analog 1,Analog 2,Digital 1\n"
        "ms,Servo motor speed,Torque,Not selected\n" + lines("{ms},{x:.9f},{w:.9f},0.0"),
        "columns: {t: 1, x: Servo motor speed, w: Torque}\n" + MS,
        "the header is line 5",
    ),
    "names in Chinese that are not UTF-8": (
        "a.csv",
        ("角度rad,角速度rad/s,扭矩Nm\n" + lines("{x:.9f},0.0,{w:.9f}")).encode("gbk"),
        "columns: {x: 1, w: 3}\nsample_time: 2 ms\n",
        "line 1 is not UTF-8: the file is read as Windows-1252",
    ),
    # name: file, content, meta.yaml, words among the notes
    "a port's dump with messages among the rows": (
        "a.txt",
        "Booting v1.2\nms,x,w\n" + with_lines({100: "WARN: hot, 61", 101: "-- retry", 900: "Homing done"}),
        "columns: {t: ms}\n" + MS,
        "line 103 is text, and not read (`WARN: hot, 61`), and 2 more such lines",
    ),
    "messages among rows between blanks": (
        "a.txt",
        with_lines({5: "motor 1 is hot", 900: "hot motor slows"}).replace(",", " "),
        "columns: {t: 1, x: 2, w: 3}\n" + MS,
        "line 6 is text",
    ),
    "dates of rosbag_to_csv": ("a.csv", "time;x;w\n" + stamped("%Y/%m/%d/%H:%M:%S.MMM"), "", "time of day"),
    "dates of MATLAB": ("a.csv", "Time;x;w\n" + stamped("%d-%b-%Y %H:%M:%S.MMM"), "", "time of day"),
    "dates and times with a line": ("a.csv", "time;x;w\n" + stamped("%Y-%m-%d_%H:%M:%S.MMM"), "", "date and time"),
    "the basic form of ISO 8601": ("a.csv", "time;x;w\n" + stamped("%Y%m%dT%H%M%S.MMM"), "", "date and time"),
    "durations of pandas": ("a.csv", "time;x;w\n" + stamped("0 days %H:%M:%S.MMM000"), "", "time of day"),
    "date and time of day in two columns": (
        "a.csv",
        "Datum;Uhrzeit;x;w\n" + stamped("%d.%m.%Y;%H:%M:%S,MMM"),
        "",
        "column `Uhrzeit` is t, by its name",
    ),
    "units before the label of a run": (
        "a.csv",
        "Time (s) Run #1;Position (mm) Run #1;Force, Ch 01 (N) Run #1\n"
        + lines("{t:.3f};{mm:.6f};{w:.9f}").replace(".", ","),
        'columns: {t: "Time (s) Run #1", x: "Position (mm) Run #1", w: "Force, Ch 01 (N) Run #1"}\n',
        "x is in mm, as the file says",
    ),
    "units behind a word": (
        "a.csv",
        '"Zeit in ms","x in mm","w, N"\n' + lines("{ms},{mm:.6f},{w:.9f}"),
        "",
        "x is in mm, as the file says",
    ),
    "numbered rows whose last column has no name": (
        "a.csv",
        "Take 2,,,\n,Body,Body,\nFrame,Time,X,\n" + lines("{k},{t:.4f},{x:.9f},{w:.9f}"),
        "columns: {x: X, w: 4}\n",
        "header is line 3 (Frame, Time, X, 4)",
    ),
    "decimal commas between tabs, three decimals at the end": (
        "a.txt",
        "Zeit\tx\tw\ttemp\n" + lines("{t:.4f}\t{x:.9f}\t{w:.9f}\t21.500").replace(".", ","),
        "",
        "decimal commas",
    ),
    "names and values before the table": (
        "a.csv",
        '"Product","a recorder"\n"Data version","2"\n"I interval","32"\n"rollPID","45,80,40"\n"i","time","x","w"\n'
        + lines("{k},{t:.4f},{x:.9f},{w:.9f}"),
        "",
        "the header is line 5",
    ),
    "properties of the columns below their names": (
        "a.csv",
        "format,Recording\npath,,rig/x,rig/w\nname,Time,pos,force\nunit,s,mm,N\ntype,double,double,double\n"
        + lines(",{t:.4f},{mm:.6f},{w:.9f}"),
        "columns: {t: Time, x: pos, w: force}\n",
        "the header is line 3",
    ),
    "times of each channel and units above the header": (
        "a.lvm",
        "LabVIEW Measurement\t\nMulti_Headings\tYes\nX_Columns\tMulti\n***End_of_Header***\t\n\t\n"
        "Channels\t2\t\t\t\nY_Unit_Label\tmm\t\tN\t\t\n***End_of_Header***\t\t\t\t\t\n"
        "X_Value\tPosition\tX_Value\tForce\tComment\n" + lines("{t:.4f}\t{mm:.6f}\t{t:.4f}\t{w:.9f}"),
        "columns: {t: X_Value, x: Position, w: Force}\n",
        "the units of the line `Y_Unit_Label` (mm, N)",
    ),
    "an oscilloscope's units among other properties": (
        "a.csv",
        '"Model","a scope"\n"TraceName","Pos","Force"\n"BlockSize",2001,2001\n"VUnit","mm","N"\n"HUnit","s","s"\n\n'
        + lines(",{mm:.6f},{w:.9f}"),
        "columns: {x: Pos, w: Force}\nsample_time: 2 ms\n",
        "the units of the line `VUnit` (mm, N)",
    ),
    "files put one after the other, with their marks": (
        "a.csv",
        "\ufefft,x,w\r\n"
        + lines("{t:.4f},{x:.9f},{w:.9f}\r", slice(900))
        + "\ufefft,x,w\r\n"
        + lines("{t:.4f},{x:.9f},{w:.9f}", slice(900, None)),
        "",
        "line 902 repeats the header",
    ),
    "units of several factors behind each number": (
        "a.csv",
        '"Time","x","w"\n' + lines('"{t:.4f} s","{mm:.6f} mm","{w:.9f} kg⋅m/s²"'),
        "",
        "the unit behind each number (s, mm, kg⋅m/s²)",
    ),
    "a clock's function": ("a.csv", "millis,x,w\n" + "\n".join(ROWS), "", "t is in ms"),
    "seconds and nanoseconds": (
        "a.csv",
        "stamp.sec,stamp.nanosec,x,w\n" + lines("16000{s:05d},{f:03d}000000,{x:.9f},{w:.9f}"),
        "",
        "`stamp_sec + 1e-9*stamp_nanosec` is t",
    ),
    "pandas, by columns": ("a.json", json.dumps(KEYED), "", ""),
    "pandas, by columns with an index of times": (
        "a.json",
        json.dumps({n: {str(2 * k): v for k, v in enumerate(KEYED[n].values())} for n in ("x", "w")}),
        "columns: {t: index}\n" + MS,
        "",
    ),
    "pandas, by rows": ("a.json", json.dumps({str(k): r for k, r in enumerate(RECORDS)}), "", ""),
    "pandas, split": ("a.json", json.dumps(SPLIT), "", ""),
    "pandas, a table with its schema": ("a.json", json.dumps({"schema": SCHEMA, "data": RECORDS}), "", ""),
    "records under keys of keys": (
        "a.json",
        json.dumps({"meta": {"n": 1}, "data": {"rate": 5, "rows": RECORDS}}),
        "",
        "",
    ),
    "records under keys that are said": (
        "a.json",
        json.dumps({"a": {"rows": RECORDS}, "b": {"rows": RECORDS[:9]}}),
        "records: a.rows\n",
        "",
    ),
    "records among events": (
        "a.jsonl",
        '{"event": "start"}\n' + "".join(json.dumps(r) + "\n" for r in RECORDS) + '{"event": "stop"}\n',
        "",
        "2 records without any of the columns left out",
    ),
    "numbers in texts": ("a.json", json.dumps([{k: str(v) for k, v in r.items()} for r in RECORDS]), "", ""),
    "dates in records": (
        "a.jsonl",
        lines('{{"time": "2026-03-04T23:59:{s:02d}.{f:03d}Z", "x": {x:.9f}, "w": {w:.9f}}}'),
        "",
        "",
    ),
    "a time and a message": ("a.json", json.dumps(PAIRS), "columns: {t: 1, x: 2.pos, w: '2.axes[0].force'}\n", ""),
    "indented records, one after the other": (
        "a.json",
        "".join(json.dumps(r, indent=1) + "\n" for r in RECORDS),
        "",
        "",
    ),
    "a list that is cut off": (
        "a.json",
        json.dumps([*RECORDS, RECORDS[0]], indent=0)[:-24],
        "",
        "cut off and not read",
    ),
    "a list with a comma at its end": ("a.json", f"{json.dumps(RECORDS)[:-1]},]", "", ""),
    "a signal a row, .npz": (
        "a.npz",
        saved(t=T, q=np.stack([X, 0 * X]), f=np.stack([0 * W, W])),
        "columns: {x: q.1, w: f.2}\n",
        "",
    ),
    "a signal a row, .npy": ("a.npy", saved(npy=np.stack([T, X, W])), "columns: {t: 1, x: 2, w: 3}\n", ""),
    "columns one after the other, .npy": (
        "a.npy",
        saved(npy=np.asfortranarray(np.column_stack([T, X, W]))),
        "columns: {t: 1, x: 2, w: 3}\n",
        "",
    ),
    "both, .npy": ("a.npy", saved(npy=np.column_stack([T, X, W]).T), "columns: {t: 1, x: 2, w: 3}\n", ""),
    "an ESP's monitor in colours": (
        "a.log",
        "\x1b[0;32mI (12) boot: 2 cores\x1b[0m\n" + lines("\x1b[0;32mI ({ms}) axis: x={x:.9f}, w={w:.9f}\x1b[0m"),
        MS,
        "each row names its numbers (stamp, x, w)",
    ),
    "a logger with milliseconds and microseconds": (
        "a.log",
        lines("[00:00:{s:02d}.{f:03d},000] <inf> axis: x: {x:.9f}, w: {w:.9f}"),
        "",
        "",
    ),
    "a journal with process numbers": (
        "a.log",
        lines("Mar 04 10:15:16 rig drive[1234]: t={t:.3f} x={x:.9f} w={w:.9f}"),
        "columns: {t: t}\n",
        "",
    ),
    "a phone's log": (
        "a.log",
        "--------- beginning of main\n"
        + lines("03-04 10:15:{s:02d}.{f:03d}  1234  1250 I Axis    : x={x:.9f} w={w:.9f}"),
        "",
        "",
    ),
    "decoded CAN frames": (
        "a.log",
        lines("(16000{s:05d}.{f:03d})  can0  0C1   [8]  00 11 22 33 :: Motor(x: {x:.9f} m, w: {w:.9f} N)"),
        "",
        "",
    ),
    "a terminal's times": (
        "a.txt",
        lines("2026-03-04 10:15:{s:02d}.{f:03d} {x:.9f},{w:.9f}"),
        "columns: {t: 1, x: 2, w: 3}\n",
        "",
    ),
    "a terminal's times in brackets": (
        "a.txt",
        lines("[10:15:{s:02d}.{f:03d}] {x:.9f}\t{w:.9f}"),
        "columns: {t: 1, x: 2, w: 3}\n",
        "",
    ),
    "times between blanks and decimal commas": (
        "a.txt",
        lines("10:15:{s:02d}.{f:03d} {x:.9f} {w:.9f}").replace(".", ","),
        "columns: {t: 1, x: 2, w: 3}\n",
        "decimal commas",
    ),
    "an oscilloscope's settings behind its units": (
        "a.csv",
        "X,CH1,CH2,Start,Increment,\nSequence,mm,N,-6.0e-03,2.0e-03\n" + lines("{k},{mm:.6f},{w:.9f},,"),
        "columns: {x: CH1, w: CH2}\nsample_time: 2 ms\n",
        "x is in mm",
    ),
    "units in a header between blanks": (
        "a.txt",
        "Time [s]  Way (mm)  Force [N m/m]\n" + lines("{t:.3f} {mm:.6f} {w:.9f}"),
        "columns: {x: Way (mm), w: 'Force [N m/m]'}\n",
        "x is in mm",
    ),
    "a line below the header without a first field": (
        "a.asc",
        "Rig 3\n\nTime [s]\tx\tw\n\tSR=500\tSR=500\n" + lines("{t:.3f}\t{x:.9f}\t{w:.9f}"),
        "columns: {x: x, w: w}\n",
        "",
    ),
    "rows out of order": ("a.csv", shuffled({100: 5, 900: 1, 1500: 40}), f"columns: {{t: ms}}\n{MS}", "sorted by time"),
    "states of a robot as JSON in a text file": (
        "a.txt",
        lines('{{"x": [{x:.9f}, 0], "w": [{w:.9f}, 1], "mode": "Move", "time": {t:.3f}}}'),
        "columns: {x: 'x[0]', w: 'w[0]'}\n",
        "",
    ),
    "a name of time that is not the first choice": (
        "a.csv",
        "sim_time,timestamp,x,w\n" + lines("{k},{t:.3f},{x:.9f},{w:.9f}"),
        "",
        "column `timestamp` is t",
    ),
}


@pytest.mark.parametrize("case", READ)
def test_read_to_the_same_numbers(tmp_path, spec, case):
    name, content, meta, words = READ[case]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    if meta:
        (tmp_path / "meta.yaml").write_text(meta)
    log = read_log(tmp_path / name, spec)
    assert log.sample_time == pytest.approx(STEP, rel=1e-6)
    assert log.size == len(T)
    assert np.allclose(log.positions[:, 0], X, atol=1e-6) and np.allclose(log.inputs[:, 0], W, atol=1e-3)
    assert words in " | ".join(log.notes), log.notes


@pytest.mark.parametrize("word", ["--", "?", "undefined", "<NA>", "NaT", "\\N", "(null)", "-∞", "1.#J", "Bad"])
def test_words_for_a_missing_value(tmp_path, spec, word):
    texts = [row.split(",") for row in ROWS]
    texts[50][1] = word
    (tmp_path / "a.csv").write_text("t,x,w\n" + "".join(",".join(text) + "\n" for text in texts))
    (tmp_path / "meta.yaml").write_text(f"missing: fill\n{MS}")
    log = read_log(tmp_path / "a.csv", spec)
    assert log.size == len(T) and np.allclose(log.positions[:, 0], X, atol=1e-5)
    assert log.raw_data.repaired == {"x": 1}


@pytest.mark.parametrize("torn", ["1000,0.0021002,0.01,3.0", "1000,0.00", "1000,0.0.2,3", "10\ufffd0,0.0,3"])
def test_a_damaged_row(tmp_path, spec, torn):
    rows = [*ROWS[:500], torn, *ROWS[501:]]
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join(rows))
    (tmp_path / "meta.yaml").write_text(MS)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, "LOG005 a.csv:502"), told.value
    assert "decimal comma" not in str(told.value)
    (tmp_path / "meta.yaml").write_text(f"missing: fill\n{MS}")
    log = read_log(tmp_path / "a.csv", spec)
    assert any("line 502 is a damaged row" in note for note in log.notes)
    assert np.allclose(log.positions[:, 0], np.interp(log.time, T, X), atol=1e-5)


@pytest.mark.parametrize("size", [2**16, 2**32])
def test_a_clock_that_overflows(tmp_path, spec, size):
    started = 2**32 - 1_500_000
    rows = "".join(
        f"{(started + 2000 * k) % size},{x:.9f},{w:.9f}\n" for k, (x, w) in enumerate(zip(X, W, strict=True))
    )
    (tmp_path / "a.csv").write_text("micros,x,w\n" + rows)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, f"LOG007 a.csv `unwrap: {{micros: {size}}}`"), told.value
    (tmp_path / "meta.yaml").write_text(f"unwrap: {{micros: {size}}}\n")
    log = read_log(tmp_path / "a.csv", spec)
    assert log.size == len(T) and np.allclose(log.positions[:, 0], X, atol=1e-6)


@pytest.mark.parametrize(
    "rows",
    [
        [*ROWS[:1000], *(f"{int(row.split(',')[0]) - 5},{row.split(',', 1)[1]}" for row in ROWS[1000:])],  # set back
        [*ROWS[:1000], *ROWS[:1000]],
        [*ROWS[:300], *ROWS[600:], *ROWS[300:600]],
    ],
)
def test_other_times_that_run_backwards_are_not_sorted(tmp_path, spec, rows):
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join(rows))
    (tmp_path / "meta.yaml").write_text(MS)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, "LOG007 a.csv"), told.value


REFUSED = {
    # name and content of a file, what the message says
    "a.xml": (b"<?xml version='1.0'?>\n<s t='0'/>\n", "LOG002 XML CSV"),
    "a_renamed.csv": (b"<!DOCTYPE html><html>\n", "LOG002 HTML CSV"),
    "a.db": (b"SQLite format 3\0" + bytes(99), "LOG002 SQLite CSV"),
    "a.feather": (b"ARROW1\0\0" + bytes(99), "LOG002 Arrow Parquet"),
    "octave.txt": (b"# Created by Octave 6.4.0\n# name: t\n# type: matrix\n", "LOG002 Octave `save -v7"),
    "hexadecimal.csv": (b"t,x,w\n0,006B,1\n1,006C,1\n2,FFFE,1\n", "LOG005 hexadecimal.csv:2 `006B` 0x"),
    "more_later.csv": (b"t,x,w\n0,0.1,1\n1,0.2,1\n2,0.1,1,fault\n", "LOG005 more_later.csv:4 4 `missing: fill`"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_what_it_is(tmp_path, spec, name):
    content, words = REFUSED[name]
    (tmp_path / name).write_bytes(content)
    with refused(words):
        read_log(tmp_path / name, spec)


def test_a_damaged_row_is_missing_in_blocks_too(tmp_path, monkeypatch):
    monkeypatch.setattr("codegen.logs.formats.csv_file.BLOCK_BYTES", 5000)
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join([*ROWS[:1500], "1,2", *ROWS[1501:]]))
    source = open_stream(tmp_path / "a.csv", LogDescription(missing="fill"))
    values = np.concatenate([block.values[:, 0] for block in source.blocks(["x"])])
    assert np.flatnonzero(np.isnan(values)).tolist() == [1500]


def test_many_damaged_rows_are_refused(tmp_path, spec):
    rows = [row if k % 50 else f"{row},7" for k, row in enumerate(ROWS, 1)]
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join(rows))
    (tmp_path / "meta.yaml").write_text(f"missing: fill\n{MS}")
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, "LOG005 a.csv:51 4"), told.value


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[{"t": 0, "x": 1, "w": 1},\n{"t": 1 "x": 1, "w": 1},\n{"t": 2, "x": 1, "w": 1}]', "LOG001 a.json:2"),
        ('{"t": 0, "x": 1, "w": 1}\n{"t": 1 "x": 1}\n{"t": 2, "x": 1, "w": 1}', "LOG001 a.json:2"),
        ('[{"t": 0, "x": 1, "w": 1}] and more', "LOG001 a.json:1"),
        ('[{"t": "soon", "x": 1, "w": 1}, {"t": 1, "x": 1, "w": 1}]', 'LOG005 a.json `"soon"` number'),
        ('{"a": {"x": [1, 2]}, "b": {"x": [1, 2]}}', "LOG001 `records: KEY`"),
    ],
)
def test_json_that_is_refused(tmp_path, spec, text, words):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.json", spec)
    assert matches(told.value, words), told.value
