"""Logs of firmware, loggers and libraries: layouts that were met in public repositories, with made numbers.

Each is read to the numbers of a slider's log in closed form, with the description that its user would write.
"""

from __future__ import annotations

import json
from datetime import datetime, timedelta

import numpy as np
import pytest
from test_logs_of_rigs import STEP, T, W, X, lines

from codegen.base.errors import BadInput
from codegen.logs import read_log
from tests.told import tells

ROWS = lines("{ms},{x:.9f},{w:.9f}").splitlines()
STARTED = datetime(2026, 3, 4, 10, 15, 16)


def stamped(form: str) -> str:
    """Rows with the time by a format of ``datetime``, the milliseconds as ``MMM``."""
    out = []
    for t, x, w in zip(T, X, W, strict=True):
        at = STARTED + timedelta(seconds=round(t, 3))
        out.append(f"{at.strftime(form).replace('MMM', f'{at.microsecond // 1000:03d}')};{x:.9f};{w:.9f}\n")
    return "".join(out)


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
    assert log.intake.repaired == {"x": 1}


@pytest.mark.parametrize("torn", ["1000,0.0021002,0.01,3.0", "1000,0.00", "1000,0.0.2,3", "10\ufffd0,0.0,3"])
def test_a_damaged_row(tmp_path, spec, torn):
    rows = [*ROWS[:500], torn, *ROWS[501:]]
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join(rows))
    (tmp_path / "meta.yaml").write_text(MS)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert tells(told.value, "LOG005 a.csv:502"), told.value
    assert "decimal comma" not in str(told.value)
    (tmp_path / "meta.yaml").write_text(f"missing: fill\n{MS}")
    log = read_log(tmp_path / "a.csv", spec)
    assert any("line 502 is a damaged row" in note for note in log.notes)
    assert np.allclose(log.positions[:, 0], np.interp(log.time, T, X), atol=1e-5)


def test_many_damaged_rows_are_refused(tmp_path, spec):
    rows = [row if k % 50 else f"{row},7" for k, row in enumerate(ROWS, 1)]
    (tmp_path / "a.csv").write_text("t,x,w\n" + "\n".join(rows))
    (tmp_path / "meta.yaml").write_text(f"missing: fill\n{MS}")
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert tells(told.value, "LOG005 a.csv:51 4"), told.value


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
    assert tells(told.value, words), told.value
