"""Files as test rigs, robots and loggers write them: layouts that were met in public repositories, with made numbers.

Each is read to the numbers of a slider's log in closed form, with the description of a few lines that its user would
write.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.file_formats import open_stream
from tests.expected_errors import matches, refused

MADE = rows(duration=4.0)
T, X, W = (MADE[name] for name in ("t", "x", "w"))
STEP = 0.002
COUNT = 1e-5


SAMPLES = [
    {
        "k": k,
        "n": k + 1,
        "t": t,
        "ms": 2 * k,
        "ticks": 16 * k + 4000,
        "s": 2 * k // 1000,
        "f": 2 * k % 1000,
        "x": x,
        "mm": 1e3 * x,
        "w": w,
        "ns": 1_600_000_000_000_000_000 + 2_000_000 * k,
    }
    for k, (t, x, w) in enumerate(np.column_stack((T, X, W)).tolist())
]


def lines(form: str, pick: slice = slice(None)) -> str:
    """A line for each sample by a format of k, t, x, mm, w, ms (s and f in two parts), and ns since 1970."""
    line = f"{form}\n".format_map
    return "".join(map(line, SAMPLES[pick]))


def counts(values: np.ndarray, step: float) -> list[int]:
    """Signed 16-bit numbers as if they were unsigned."""
    return [int(n) & 0xFFFF for n in np.round(values / step)]


TEKTRONIX = ("Record Length,2.5e+03,,", "Sample Interval,2e-03,,", ",,,", "Source,CH1,,", "Vertical Units,V,,")
TREND = 'Controller Name:,"PLC"\nTrend Tags:,2\nSample Period:,2 ms\nHeader:,"Date","Time","Axis.Pos","Axis.Force"\n'

READ = {
    # name: files, the log first, and its meta.yaml
    "rostopic echo -p": (
        {
            "a.csv": "%time,field.header.seq,field.header.frame_id,field.name0,field.position0,field.effort0\n"
            + lines("{ns},{k},base,joint1,{x:.9f},{w:.9f}")
        },
        "columns: {x: field.position0, w: field.effort0}\n",
    ),
    "a table between blanks with words in it": (
        {"a.csv": "timestamp actual_q_0 force moving\n" + lines("{t:.4f} {x:.9f} {w:.9f} True")},
        "columns: {x: actual_q_0, w: force}\n",
    ),
    "a preamble above rows with words": (
        {
            "a.csv": "Friction sweep,rig 3\nOperator,me\n\nt_s,phase,on,x,w\n"
            + lines("{t:.4f},ramp,TRUE,{x:.9f},{w:.9f}")
        },
        "",
    ),
    "no header, and a comma behind each row": (
        {"a.csv": lines("{x:.9f},0.1,{w:.9f},")},
        "columns: {x: 1, w: 3}\nsample_time: 0.002\n",
    ),
    "an oscilloscope's settings beside its first rows": (
        {
            "a.CSV": "".join(
                f"{TEKTRONIX[k] if k < len(TEKTRONIX) else ',,,'}{T[k]:018.12f},{X[k]:.9f},\n" for k in range(len(T))
            ),
            "ch2.csv": lines(",,,{t:018.12f},{w:.9f},"),
        },
        "columns: {t: 4, x: 5, w: c2.5}\nbeside: {c2: ch2.csv}\n",
    ),
    "a trend of a controller": (
        {"a.csv": TREND + lines('Data,"3/4/2026","10:15:{s:02d};{f:03d}",{x:.9f},{w:.9f}')},
        "columns: {x: Axis.Pos, w: Axis.Force}\n",
    ),
    "a signal a file, and an ending of their own": (
        {"pos.t": lines("{t:7.4f}\t{x:12.9f}"), "force.t": lines("{t:7.4f}\t{w:12.9f}")},
        "columns: {t: 1, x: 2, w: force.2}\nbeside: {force: force.t}\n",
    ),
    "a port's dump": (
        {"data.log": lines("{k} 14677990{s:02d}.{f:03d}000 {x:.9f} {w:.9f}")},
        "columns: {t: 2, x: 3, w: 4}\n",
    ),
    "a logger without an ending": ({"LOG0001": "t x w\n" + lines("{t:.4e} {x:.9e} {w:.9e}")}, ""),
    "a scope's units with their quantities": (
        {
            "a.csv": "Name\tScope YT\n\nName\tAxis.Pos\tName\tAxis.Force\nSampleTime[ms]\t2\tSampleTime[ms]\t2\n"
            "Unit\tmm (Length)\tUnit\tN (Force)\n\n" + lines("{ms}\t{mm:.6f}\t{ms}\t{w:.9f}") + "EOF\n"
        },
        "columns: {x: Axis.Pos, w: Axis.Force}\n",
    ),
    "a DAQ with a block of lines for each channel": (
        {
            "a.csv": "Timestamp,2020-03-16 17:04:51,Timestamp,2020-03-16 17:04:51\nInterval,0.002,Interval,0.002\n"
            'Channel name,"Force",Channel name,"Input 1"\nUnit,"N",Unit,"m"\n'
            + lines("{t:.3f},{w:.9f},{t:.3f},{x:.9f}")
        },
        "columns: {x: Input 1, w: Force}\n",
    ),
    "a long table": (
        {
            "a.csv": "Timestamp,Key,Value\n"
            + lines("{t:.3f},/Axis/Position,{x:.9f}\n{t:.3f},/Axis/Mode,run\n{t:.3f},/Drive/Force,{w:.9f}")
        },
        "columns: {x: /Axis/Position, w: /Drive/Force}\nlong: {name: Key, value: Value}\n",
    ),
    "a line for each signal, names in a comment": (
        {"a.csv": "# t pos force\n" + "".join(" ".join(f"{n:.9e}" for n in signal) + "\n" for signal in (T, X, W))},
        "columns: {x: pos, w: force}\n",
    ),
    "a line for each signal, its name in front": (
        {
            "a.txt": "".join(
                f"{name};{';'.join(f'{n:.9f}' for n in signal)}\n".replace(".", ",")
                for name, signal in (("t", T), ("x", X), ("w", W))
            )
        },
        "",
    ),
    "a line for each signal, without names": (
        {"a.dat": "".join("\t".join(f"{n:.9f}" for n in signal) + "\n" for signal in (X, W))},
        "columns: {x: 1, w: 2}\nsample_time: 2 ms\n",
    ),
    "a buffer with zeros before and after": (
        {"a.csv": "0,0,0\n" * 30 + lines("{ticks},{x:.9f},{w:.9f}") + "0,0,0\n" * 50},
        "columns: {t: 1, x: 2, w: 3}\nscale: {t: 0.000125}\n",
    ),
    "__time": (
        {"a.csv": "__time,/axis/position,/axis/effort\n" + lines("16000000{s:02d}.{f:03d},{x:.9f},{w:.9f}")},
        "columns: {x: /axis/position, w: /axis/effort}\n",
    ),
    "a saved oscilloscope of LinuxCNC": (
        {
            "halscope.log": "Sampling period is 2000000 nSec \n\n"
            + lines("joint.0.pos-fb {x:+.14f} arc-ok +0.000 arc-ok +0.000 joint.0.force {w:+.14f} ")
        },
        "columns: {x: joint.0.pos-fb, w: joint.0.force}\nsample_time: 2 ms\n",
    ),
    "the same with decimal commas": (
        {"halscope.log": lines("pos {x:+.14f} arc-ok +0.000 force {w:+.14f} ").replace(".", ",")},
        "columns: {x: pos, w: force}\nsample_time: 2 ms\n",
    ),
    "the same with channels that are not in use": (
        {"halscope.log": lines("pos {x:+.14f} (null) +0.000 (null) +0.000 force {w:+.14f} ")},
        "columns: {x: pos, w: force}\nsample_time: 2 ms\n",
    ),
    "names of two words, of which the last is the same": (
        {"a.txt": lines("Target Position: {k} mm, Actual Position: {mm:.6f} mm | M1 load: {w:.9f} M2 load: 0.1")},
        "columns: {x: Actual Position, w: M1 load}\nunits: {x: mm}\nsample_time: 2 ms\n",
    ),
    "lists of Python, a line for each": (
        {"a.txt": f"pos = [{''.join(f'{n:.9f}, ' for n in X)}]\nforce = [{', '.join(f'{n:.9f}' for n in W)}]\n"},
        "columns: {x: pos, w: force}\nsample_time: 2 ms\n",
    ),
    "vectors of a script of MATLAB": (
        {"a.m": "".join(f"{name} = [{' '.join(f'{n:.9f}' for n in y)}];\n" for name, y in (("x", X), ("w", W)))},
        "sample_time: 2 ms\n",
    ),
    "a file with one column for each signal, with a name or without": (
        {"pos.csv": lines("{x:.9f}"), "tau.txt": "force\n" + lines("{w:.9f}")},
        "columns: {x: 1, w: tau.force}\nbeside: {tau: tau.txt}\nsample_time: 2 ms\n",
    ),
    "a serial plotter": (
        {"a.txt": "MOT: align sensor\n" + lines("time:{ms},target:1.00,angle:{x:.9f},force:{w:.9f}")},
        "columns: {t: time, x: angle, w: force}\nunits: {t: ms}\n",
    ),
    "names and signs of equality": ({"a.log": lines("t = {t:.3f}; x = {x:.9f}; w = {w:.9f}")}, ""),
    "the monitor of a serial port": (
        {"a.txt": lines("12:00:{s:02d}.{f:03d} -> {k},{x:.9f},{w:.9f}")},
        "columns: {t: 1, x: 3, w: 4}\n",
    ),
    "names behind arrows": (
        {"a.txt": lines("12:00:{s:02d}.{f:03d} -> angle:{x:.9f}, force:{w:.9f}")},
        "columns: {x: angle, w: force}\n",
    ),
    "lines of a logger": (
        {"a.log": lines("[INFO] [16000{s:05d}.{f:03d}] [axis]: x: {x:.9f} m, w: {w:.9f} N (ok)")},
        "",
    ),
    "dictionaries as Python prints them": (
        {"a.txt": lines("{{'t': {t:.3f}, 'x': {x:.9f}, 'w': {w:.9f}, 'on': True}}")},
        "",
    ),
    "JSON Lines under another ending": (
        {"a.txt": lines('{{"t": {t:.3f}, "mode": "run", "x": {x:.9f}, "w": {w:.9f}}}')},
        "",
    ),
    "names that go over two lines": (
        {"a.csv": '"Time\n[s]","x\n[mm]","w"\n' + lines("{t:.3f},{mm:.6f},{w:.9f}")},
        "",
    ),
    "a measurement file of LabVIEW": (
        {
            "a.lvm": "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\t\nChannels\t2\t\n"
            "Samples\t2000\t2000\t\nX0\t0.0\t0.0\t\nDelta_X\t0.002\t0.002\t\n***End_of_Header***\t\t\t\n"
            "X_Value\tx\tw\tComment\n" + lines("{t:.6f}\t{x:.9f}\t{w:.9f}")
        },
        "",
    ),
    "a table of R with numbered rows": ({"a.txt": '"t" "x" "w"\n' + lines('"{n}" {t:.3f} {x:.9f} {w:.9f}')}, ""),
    "a table between bars, with a rule": (
        {"a.md": "| t | x | w |\n|---|---|---|\n" + lines("| {t:.3f} | {x:.9f} | {w:.9f} |")},
        "",
    ),
    "a rule below the header": (
        {"a.txt": "  t  |  x  |  w\n-----+-----+-----\n" + lines(" {t:.3f} | {x:.9f} | {w:.9f}")},
        "",
    ),
    "a testing machine's units": (
        {
            "a.txt": '"MTS|1|2"\n\n"Data","Time: 4 Sec"\n"x","w","Running Time"\n"mm","N","Sec"\n'
            + lines('"{mm:.6f}","{w:.9f}","{t:.3f}"')
        },
        "columns: {t: Running Time}\n",
    ),
    "zero bytes behind a loss of power": ({"a.csv": "t,x,w\n" + lines("{t:.3f},{x:.9f},{w:.9f}") + "\0" * 700}, ""),
    "a last row that is cut off": ({"a.csv": "t,x,w\n" + lines("{t:.3f},{x:.9f},{w:.9f}") + "4.000,0.0"}, ""),
    "lists in quotes": (
        {"a.csv": "stamp,name,position,effort\n" + lines('{t:.3f},"[\'a\', \'b\']","[{x:.9f}, 0.1]","[{w:.9f}, 0.2]"')},
        "columns: {t: stamp, x: 'position[0]', w: 'effort[0]'}\n",
    ),
    "arrays as numpy prints them": (
        {"a.csv": "t;position;effort;units [-]\n" + lines("{t:.3f};[{x:.9f} 0.1];(0.2, {w:.9f});1")},
        "columns: {x: 'position[0]', w: 'effort[1]'}\n",
    ),
    "registers as moteus prints them, behind the number of the servo": (
        {"a.log": lines("2/{{MODE(0x000): 10, POSITION(0x001): {x:.9f}, TORQUE(0x003): {w:.9f}, FAULT(0x00f): 0}}")},
        "columns: {x: POSITION(0x001), w: TORQUE(0x003)}\nsample_time: 2 ms\n",
    ),
    "counters of two servos as the Dynamixel SDK prints them": (
        {
            "a.txt": "Succeeded to open the port\nSucceeded to change the baudrate\n"
            + "".join(
                f"[ID:001] GoalPos:{x + 9}  PresPos:{x}\t[ID:002] GoalPos:0  PresPos:{w:03d}\n"
                for x, w in zip(np.round(X / COUNT).astype(int), np.round(1e3 * W).astype(int), strict=True)
            )
        },
        "columns: {x: 3, w: 6}\nscale: {x: 1.0e-5, w: 0.001}\nsample_time: 2 ms\n",
    ),
    "times of Python's logging between commas": (
        {"a.csv": "time,x,w\n" + lines("2026-03-04 10:15:{s:02d},{f:03d},{x:.9f},{w:.9f}")},
        "",
    ),
    "the same without a header": (
        {"a.log": lines("2026-03-04 10:15:{s:02d},{f:03d},{x:.9f},{w:.9f}")},
        "columns: [t, x, w]\n",
    ),
    "numbers behind a logger's name and level": (
        {"a.log": "starting\n" + lines("2026-03-04 10:15:{s:02d},{f:03d} - axis - INFO - {x:.9f}, {w:.9f}")},
        "columns: {t: 1, x: 2, w: 3}\n",
    ),
    "the same between colons": (
        {"a.log": lines("2026-03-04 10:15:{s:02d},{f:03d} INFO:root:{x:.9f};{w:.9f}")},
        "columns: {t: 1, x: 2, w: 3}\n",
    ),
    "times in brackets with a comma": (
        {"a.log": lines("[10:15:{s:02d},{f:03d}] {x:.9f},{w:.9f}")},
        "columns: {t: 1, x: 2, w: 3}\n",
    ),
    "milliseconds in a column with a name": (
        {"a.csv": "Date,ms,x,w\n" + lines("2026-03-04 10:15:{s:02d},{f:03d},{x:.9f},{w:.9f}")},
        "columns: {t: Date + 0.001*ms}\n",
    ),
    "a script of MATLAB": (
        {"a.m": "% rig 3\ndt = 0.002;\nrun = [\n" + lines("{t:.3f}, {x:.9f}, {w:.9f};") + "];\n"},
        "columns: [t, x, w]\n",
    ),
    "a semicolon at the end of each line": (
        {"a.txt": "ready\nt x w;\n" + lines("{t:.3f} {x:.9f} {w:.9f};")},
        "",
    ),
    "a timetable of MATLAB": ({"a.csv": "Time,x,w\n" + lines("{t:.5g} sec,{x:.9f},{w:.9f}")}, ""),
    "units behind each number": ({"a.csv": "t;x;w\n" + lines("{ms} ms;{mm:.9f} mm;{w:.9f} N")}, ""),
    "properties of Simulink's Data Inspector": (
        {"a.csv": "time,x,w\n,Type: double,Type: double\n,Unit: mm,Unit: N\n" + lines("{t:.3f},{mm:.9f},{w:.9f}")},
        "",
    ),
    "the same with the header that is said": (
        {"a.csv": "time,x,w\n,Unit: mm,\n,Interp: zoh,Interp: zoh\n" + lines("{t:.3f},{mm:.9f},{w:.9f}")},
        "header: 1\n",
    ),
    "numbers of a Keysight oscilloscope's channels": (
        {"a.csv": "x-axis,1,2\nsecond,Volt,Volt\n" + lines("{t:+.6E},{x:+.9E},{w:+.9E}")},
        "columns: {t: x-axis, x: 2, w: 3}\nscale: {x: 1, w: 1}\n",
    ),
    "hexadecimal counters": (
        {
            "a.csv": "t,x,w,on\n"
            + "".join(
                f"{t:.3f},0x{x:04X},0x{w:04x},true\n"
                for t, x, w in zip(T, counts(X, COUNT), counts(W, 1e-3), strict=True)
            )
        },
        "columns: {x: x*on, w: w}\nsigned16: [x, w]\nscale: {x: 1.0e-5, w: 0.001}\n",
    ),
}


def put(folder: Path, case: str) -> Path:
    """The files of a case, and the log's path."""
    files, meta = READ[case]
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    if meta:
        (folder / "meta.yaml").write_text(meta)
    return folder / next(iter(files))


