"""Shadow mode: silent while the machine is as declared, and speaking at the right time when it is not."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from codegen.app.derived import derived_from
from codegen.app.machine import Machine, load
from codegen.app.watch import Watched, alarm_text, watch
from codegen.base.errors import BadInput
from codegen.logs.formats.bag_file import DEFINITIONS
from codegen.replay.samples import Block
from codegen.replay.watch import Watch, too_slow
from tests.app.command import SPECS, is_one_message, stiction
from tests.expected_errors import refused
from tests.slow_cases import slow_except

BELT = SPECS / "belt_axis.yaml"
PERIOD = 0.001
JOINTS = "sensor_msgs/msg/JointState"
JUMP = 2.0
"""When the friction or the force changes, s: in the middle of a stroke."""


def log_of(after: str = "", friction: float = 9.0, seconds: float = 4.0) -> str:
    """A log of the belt axis, integrated here by itself: a carriage with Coulomb friction under a PD controller.

    Args:
        after: what changes at JUMP: ``friction`` (to 14 N) or ``force`` (6 N of somebody who pulls back).
    """
    m, kf, b, h, parts = 4.2, 18.5, 12.0, PERIOD, 20
    x = v = 0.0
    rows = ["t,x,u"]
    seen = 0.0
    speed = 0.0
    for k in range(round(seconds / h)):
        t = k * h
        read = np.round(x / 5e-6) * 5e-6
        speed = speed + 0.1 * ((read - seen) / h - speed)
        seen = read
        # Strokes of half a second with a constant speed in between.
        target = 0.15 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 0.5 * t) * 0.999)
        u = float(np.clip(120 * (target - read) - 6 * speed, -10, 10))
        rows.append(f"{t:.6g},{read:.9g},{u:.9g}")
        level = 14.0 if after == "friction" and t >= JUMP else friction
        pull = -6.0 if after == "force" and t >= JUMP else 0.0
        for _ in range(parts):
            free = v + h / parts * (kf * u - b * v + pull) / m
            step = h / parts * level / m
            v = float(np.sign(free)) * max(abs(free) - step, 0.0)
            x += h / parts * v
    return "\n".join(rows) + "\n"


@pytest.fixture(scope="module")
def logs() -> dict[str, str]:
    return {after: log_of(after) for after in ("", "friction", "force")}


@cache
def belt() -> Machine:
    """The machine, certified once for all tests."""
    return load(BELT)


def pieces(text: str, size: int) -> Iterator[bytes]:
    """As a pipe might deliver it, lines cut anywhere."""
    data = text.encode()
    return (data[k : k + size] for k in range(0, len(data), size))


def test_a_machine_as_declared_stays_silent(logs: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(logs[""])
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv")
    assert done.code == 0 and "no alarm" in done.out and "t = 0 to 3.999 s; the rows ended" in done.out
    seen = watch(belt(), tmp_path / "log.csv")
    assert seen.alarms == () and seen.tally.samples == 4000 and seen.tally.judged > 2000
    assert 0 < seen.tally.worst[0] < 1
    (limit,), (bound,) = seen.limits, belt().outcome.bounds
    assert (limit.bound, limit.steady) == (bound.after[-1][1], bound.steady) and limit.bound > limit.steady
    compared, later = re.search(r"the bound is (\S+) N, the last .*; long after one it is (\S+) N", done.out).groups()
    said = " ".join(stiction("certify", BELT).out.split())
    assert f" {compared} N from {bound.after[-1][0]:.6g} s on (the bound of `stiction watch`)" in said
    assert f"|{bound.name}| <= {later} N long after a reversal" in said


@pytest.mark.parametrize("what", ["friction", "force"])
def test_a_jump_is_said_at_its_time(logs: dict[str, str], what: str, tmp_path: Path) -> None:
    """Both are beyond the bound of 1.65 N; the observer's own lag is a few of its time constants, h·K = 1/30 s."""
    (tmp_path / "log.csv").write_text(logs[what])
    (alarm, *more) = watch(belt(), tmp_path / "log.csv").alarms
    assert JUMP <= alarm.since < JUMP + 0.15
    assert alarm.raised == pytest.approx(alarm.since + 9 * PERIOD)
    assert alarm.where == "friction at guide (x)" and not more
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv")
    assert done.code == 3
    assert done.out.splitlines()[0].startswith(f"t = {alarm.raised:.6g} s: friction at guide (x) is ")
    if what == "friction":
        assert alarm.worst == pytest.approx(5, abs=1.65)