@pytest.mark.parametrize("case", READ)
def test_read_to_the_same_numbers(tmp_path, spec, case):
    log = read_log(put(tmp_path, case), spec)
    assert log.sample_time == pytest.approx(STEP, rel=1e-6)
    assert log.size == len(T)
    near = COUNT if "counter" in case else 3e-6  # time since 1970 in ns is known to 0.3 us
    assert np.allclose(log.positions[:, 0], X, atol=near)
    assert np.allclose(log.inputs[:, 0], W, atol=1e-3)


TWO_TOPICS = "__time,/axis/pos,/drive/force\n" + lines("16000{s:05d}.{f:03d},{x:.9f},\n16000{s:05d}.{f:03d}7,,{w:.9f}")
SLOWER = T[::2] + 0.0007
FILES = {
    "rows of one topic each": {"a.csv": TWO_TOPICS},
    "a column of times before each signal": {
        "a.csv": "t_ms,x,t_ms,w\n"
        + "".join(
            f"{1e3 * T[k]:.4f},{X[k]:.9f},"
            + (f"{1e3 * SLOWER[k]:.4f},{np.interp(SLOWER[k], T, W):.9f}\n" if k < len(SLOWER) else ",\n")
            for k in range(len(T))
        )
    },
    "a file for each topic": {
        "a.csv": "%time,position\n" + lines("{t:.4f},{x:.9f}"),
        "b.csv": "stamp;w\n" + "".join(f"{t:.4f};{np.interp(t, T, W):.9f}\n" for t in SLOWER),
    },
}
META = {
    "a column of times before each signal": "columns: {x: x}\n",
    "rows of one topic each": "columns: {x: /axis/pos, w: /drive/force}\nmissing: join\n",
    "a file for each topic": "columns: {x: position, w: f.w}\nbeside: {f: {file: b.csv, time: stamp}}\n",
}


@pytest.mark.parametrize("case", FILES)
def test_signals_with_times_of_their_own_are_joined(tmp_path, spec, case):
    for name, content in FILES[case].items():
        (tmp_path / name).write_text(content)
    (tmp_path / "meta.yaml").write_text(META[case])
    log = read_log(tmp_path / "a.csv", spec)
    at = log.time - log.time[0] + STEP  # the first force comes after the first position
    assert log.sample_time == pytest.approx(STEP, rel=1e-4)
    assert np.allclose(log.positions[:, 0], np.interp(at, T, X), atol=2e-6)
    smooth = np.abs(np.interp(at + 0.004, T, W) - np.interp(at - 0.004, T, W)) < 1  # a jump becomes a line
    assert smooth.mean() > 0.98 and np.allclose(log.inputs[smooth, 0], np.interp(at, T, W)[smooth], atol=0.02)
    assert any("is converted to the times of" in note for note in log.notes), log.notes


@pytest.mark.parametrize(
    ("meta", "words"),
    [
        ("long: {name: Kye, value: Value}", "LOG003 `Kye` Key"),
        ("long: {name: Key}", "SPEC003 value"),
        ("long: {name: Key, value: Value}\ncolumns: {t: Stamp}", "LOG003 `Stamp` Timestamp"),
        ("long: {name: Key, value: Value}", "LOG005 a.csv:2 `on`"),
    ],
)
def test_long_tables_that_are_refused(tmp_path, spec, meta, words):
    (tmp_path / "a.csv").write_text("Timestamp,Key,Value\n0,x,on\n0,w,1\n1,x,2\n1,w,1\n")
    (tmp_path / "meta.yaml").write_text(meta)
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec)
    assert matches(told.value, words), (told.value.code, told.value)