def test_pieces_of_any_size_give_the_same(logs: dict[str, str]) -> None:
    found = [watch(belt(), "-", given=pieces(logs["force"], size)).content for size in (10**7, 4096, 501)]
    assert found[0] == found[1] == found[2] and found[0]["alarms"]


def columns(text: str) -> dict[str, np.ndarray]:
    return dict(zip("txu", np.loadtxt(text.splitlines(), delimiter=",", skiprows=1).T, strict=True))


def write_mcap(path: Path, given: dict[str, np.ndarray]) -> None:
    """As sensor_msgs/JointState with a stamp of today."""
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        schema = writer.register_msgdef(JOINTS, DEFINITIONS[JOINTS])
        for t, x, u in zip(*(given[name].tolist() for name in "txu"), strict=True):
            ns = 1_700_000_000_000_000_000 + round(t * 1e9)
            header = {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": ""}
            message = {"header": header, "name": ["rail"], "position": [x], "velocity": [], "effort": [u]}
            writer.write_message("/joint_states", schema, message, log_time=ns)
        writer.finish()


@pytest.mark.parametrize("ending", [".npz", ".json", ".mcap"])
def test_other_formats_are_watched_as_files(logs: dict[str, str], ending: str, tmp_path: Path) -> None:
    """The same alarm as in the CSV file; MCAP as its reference library writes it."""
    path, names = tmp_path / f"log{ending}", {}
    given = columns(logs["friction"])
    if ending == ".npz":
        np.savez(path, **given)
    elif ending == ".json":
        path.write_text(json.dumps({name: values.tolist() for name, values in given.items()}))
    else:
        pytest.importorskip("mcap_ros2", reason="needs the extra mcap")
        write_mcap(path, given)
        names = {"x": "/joint_states.position[rail]", "u": "/joint_states.effort[rail]"}
    (alarm,) = watch(belt(), path, names).alarms
    (same,) = watch(belt(), "-", given=pieces(logs["friction"], 4096)).alarms
    shift = alarm.raised - same.raised  # stamps of today are no times from zero
    assert alarm.since - same.since == pytest.approx(shift, abs=1e-6)
    assert alarm.worst == pytest.approx(same.worst, rel=1e-4)
    done = stiction("watch", BELT, "--log", path, "--follow")
    assert is_one_message(done) and "--follow" in done.err


def test_a_longer_dwell_is_waited_for(logs: dict[str, str]) -> None:
    (alarm,) = watch(belt(), "-", dwell=0.05, given=pieces(logs["friction"], 4096)).alarms
    assert alarm.raised == pytest.approx(alarm.since + 0.049)
    (same,) = watch(belt(), "-", dwell="50 ms", given=pieces(logs["friction"], 4096)).alarms
    assert same == alarm
    assert watch(belt(), "-", dwell=100, given=pieces(logs["friction"], 4096)).alarms == ()


def test_rows_through_a_pipe_are_said_before_the_pipe_ends(logs: dict[str, str]) -> None:
    """A process of its own; the alarm is read while the writing end is still open, and Ctrl-C ends it with a report."""
    command = [sys.executable, "-u", "-c", "from codegen.app.cli import main; main()"]
    running = subprocess.Popen(
        [*command, "watch", str(BELT), "--log", "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert running.stdin is not None and running.stdout is not None
    running.stdin.write(logs["friction"])
    running.stdin.flush()
    first = running.stdout.readline()
    assert first.startswith("t = 2.") and "friction at guide (x)" in first
    running.send_signal(signal.SIGINT)
    rest, _ = running.communicate()
    assert running.returncode == 3 and "interrupted" in rest and "alarm from t = 2." in rest


def test_a_file_that_grows_is_followed(logs: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = logs["friction"].splitlines(keepends=True)
    path = tmp_path / "log.csv"
    path.write_text("".join(lines[:1000]))
    waits = iter([lines[1000:2500], lines[2500:]])

    def grow(_: float) -> None:
        more = next(waits, None)
        if more is None:
            raise KeyboardInterrupt
        with path.open("a") as stream:
            stream.write("".join(more))

    monkeypatch.setattr("codegen.replay.live.sleep", grow)
    seen = watch(belt(), path, follow=True)
    assert seen.ended == "interrupted" and seen.tally.samples == 4000
    assert seen.content["alarms"] == watch(belt(), path).content["alarms"] != []


def test_columns_are_bound_as_in_any_log(logs: dict[str, str], tmp_path: Path) -> None:
    text = logs["friction"].replace("t,x,u", "time;pos;volt", 1).replace(",", ";")
    (tmp_path / "log.csv").write_text(text)
    named = ["--column", "t=time", "--column", "x=pos", "--column", "u=volt"]
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv", *named, "--json")
    found = json.loads(done.out)
    assert done.code == 3 and found["format"] == "stiction-watch/1" and len(found["alarms"]) == 1
    assert is_one_message(stiction("watch", BELT, "--log", tmp_path / "log.csv"))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "t,x,u\n",
        "t,x,u\n0,0,0\n",
        "t,x\n" + "".join(f"{k / 1000},0\n" for k in range(9)),
        "t,x,u\n" + "".join(f"{k / 500},0,0\n" for k in range(9)),
        "t,x,u\n" + "".join(f"{-k / 1000},0,0\n" for k in range(9)),
        "t,x,u\n" + "".join(f"{k / 1000},0,0\n" for k in range(9)) + "0.009,zero,0\n",
        "t,x,u\n" + "".join(f"{k / 1000},0,0\n" for k in range(9)) + "0.009,0\n",
        "\xff\xfe" * 100,
    ],
)
def test_bad_rows_are_one_message(text: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(text.encode("latin-1"))
    assert is_one_message(stiction("watch", BELT, "--log", tmp_path / "log.csv"))


def test_a_row_that_cannot_be_read_keeps_the_report_and_the_alarm(logs: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(logs["force"] + "4.000,1\n")
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv")
    assert done.code == 3 and "a row could not be read" in done.out and "alarm from t = " in done.out
    (tmp_path / "log.csv").write_text(logs[""] + "3.999,0,0\n")
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv")
    assert done.code == 2 and "compared with the bound: " in done.out and "[LOG008]" in done.err


def test_a_gap_begins_anew_and_a_lost_value_is_held(logs: dict[str, str]) -> None:
    lines = logs[""].splitlines()
    del lines[1500:1600]
    lines[3000] = lines[3000].replace(lines[3000].split(",")[1], "nan")
    seen = watch(belt(), "-", given=pieces("\n".join(lines), 4096))
    assert seen.alarms == () and seen.tally.faults == 1 and seen.tally.samples == 3900


def test_a_machine_without_a_bound_is_refused(tmp_path: Path) -> None:
    text = BELT.read_text("utf-8")
    (tmp_path / "belt.yaml").write_text("".join(line for line in text.splitlines(True) if "v_dot" not in line), "utf-8")
    done = stiction("watch", tmp_path / "belt.yaml", "--log", tmp_path / "log.csv")
    why = load(tmp_path / "belt.yaml").outcome.bounds
    assert is_one_message(done) and f"it says of this one: {why} [SPEC037]" in done.err
    (tmp_path / "fast.yaml").write_text(re.sub(r"K_v: \S+?(?=[,}])", "K_v: 1e7", text), "utf-8")
    done = stiction("watch", tmp_path / "fast.yaml", "--log", tmp_path / "log.csv")
    reason = load(tmp_path / "fast.yaml").outcome.reason
    assert is_one_message(done) and f"it says of this one: {reason[:60]}" in done.err
    assert is_one_message(stiction("watch", BELT, "--log", tmp_path / "absent.csv"))
    assert is_one_message(stiction("watch", BELT, "--log", tmp_path / "absent.csv", "--dwell", "-1"))
    for bad in ("-1", "nan", "inf", "3 kg", "soon", "-2ms"):
        told = stiction("watch", BELT, "--log", tmp_path / "absent.csv", "--dwell", bad)
        assert is_one_message(told) and "--dwell" in told.err and "10ms [CALL001]" in told.err
    told = stiction("watch", BELT, "--log", tmp_path / "absent.csv", "--dwell", "10ms")
    assert is_one_message(told) and "absent.csv" in told.err


def test_a_long_reason_for_no_bound_is_not_cut(tmp_path: Path) -> None:
    text = BELT.read_text("utf-8")
    curve = "effects: [{kind: stribeck, on: guide, parameters: {delta: 2, v_s: 0.03}}]"
    (tmp_path / "curve.yaml").write_text(re.sub(r"(?m)^effects: .*", curve, text), "utf-8")
    why = load(tmp_path / "curve.yaml").outcome.bounds
    done = stiction("watch", tmp_path / "curve.yaml", "--log", tmp_path / "log.csv")
    assert len(why) > 150 and "`stiction laws` lists them" in why
    assert is_one_message(done) and why in done.err


def test_a_machine_that_always_reverses_is_not_called_sound() -> None:
    rows = "t,x,u\n" + "".join(f"{k * PERIOD:.4f},{1e-4 * np.sin(0.3 * k):.9f},0\n" for k in range(1000))
    seen = watch(belt(), "-", given=pieces(rows, 4096))
    assert seen.tally.judged == 0 and "nothing was compared" in seen.text()
    assert "outside the envelope" not in seen.text() and "unit" not in seen.notes[-1]


def test_a_machine_at_rest_is_not_called_sound(tmp_path: Path) -> None:
    rows = "t,x,u\n" + "".join(f"{k * PERIOD:.4f},0,0\n" for k in range(300))
    (tmp_path / "log.csv").write_text(rows)
    done = stiction("watch", BELT, "--log", tmp_path / "log.csv")
    slow = "a contact was too slow for the bound: guide no faster than 0.00655 m/s in 300"
    assert f"nothing was compared: in 300 of 300 samples {slow}" in done.out
    assert done.code == 2 and "log.csv: no sample that can be compared" in done.err and "[LOG015]" in done.err


def test_a_log_in_another_unit_says_that_it_is_outside_the_envelope(logs: dict[str, str], tmp_path: Path) -> None:
    """Positions in mm: speeds of 300 where the envelope has at most 1 m/s, but for the samples about a reversal."""
    head, *rows = logs[""].splitlines()
    split = [row.split(",") for row in rows]
    log = tmp_path / "log.csv"
    log.write_text("\n".join([head, *(f"{t},{1000 * float(x):.9g},{u}" for t, x, u in split)]))
    seen = watch(belt(), log)
    assert seen.tally.judged == 0 and seen.tally.outside > 3000
    (note,) = seen.notes
    assert note.startswith(f"nothing was compared: {seen.tally.outside} of 4000 samples were outside the envelope of v")
    assert "unit or scale" in note and "no contact slid" not in seen.text()
    done = stiction("watch", BELT, "--log", log)
    assert done.code == 2 and f"note: {note}" in done.out and "[LOG015]" in done.err
    assert len(done.err.splitlines()) == 1 and "no alarm" not in done.out
    as_json = stiction("watch", BELT, "--log", log, "--json")
    assert as_json.code == 2 and json.loads(as_json.out)["notes"] == [note] and as_json.err == ""


def rewritten(text: str, way: str) -> bytes:
    """The same log as instruments write it."""
    (_, *names), *rows = (line.split(",") for line in text.split())
    encoding, separator = "utf-8", ","
    if way == "decimal commas":
        separator, rows = ";", [[v.replace(".", ",") for v in row] for row in rows]
    elif way == "windows-1252":
        encoding, names, rows = "cp1252", [*names, "T °C"], [[*row, "1"] for row in rows]
    else:
        start = 1772668798000 if way == "since 1970" else 0
        rows = [[str(start + round(1000 * float(row[0]))), *row[1:]] for row in rows]
    return "\n".join(separator.join(row) for row in [["time", *names], *rows]).encode(encoding)


@pytest.mark.parametrize(
    ("way", "note"),
    [
        ("decimal commas", "the numbers are read with decimal commas"),
        ("windows-1252", "column `time` is t, by its name"),
        ("since 1970", "t is in milliseconds since 1970"),
    ],
)
def test_logs_as_instruments_write_them(logs, way, note):
    plain = watch(belt(), "-", given=iter([logs[""].encode()]))
    data = rewritten(logs[""], way)
    seen = watch(belt(), "-", given=iter([data[k : k + 1000] for k in range(0, len(data), 1000)]))
    assert seen.tally.judged == pytest.approx(plain.tally.judged, abs=2) and seen.tally.judged > 100
    assert np.allclose(seen.tally.worst, plain.tally.worst, rtol=1e-3)
    assert any(note in n for n in seen.notes) and f"note: {seen.notes[0]}" in seen.text()


def test_a_time_in_milliseconds_is_refused(logs):
    with pytest.raises(BadInput) as told:
        watch(belt(), "-", given=iter([rewritten(logs[""], "plain")]))
    assert told.value.code == "LOG008" and "scale: {t: 0.001}" in str(told.value), told.value


def test_the_factor_of_a_time_replaces_a_stated_one(logs, tmp_path):
    """Milliseconds with a stated 0.01: the factor beside it was told, 0.1, as if it came on top."""
    (tmp_path / "meta.yaml").write_text("scale: {t: 0.01}\n")
    (tmp_path / "log.csv").write_bytes(rewritten(logs[""], "plain"))
    with pytest.raises(BadInput) as told:
        watch(belt(), tmp_path / "log.csv", follow=False)
    assert "scale: {t: 0.001}" in str(told.value), told.value


CODED = [(coding, size) for size in (1, 501, 10**7) for coding in ("utf-16-le", "utf-16-be")]


@pytest.mark.parametrize(("coding", "size"), slow_except(CODED, [CODED[0], *CODED[3:5]], several=True))
def test_utf_16_is_read_as_diagnose_does(logs: dict[str, str], coding: str, size: int) -> None:
    """As Excel writes text; pieces are cut within a letter and within the mark."""
    text = "\r\n".join(logs["force"].splitlines()[:2500]) + "\r\n"
    data = ("\N{ZERO WIDTH NO-BREAK SPACE}" + text).encode(coding)
    plain = watch(belt(), "-", given=iter([text.encode()]))
    seen = watch(belt(), "-", given=(data[k : k + size] for k in range(0, len(data), size)))
    assert seen.alarms and seen.notes == ("the file is in UTF-16",)
    assert {**seen.content, "notes": []} == {**plain.content, "notes": []}


def test_utf_16_that_is_none_is_one_message(logs: dict[str, str]) -> None:
    lone = logs[""].encode("utf-16")[:-2] + b"\x00\xd8"
    with pytest.raises(BadInput, match="not text in UTF-16"):
        watch(belt(), "-", given=iter([lone[:100], b"\x00\xdc" * 2]))
    seen = watch(belt(), "-", given=iter([lone]))
    assert seen.fault is not None and "UTF-16" in str(seen.fault)


def test_samples_outside_the_envelope_are_counted_in_one_line() -> None:
    rows = "t,x,u\n" + "".join(f"{k * PERIOD:.4f},{30.0 * k * PERIOD:.9f},0\n" for k in range(200))
    seen = watch(belt(), "-", given=pieces(rows, 4096))
    text = seen.text()
    assert seen.tally.outside and f"outside the envelope, not compared: {seen.tally.outside} samples" in text
    assert text.count("outside the envelope, not compared") == 1


def test_a_bound_that_holds_nowhere_in_the_envelope_is_refused(tmp_path: Path) -> None:
    """It holds above a slip speed that the envelope of velocities never reaches: nothing could be judged."""
    text = BELT.read_text(encoding="utf-8")
    spec = tmp_path / "belt.yaml"
    spec.write_text(text.replace("  v: [-1, 1]\n", "  v: [-1e-6, 1e-6]\n"), encoding="utf-8")
    with refused("SPEC037 envelope: guide 1e-06 m/s"):
        watch(spec, "-", given=iter([b"t,x,u\n0,0,0\n"]))


GANTRY = """\
name: gantry
coordinates: {x: {velocity: v, unit: m}, q: {velocity: r, unit: rad}}
inputs: {u: {unit: N}, w: {unit: N*m}}
parameters: {m: {value: 12, unit: kg}, J: {value: 0.02, unit: kg*m^2}}
mass_matrix: [[m, 0], [0, J]]
force: [u, w]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 15, unit: N}
    - {name: table, law: coulomb, a: 0.4, unit: N*m}
observer: {kind: gcfo, velocity: estimated, gains: {K_F: [200, 0.5], K_v: [90, 90]}, sample_time: 0.001}
envelope: {v: [-1, 1], r: [-60, 60], v_dot: [-5, 5], r_dot: [-90, 90], x_noise: [-5e-6, 5e-6], q_noise: [-0.02, 0.02]}
"""
"""A slide with a rotary table on it, whose encoder is coarse."""


class Steady:
    """In place of an engine: two constant velocities, and the declared levels."""

    def __init__(self, outputs: list[str], v: float, r: float) -> None:
        chosen = {"v_hat": v, "r_hat": r, "a_hat_rail": 15.0, "a_hat_table": 0.4}
        self.estimates = np.array([chosen.get(name, 0.0) for name in outputs])

    def take(self, block: Block) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self.estimates, (len(block.time), 1)), np.zeros(len(block.time), dtype=np.intc)


def test_each_contact_has_its_own_threshold_in_its_own_unit(tmp_path: Path) -> None:
    """The table's, in rad/s, is above every speed of the rail in m/s, and does not count for the rail."""
    (tmp_path / "gantry.yaml").write_text(GANTRY, encoding="utf-8")
    made = derived_from(tmp_path / "gantry.yaml")
    bounds = made.outcome.bounds
    rail, table = bounds[0].slip_speeds
    assert (rail.contact, rail.unit, table.contact, table.unit) == ("rail", "m/s", "table", "rad/s")
    assert rail.threshold < 0.2 < 1 < table.threshold < 30
    assert too_slow(bounds) is None

    def seen(v: float, r: float) -> Watch:
        engine = Steady([name for name, _, _ in made.program.outputs], v, r)
        done = Watch(made.spec, made.observer, made.program, bounds, engine, PERIOD, 10)
        rows = np.zeros((2 * done.settle, len(made.program.inputs)))
        done.take(Block(np.arange(len(rows)) * PERIOD, rows, True))
        return done

    above = 1.001
    fast = seen(above * rail.threshold, -above * table.threshold)
    assert fast.tally.judged == fast.settle - 1 and not fast.tally.slow and fast.uncompared() is None
    for v, r, slow in ((0.999, above, rail), (above, 0.999, table)):
        done = seen(v * rail.threshold, r * table.threshold)
        assert done.tally.judged == 0 and done.tally.slow == done.tally.samples
        told = f"too slow for the bound: {slow.contact} no faster than {slow.threshold:.3g} {slow.unit} in "
        assert (done.uncompared() or "").endswith(f"{told}{done.tally.samples}")


def test_certify_names_each_contact_with_its_unit(tmp_path: Path) -> None:
    (tmp_path / "gantry.yaml").write_text(GANTRY, encoding="utf-8")
    said = stiction("certify", tmp_path / "gantry.yaml").out
    (found,) = re.findall(r"same\s+sign:\s+rail\s+(\S+)\s+m/s,\s+table\s+(\S+)\s+rad/s", said)
    rail, table = map(float, found)
    assert rail < 0.2 < 1 < table
    content = json.loads(stiction("certify", tmp_path / "gantry.yaml", "--json").out)["slip_speeds"]
    assert [(s["contact"], s["unit"]) for s in content] == [("rail", "m/s"), ("table", "rad/s")]
    for slip, shown in zip(content, (rail, table), strict=True):
        assert slip["threshold"] <= shown <= 1.01 * slip["threshold"]


class Prescribed:
    """In place of an engine: estimates that the test chooses, at 0.5 m/s."""

    def __init__(self, outputs: list[str], levels: np.ndarray, first: float = 0.0) -> None:
        self.first = first
        self.estimates = np.zeros((len(levels), len(outputs)))
        self.estimates[:, outputs.index("v_hat")] = 0.5
        self.estimates[:, outputs.index("a_hat_guide")] = levels

    def take(self, block: Block) -> tuple[np.ndarray, np.ndarray]:
        rows = np.round((block.time - self.first) / PERIOD).astype(int)
        return self.estimates[rows], np.zeros(len(rows), dtype=np.intc)


def watched_levels(above: np.ndarray, first: float = 0.0) -> Watch:
    """A watch, with a dwell of 10 samples, over estimates that are ``above`` the declared 9 N, from t = ``first``."""
    made = derived_from(belt())
    engine = Prescribed([name for name, _, _ in made.program.outputs], 9.0 + above, first)
    done = Watch(made.spec, made.observer, made.program, made.outcome.bounds, engine, PERIOD, 10)
    done.take(Block(first + np.arange(len(above)) * PERIOD, np.zeros((len(above), len(made.program.inputs))), True))
    return done


@pytest.mark.parametrize("clears", [False, True])
def test_an_alarm_says_for_which_share_its_estimate_was_outside(clears: bool) -> None:
    """Outside in one of four stretches of 100 samples; 1000 within it, 100 dwell times, pass at the end alone."""
    above = np.zeros(6000 if clears else 4800)
    for start in range(1000, 4800, 400):
        above[start : start + 100] = 3.0
    done = watched_levels(above)
    (alarm,) = done.alarms
    assert alarm.since == pytest.approx(1.0) and alarm.until == pytest.approx(4.699)
    assert alarm.ended == clears and alarm.outside == 1000
    # The last stretch ends before sample 4700; the 1000th one within the bound is sample 5699.
    assert alarm.compared == (4700 if clears else 3800)
    assert alarm.cleared == (pytest.approx(5.699) if clears else None)
    words = "cleared at t = 5.699 s" if clears else "not cleared by the end"
    share = "21.3" if clears else "26.3"
    text = made_report(done)
    assert f"alarm from t = 1 s, {words}: friction at guide (x) was outside its bound for {share} % of the" in text
    assert "last at t = 4.699 s; up to 3 N above the declared law" in text and "to the end" not in text


def made_report(done: Watch) -> str:
    return Watched("belt", done.limits, 0.1, 0.01, done.tally, tuple(done.alarms), "the rows ended").text()


def test_unix_time_stamps_are_printed_to_the_sample() -> None:
    """Expected are the decimals of the stamps themselves: 1.77e+09 s would be the same for every sample of an hour."""
    done = watched_levels(np.where(np.arange(400) >= 200, 3.0, 0.0), first=1_770_000_000.0)
    text = made_report(done)
    assert "t = 1770000000 to 1770000000.399 s" in text and "e+09" not in text
    assert "alarm from t = 1770000000.2 s" in text and "last at t = 1770000000.399 s" in text
    assert alarm_text(done.alarms[0]).startswith("t = 1770000000.209 s: ")
    assert "period" not in done.alarms[0].content