def test_what_keeps_signals_from_being_joined_says_how(tmp_path, spec):
    (tmp_path / "a.csv").write_text(TWO_TOPICS)
    where = {"x": "/axis/pos", "w": "/drive/force"}
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.csv", spec, columns=where)
    assert matches(told.value, "LOG006 a.csv:3 `missing: join`")
    for name, content in FILES["a file for each topic"].items():
        (tmp_path / name).write_text(content)
    for meta, words in (
        ("beside: {f: b.csv}\n", "LOG011 b.csv 1000 `time: COLUMN`"),
        ("beside: {f: {file: b.csv, time: stmp}}\n", "LOG003 `stmp` stamp"),
        ("beside: {f: {file: b.csv, at: stamp}}\n", "SPEC004 meta.yaml:2 `at` file time"),
        ("beside: [b.csv]\n", "SPEC006 meta.yaml:2"),
    ):
        (tmp_path / "meta.yaml").write_text("columns: {x: position, w: f.w}\n" + meta)
        with pytest.raises(BadInput) as told:
            read_log(tmp_path / "a.csv", spec)
        assert matches(told.value, words), told.value


REFUSED = {
    # name and first bytes of a file, what the message says
    "a.xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "LOG002 Excel .xlsx CSV"),
    "a_renamed_workbook.csv": (b"PK\x03\x04\x14\0\6\0", "LOG002 Excel .xlsx"),
    "a_renamed_table.txt": (b"\x89HDF\r\n\x1a\n\0", "LOG002 HDF5 .h5"),
    "a.pkl": (b"\x80\x04\x95\x10\0\0\0", "LOG002 pickle numpy.savez"),
    "a.csv.gz": (b"\x1f\x8b\x08\0\0", "LOG002 compressed unpacked"),
    "a.bag": (b"#ROSBAG V2.0\n\0", "LOG002 rosbags-convert"),
    "sign_or_dash.log": (
        b"".join(b"2026-03-04 10:15:0%d,000 INFO -0.1,2\n" % k for k in range(9)),
        "LOG001 sign_or_dash.log",
    ),
    "candump.log": (b"(1600000000.002000) can0 141#0000FF\n", "LOG002 candump DBC"),
    "candump_on_a_terminal.log": (b"  can0  201   [3]  11 22 33\n  can0  201   [3]  11 22 34\n", "LOG002 candump DBC"),
    "candump_with_times.log": (b" (1600000000.002)  can0  201   [2]  11 22\n", "LOG002 candump DBC"),
    "rostopic.txt": (b"header: \n  seq: 1\n  stamp: \n    secs: 1\n", "LOG002 `rostopic echo -p`"),
    "gz_topic.txt": (b'header {\n  stamp {\n    nsec: 2000000\n  }\n}\nname: "m"\n', "LOG002 `gz topic -e` CSV"),
    "milliseconds_beside.csv": (
        b"Time,Millitm,x,w\n" + b"".join(b"12:00:00,%d,%d,2\n" % (2 * k, k) for k in range(9)),
        "LOG007 milliseconds_beside.csv:3 `columns: {t: Time + 0.001*MS}`",
    ),
    "flight.log": (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\nMOT, 1, 2\n", "LOG002 ArduPilot mavlogdump"),
    "echo.yaml": (b"header:\n  stamp:\n    sec: 1\nposition:\n- 0.1\n---\n", "LOG002 --csv bag"),
    "a.xyz": (b"\1\2\3", "LOG002 `.xyz` .csv"),
    "empty.log": (b"", "LOG009 empty.log"),
    "units.csv": (b"t,x,w\n0 ms,1 mm,2 N\n2 ms,1 mm,2 N\n4 ms,1 cm,2 N\n", "LOG005 units.csv:2 `units:`"),
    "other_unit.csv": (
        b"t,x,w\n0 ms,9 mm,2 N\n2 ms,1 cm,2 N\n" + b"".join(b"%d ms,9 mm,2 N\n" % k for k in range(4, 9)),
        "LOG005 other_unit.csv:3 `1 cm`",
    ),
    "other_number.log": (
        b"".join(b"%d/{x: %d, w: 2, t: %d}\n" % (1 + (k > 4), k, k) for k in range(9)),
        "LOG003 other_number.log",
    ),
    "one.csv": (b"0.1\n0.2\n0.3\n0.4\n", "LOG003 one.csv:1 `beside: {tau: FILE}`"),
    "records.csv": (b"t,x,w\n0,1,2\n1,1,2\nt,x,w\n0,1,2\n1,1,2\n", "LOG007 records.csv:5 file record"),
}


SCOPE = (
    "Name;Scope YT;\n\nName;Axis.Pos;Name;Axis.Force\nSampleTime[ms];2;SampleTime[ms];4\n"
    "Unit;mm (Length);Unit;(None)\n\n"
)


@pytest.mark.parametrize("began", [0, 132959733843760000], ids=["ms", "FILETIME"])
def test_channels_of_a_scope_at_rates_of_their_own(tmp_path, spec, began):
    tick = 10_000 if began else 1
    slow = [f"{began + 4 * tick * k};{W[2 * k]:.9f}" for k in range(len(T) // 2)] + [";"] * (len(T) // 2)
    rows = [f"{began + 2 * tick * k};{1e3 * X[k]:.6f};{slow[k]}" for k in range(len(T))]
    (tmp_path / "a.csv").write_text((SCOPE + "\n".join(rows) + "\nEOF\n").replace(".", ",").replace("Axis,", "Axis."))
    log = read_log(tmp_path / "a.csv", spec, columns={"x": "Axis.Pos", "w": "Axis.Force"})
    assert log.sample_time == pytest.approx(STEP, rel=1e-6) and log.size == len(T) - 1
    assert np.allclose(log.positions[:, 0], X[:-1], atol=2e-9)
    assert np.allclose(log.inputs[::2, 0], W[:-1:2], atol=2e-6)
    assert any("`Axis.Force` (250 Hz) is converted to the times of `Axis.Pos` (500 Hz)" in note for note in log.notes)
    held = "columns: {x: Axis.Pos, w: Axis.Force}\nhold: Axis.Force\n"
    (tmp_path / "meta.yaml").write_text(held)
    log = read_log(tmp_path / "a.csv", spec)
    assert np.allclose(log.inputs[1::2, 0], W[:-2:2], atol=2e-6)


def test_named_rows_and_lists_are_read_in_blocks_too(tmp_path, spec, monkeypatch):
    monkeypatch.setattr("codegen.logs.formats.csv_file.BLOCK_BYTES", 5000)
    for case, column in (
        ("a serial plotter", "angle"),
        ("lists in quotes", "position[0]"),
        ("registers as moteus prints them, behind the number of the servo", "POSITION(0x001)"),
        ("times of Python's logging between commas", "x"),
        ("a timetable of MATLAB", "x"),
        ("a script of MATLAB", "2"),
        ("numbers behind a logger's name and level", "2"),
    ):
        (tmp_path / case).mkdir()
        parts = [block.values[:, 0] for block in open_stream(put(tmp_path / case, case)).blocks([column])]
        assert len(parts) > 3 and np.allclose(np.concatenate(parts), X, atol=1e-8)


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_what_it_is(tmp_path, spec, name):
    content, words = REFUSED[name]
    (tmp_path / name).write_bytes(content)
    with refused(words):
        read_log(tmp_path / name, spec)
