"""The generated observer over a log: the bits of the Python twin, at compiled speed, in bounded memory."""

from __future__ import annotations

import json
import re
import tracemalloc
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.emit.package import emit_sources, make_header
from codegen.logs import preflight, read_log
from codegen.logs.file_formats import open_stream
from codegen.logs.formats import csv_file
from codegen.observers import observer_of
from codegen.program import build_program
from codegen.replay import log_warnings, samples
from codegen.replay.engine import Engine
from codegen.spec import read_spec
from codegen.spec.schema import CodeChoice
from stiction import replay
from tests.app.command import SPECS, is_one_message, stiction
from tests.expected_errors import refused
from tests.slow_cases import slow_except
from tests.twin import TwinEngine, load_twin

SPEC = SPECS / "two_mass.yaml"
PERIOD = 0.001
NAMES = ("t", "x1", "x2", "w")


def record(count: int, seed: int = 1) -> np.ndarray:
    """(count, 4) t, x1, x2, w of a two-mass machine that moves at random."""
    random = np.random.default_rng(seed)
    walk = np.cumsum(random.normal(size=(count, 3)), axis=0) * [1e-4, 1e-4, 1.0]
    return np.column_stack([np.arange(count) * PERIOD, walk])


def write_csv(path: Path, table: np.ndarray, head: str = ",".join(NAMES)) -> Path:
    lines = [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return path


def write_npy(path: Path, table: np.ndarray) -> Path:
    log = np.empty(len(table), dtype=[(name, "f8") for name in NAMES])
    for k, name in enumerate(NAMES):
        log[name] = table[:, k]
    np.save(path, log)
    return path


def read_csv(path: Path) -> tuple[list[str], np.ndarray]:
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    return head.split(","), np.array([[float(v) for v in row.split(",")] for row in rows])


def by_twin(table: np.ndarray) -> np.ndarray:
    """Estimates of the generated Python, and the fault flag where it has one."""
    spec = read_spec(SPEC)
    program = build_program(observer_of(spec))
    twin = load_twin(emit_sources(program, make_header(spec.path.name, spec.sha256, ""))["__init__.py"], "twin")
    parameters, made, names = twin.Parameters(), twin.Outputs(), [name for name, _, _ in program.outputs]
    flagged = hasattr(made, "fault")
    rows = table[:, 1:].tolist()
    state, result = twin.init(parameters, twin.Inputs(*rows[0])), []
    for row in rows:
        given = (made,) if flagged else ()
        made = twin.step(state, parameters, twin.Inputs(*row), *given)
        result.append([getattr(made, name) for name in names] + ([float(made.fault)] if flagged else []))
    return np.array(result)


ENGINES = [
    *((spec, "double") for spec in ("one_mass", "two_mass", "two_link_arm", "belt_axis", "chain")),
    *((spec, "single") for spec in ("two_link_arm", "one_mass", "two_mass", "belt_axis", "chain")),
]


@pytest.mark.parametrize(("spec", "precision"), slow_except(ENGINES, ENGINES[:6], several=True))
def test_the_compiled_engine_gives_the_bits_of_the_twin(spec: str, precision: str) -> None:
    made = read_spec(SPECS / f"{spec}.yaml")
    program = build_program(observer_of(made), CodeChoice(precision=precision, fault="hold"))
    files = emit_sources(program, make_header(made.path.name, made.sha256, ""))
    rows = np.cumsum(np.random.default_rng(2).normal(size=(6_000, len(program.inputs))), axis=0) * 1e-3
    rows[4000:5000] = rows[4000]
    results = []
    for engine in (Engine(program, files), TwinEngine(program, files)):
        engine.start(rows[0])
        parts = [engine.run(part) for part in np.split(rows, [1, 4097])]
        first, again = (engine.trial_step(rows[:1]) for _ in range(2))
        assert first.tobytes() == again.tobytes()  # it leaves the state as it was
        results.append(b"".join(np.vstack(column).tobytes() for column in ([e for e, _ in parts],)))
    assert results[0] == results[1]


@pytest.mark.parametrize("ending", [".csv", ".npy"])
def test_a_log_in_blocks_gives_the_bits_of_the_twin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    """6000 samples in many blocks, comments and blank lines between the rows."""
    monkeypatch.setattr(csv_file, "BLOCK_BYTES", 5000)
    monkeypatch.setattr("codegen.logs.formats.numpy_file.ROWS", 777)
    table = record(6_000)
    if ending == ".csv":
        log = write_csv(tmp_path / "log.csv", table)
        head, *rows = log.read_text().splitlines()
        rows.insert(5000, "# a remark\n")
        log.write_text("\n".join(["# made by a test", "", head, *rows]))
    else:
        log = write_npy(tmp_path / "log.npy", table)
    result = replay(SPEC, log, tmp_path / "out.csv")
    names, found = read_csv(tmp_path / "out.csv")
    expected = by_twin(table)
    assert names[0] == "t" and found[:, 0].tobytes() == table[:, 0].tobytes()
    assert found[:, 1:].tobytes() == expected.tobytes()
    assert (result.samples, result.starts, result.faults) == (6_000, 1, 0)
    for peak in result.peaks:
        column = found[:, names.index(peak.name)]
        assert abs(peak.value) == np.abs(column).max() and column[round(peak.time / PERIOD)] == peak.value


def test_npy_out_has_the_same_numbers(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", record(3000))
    replay(SPEC, log, tmp_path / "out.csv", only=["F_hat_ground", "v1_hat"])
    replay(SPEC, log, tmp_path / "out.npy", only=["F_hat_ground", "v1_hat"])
    names, table = read_csv(tmp_path / "out.csv")
    assert names[:3] == ["t", "v1_hat", "F_hat_ground"]
    array = np.load(tmp_path / "out.npy")
    assert len(array) == 3000 and all((array[n] == table[:, k]).all() for k, n in enumerate(names))
    again = replay(SPEC, tmp_path / "log.csv", tmp_path / "out.npy", only=["v1_hat"])
    assert again.samples == len(np.load(tmp_path / "out.npy"))


@pytest.mark.parametrize("ending", [".csv", ".npy"])
def test_the_result_gives_the_estimates_by_name(tmp_path: Path, ending: str) -> None:
    """The bits of the twin, whole or in part; a result whose estimates were not kept says how to keep them."""
    table = record(3000)
    log, expected = write_csv(tmp_path / "log.csv", table), by_twin(table)
    replay(SPEC, log, tmp_path / "all.csv")
    names, _ = read_csv(tmp_path / "all.csv")
    found = replay(SPEC, log, tmp_path / f"out{ending}").estimates
    assert list(found) == names and found["t"].tobytes() == table[:, 0].tobytes()
    for k, name in enumerate(names[1:]):
        assert (found[name] == expected[:, k]).all() and len(found[name]) == 3000
    if "fault" in found:
        assert found["fault"].dtype.kind == "i"
    for values in found.values():  # the result keeps them
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1
    part, lost = (replay(SPEC, log, tmp_path / f"{name}{ending}", only=["v1_hat"]) for name in ("part", "lost"))
    assert "F_hat_ground" not in part.estimates and (part.estimates["v1_hat"] == found["v1_hat"]).all()
    for one in (part, lost):
        assert one.path is not None
        one.path.unlink()
    assert (part.estimates["v1_hat"] == found["v1_hat"]).all()  # read once: each access read the file again
    with pytest.raises(BadInput, match=f"lost{ending}"):
        _ = lost.estimates
    with pytest.raises(BadInput, match="`out`"):
        _ = replay(SPEC, log).estimates


def test_without_a_compiler_nothing_is_replayed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = write_csv(tmp_path / "log.csv", record(500))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "none"))
    with refused("TOOL001 gcc"):
        replay(SPEC, log, tmp_path / "b.csv")
    assert not (tmp_path / "b.csv").exists()


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_a_doubtful_unit_is_noted_once(tmp_path: Path, jitter: float) -> None:
    table = record(400)
    table[:, 0] += jitter * PERIOD * np.random.default_rng(3).random(400)
    log = write_csv(tmp_path / "log.csv", table)
    log.write_text(log.read_text().replace("x1", "pos_counts", 1))
    notes = replay(SPEC, log, columns={"x1": "pos_counts"}).notes
    assert sum("holds counts by its name" in note for note in notes) == 1


def test_a_note_on_the_bytes_of_a_log_is_given_once(tmp_path: Path) -> None:
    """The file is opened for its header and again for its rows."""
    log = write_csv(tmp_path / "log.csv", record(400))
    log.write_text(log.read_text(), encoding="utf-16")
    assert replay(SPEC, log).notes == ("the file is in UTF-16",)


def test_what_is_left_out_of_rows_that_are_read_in_blocks_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lines of text and a second header in later blocks, as a firmware prints them between its rows."""
    log = write_csv(tmp_path / "log.csv", record(400))
    head, *rows = log.read_text(encoding="utf-8").splitlines()
    log.write_text(
        "\n".join([head, *rows[:200], "WARN: hot", *rows[200:300], head, *rows[300:]]) + "\n", encoding="utf-8"
    )
    monkeypatch.setattr(csv_file, "BLOCK_BYTES", 4000)
    found = replay(SPEC, log)
    assert (found.samples, found.starts) == (400, 1)
    assert found.notes == (
        "line 202 is text, and not read (`WARN: hot`)",
        "line 303 repeats the header and is left out",
    )


def test_jitter_goes_through_the_log_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Found in a late block, when estimates of the first ones are written already."""
    monkeypatch.setattr(csv_file, "BLOCK_BYTES", 5000)
    table = record(4000)
    table[3000:, 0] += 0.3 * PERIOD * np.random.default_rng(3).random(1000)
    result = replay(SPEC, write_csv(tmp_path / "log.csv", table), tmp_path / "out.csv")
    assert any("irregular time stamps" in note for note in result.notes)
    _, found = read_csv(tmp_path / "out.csv")
    assert np.allclose(np.diff(found[:, 0]), PERIOD, rtol=1e-6) and len(found) == result.samples


def test_after_a_gap_the_observer_begins_anew(tmp_path: Path) -> None:
    table = record(4000)
    table[2000:, 0] += 0.1
    result = replay(SPEC, write_csv(tmp_path / "log.csv", table), tmp_path / "out.csv")
    assert result.starts == 2 and abs(result.samples - 4000) <= 2
    _, found = read_csv(tmp_path / "out.csv")
    after = found[:, 0] > 2.05
    assert found[after][0, 0] == pytest.approx(table[2000, 0], abs=PERIOD)
    assert np.diff(found[:, 0]).max() == pytest.approx(0.1, abs=2 * PERIOD)
    levels = found[after][0, 3:5]
    assert levels.tolist() == [10.0, 20.0]  # a_hat of a fresh observer at rest is the spec's


def test_a_gap_and_a_lost_sample_in_one_log(tmp_path: Path) -> None:
    """Each is taken for what it is: rows as they stand, a fault for the one, a fresh start for the other."""
    table = record(4000)
    table[1000, 1] = np.nan
    table[2000:, 0] += 0.1
    result = replay(SPEC, write_csv(tmp_path / "log.csv", table), tmp_path / "out.csv")
    names, found = read_csv(tmp_path / "out.csv")
    assert result.starts == 2 and result.faults == 1 and len(found) == 4000
    assert found[:, names.index("fault")].nonzero()[0].tolist() == [1000]
    assert found[:2000, 1:].tobytes() == by_twin(table[:2000]).tobytes()
    assert found[2000:, 1:].tobytes() == by_twin(table[2000:]).tobytes()


def test_what_it_writes_is_read_by_everybody(tmp_path: Path) -> None:
    """numpy, and our own reader, take the names from the first line, as of a simulated log."""
    out = tmp_path / "out.csv"
    replay(SPEC, write_csv(tmp_path / "log.csv", record(500)), out)
    table = np.genfromtxt(out, delimiter=",", names=True)
    assert table.dtype.names[:3] == ("t", "v1_hat", "v2_hat") and len(table) == 500
    names, rows = read_csv(out)
    assert open_stream(out).names == tuple(names)
    assert np.array_equal(table["F_hat_ground"], rows[:, names.index("F_hat_ground")])


@pytest.mark.parametrize("times", [2, 10])
def test_another_sample_time_is_refused(tmp_path: Path, times: int) -> None:
    table = record(1000)
    table[:, 0] *= times
    log = write_csv(tmp_path / "log.csv", table)
    done = stiction("replay", SPEC, log, "-o", tmp_path / "out.csv")
    assert is_one_message(done)
    assert f"every {0.001 * times:g} s" in done.err
    assert f"`sample_time: {0.001 * times:g}` in the spec" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["log.csv"]


@pytest.mark.parametrize(
    ("times", "described", "scale"),
    [(1e3, "", "0.001"), (1e6, "", "1e-06"), (1 / 60, "", "60"), (1.0, "scale: {t: 0.001}\n", "1")],
)
def test_time_in_another_unit_is_told_with_its_factor(tmp_path: Path, times: float, described: str, scale: str) -> None:
    table = record(1000)
    table[:, 0] *= times
    log = write_csv(tmp_path / "log.csv", table)
    if described:
        (tmp_path / "meta.yaml").write_text(described)
    done = stiction("replay", SPEC, log)
    assert is_one_message(done) and "[LOG013]" in done.err and f"`scale: {{t: {scale}}}`" in done.err


@pytest.mark.parametrize("scale", ["0.001", "60"])
def test_the_scale_that_is_asked_for_gives_the_same_estimates(tmp_path: Path, scale: str) -> None:
    table = record(1000)
    plain = replay(SPEC, write_csv(tmp_path / "plain.csv", table))
    table[:, 0] /= float(scale)
    log = write_csv(tmp_path / "log.csv", table)
    (tmp_path / "meta.yaml").write_text(f"scale: {{t: {scale}}}\n")
    assert [p.value for p in replay(SPEC, log).peaks] == [p.value for p in plain.peaks]


def test_an_input_in_a_file_beside_the_log_is_replayed(tmp_path: Path) -> None:
    """A diagnosis read such logs; a replay asked the first file alone for all columns."""
    table = record(3000)
    plain = replay(SPEC, write_csv(tmp_path / "plain.csv", table))
    (tmp_path / "apart").mkdir()
    log = write_csv(tmp_path / "apart" / "log.csv", table[:, :3], "t,x1,x2")
    np.savetxt(tmp_path / "apart" / "force.csv", table[:, 3:], fmt="%.17g", header="w")
    (tmp_path / "apart" / "meta.yaml").write_text("beside: {force: force.csv}\ncolumns: {w: force.w}\n")
    apart = replay(SPEC, log)
    assert apart.samples == plain.samples == 3000
    assert [p.value for p in apart.peaks] == pytest.approx([p.value for p in plain.peaks], rel=1e-12)


@pytest.mark.parametrize(("bad", "faults"), [(500, [500]), (0, [0, 1])])
def test_a_value_that_is_not_finite_is_held_over_or_refused(tmp_path: Path, bad: int, faults: list[int]) -> None:
    """Where it is the first, the good sample behind it starts the observer."""
    table = record(1000)
    table[bad, 1] = np.nan
    log = write_csv(tmp_path / "log.csv", table)
    spec = read_spec(SPEC)
    program = build_program(observer_of(spec))
    if TwinEngine(program, emit_sources(program, make_header("a", "b", ""))).holds:
        result = replay(SPEC, log, tmp_path / "out.csv")
        names, found = read_csv(tmp_path / "out.csv")
        assert result.faults == len(faults) and found[:, names.index("fault")].nonzero()[0].tolist() == faults
        assert found[:, 1:].tobytes() == by_twin(table).tobytes()
    else:
        with pytest.raises(BadInput, match=rf"log\.csv:{bad + 2}: x1: .* not finite"):
            replay(SPEC, log)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--only", "F_hat_groun"], "F_hat_ground"),
        (["-o", "out.xlsx"], ".csv or .npy"),
        (["-o", "log.csv"], "the log itself"),
        (["--column", "x1=z"], "no column `z`"),
    ],
)
def test_bad_arguments_are_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_csv(tmp_path / "log.csv", record(300))
    done = stiction("replay", SPEC, "log.csv", *arguments)
    assert is_one_message(done) and said in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["log.csv"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "an empty file"),
        (b"t,x1,x2,w\n", "a header and no rows"),
        (b"t,x1,x2,w\n0,0,0,0\n0.001,0,zero,0\n", "log.csv:3: x2: `zero`"),
        (b"t,x1,x2,w\n0,0,0,0\n0.001,0,0\n", "3 values in the row"),
        (b"t,x1,x2,w\n0,0,0,0\n\x81\xfe0.001,0,0,0\n", "is not UTF-8"),
        (b"t,x1,x2,w\n0,0,0,0\n\xff\xfe0.001,0,0,0\n", "`ÿþ0.001`"),
        (b"t,x1,x2,w\n0,0,0,0\n\0\n", "byte 18 is zero"),
        (b"t,x1,x2,w\n0,0,0,0\n-0.001,0,0,0\n", "time runs backwards"),
    ],
)
def test_bad_logs_are_one_message(tmp_path: Path, content: bytes, said: str) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(content)
    done = stiction("replay", SPEC, log, "-o", tmp_path / "out.csv")
    assert is_one_message(done) and said in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["log.csv"]


def test_an_empty_file_of_any_ending_is_called_empty(tmp_path: Path) -> None:
    """An empty .dat was said to have the wrong ending."""
    log = tmp_path / "log.dat"
    log.write_bytes(b"")
    done = stiction("replay", SPEC, log)
    assert is_one_message(done) and "an empty file" in done.err


def test_bad_npy_logs_are_one_message(tmp_path: Path) -> None:
    np.save(tmp_path / "plain.npy", np.zeros((3, 4)))
    np.save(tmp_path / "text.npy", np.array([("a", 1.0)], dtype=[("t", "U1"), ("x1", "f8")]))
    (tmp_path / "cut.npy").write_bytes(b"\x93NUMPY\x01")
    for name in ("plain", "text", "cut", "none"):
        assert is_one_message(stiction("replay", SPEC, tmp_path / f"{name}.npy"))


def test_memory_does_not_grow_with_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "BLOCK_BYTES", 1 << 16)
    monkeypatch.setattr(samples, "ROWS", 1000)
    monkeypatch.setattr(log_warnings, "MOST_BYTES", 1 << 16)
    replay(SPEC, write_csv(tmp_path / "first.csv", record(1_500)), tmp_path / "out.csv")  # what stays is made
    peaks = []
    for count in (3_000, 15_000):
        log = write_csv(tmp_path / f"{count}.csv", record(count))
        tracemalloc.start()
        replay(SPEC, log, tmp_path / "out.csv")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


def axis_log(path: Path, gain: float = 1.0, scale: float = 1.0, exchanged: bool = False) -> Path:
    """Of `one_mass`: 1 kg and 50 N of friction pushed along 0.1 (1 - cos 2t) m for 6 s, from rest; the exact input."""
    t = np.arange(6000) * PERIOD
    x, v, a = 0.1 * (1 - np.cos(2 * t)), 0.2 * np.sin(2 * t), 0.4 * np.cos(2 * t)
    columns = [scale * x, gain * (a + 50 * np.sign(v))]
    return write_csv(path, np.column_stack([t, *(columns[::-1] if exchanged else columns)]), "t,x,w")


@pytest.mark.parametrize("jitter", [0.0, 2e-4])
def test_a_measured_velocity_that_is_missing_is_told_with_the_columns(tmp_path: Path, jitter: float) -> None:
    """Rows as they are, and resampled ones: the message said neither which columns there are nor how to name one."""
    text = (SPECS / "one_mass.yaml").read_text().replace("velocity: estimated", "velocity: measured")
    (tmp_path / "s.yaml").write_text(text.replace("gains: {K_F: 10, K_v: 100}", "gains: {K_F: 10}"))
    time = np.arange(5000) * 1e-3
    time[1::2] += jitter
    lines = [f"{t:.4f},{0.1 * np.sin(t):.6f},{0.1 * np.cos(t):.6f},1" for t in time]
    (tmp_path / "a.csv").write_text("\n".join(["t,x,slider_speed,w", *lines]) + "\n")
    with pytest.raises(BadInput) as told:
        replay(tmp_path / "s.yaml", tmp_path / "a.csv")
    assert told.value.code == "LOG003" and "no column `v`" in told.value.found
    assert 'columns={"v": "..."}' in told.value.expected and "slider_speed" in told.value.expected


def test_a_log_that_fits_the_spec_warns_of_nothing(tmp_path: Path) -> None:
    done = stiction("replay", SPECS / "one_mass.yaml", axis_log(tmp_path / "log.csv"))
    assert done.code == 0 and "warning" not in done.out
    assert replay(SPECS / "one_mass.yaml", tmp_path / "log.csv").content["warnings"] == ()


@pytest.mark.parametrize(
    ("wrong", "times"),
    [({"gain": 1000.0}, 1000), ({"scale": 1000.0}, 0), ({"scale": 1e5}, 0), ({"exchanged": True}, 0)],
    ids=["mA", "mm", "um", "exchanged"],
)
def test_friction_far_above_the_declared_is_warned_of(tmp_path: Path, wrong: dict[str, float], times: float) -> None:
    """Of an input a thousand times too large the estimate is a thousand times the 50 N, and the acceleration little."""
    log = axis_log(tmp_path / "log.csv", **wrong)
    result = replay(SPECS / "one_mass.yaml", log)
    largest = abs(result.peaks[0].value)
    (line,) = [line for line in result.warnings if "F_hat" in line] or [""]
    assert (line != "") == (largest > 10 * 50)
    assert not times or largest / 50 == pytest.approx(times, rel=0.1)
    if line:
        told = f"|F_hat_rail| reaches {largest / 50:.4g} times the largest friction that the spec declares"
        assert line.startswith(told) and ", 50 N: check units" in line
        assert f"warning: {line}\n" in stiction("replay", SPECS / "one_mass.yaml", log).out


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"gain": -1.0}, "The sign of input w seems flipped"),
        ({"gain": 0.001}, "Is w in kN?"),
        ({"scale": 1000.0}, "The scale of x seems off"),
        ({"exchanged": True}, "The columns of "),
    ],
    ids=["sign", "kN", "mm", "exchanged"],
)
def test_what_a_diagnosis_would_say_of_signs_and_scales_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wrong: dict[str, float], words: str
) -> None:
    """A flipped current was replayed without a word; of a large log nothing is said."""
    log, spec = axis_log(tmp_path / "log.csv", **wrong), read_spec(SPECS / "one_mass.yaml")
    problems = [f.words for f in preflight(read_log(log, spec), spec) if f.severity == "problem"]
    result = replay(SPECS / "one_mass.yaml", log)
    assert [line for line in result.warnings if line in problems] == problems and words in " ".join(problems)
    assert f"warning: {problems[0]}\n" in stiction("replay", SPECS / "one_mass.yaml", log).out
    monkeypatch.setattr(log_warnings, "MOST_BYTES", 100)
    assert not [line for line in replay(SPECS / "one_mass.yaml", log).warnings if line in problems]


def test_an_input_without_its_sign_is_warned_of(tmp_path: Path) -> None:
    """The preflight calls it a warning, since a weight that the spec lacks looks alike; a replay passed it over."""
    t = np.arange(6000) * PERIOD
    size = np.abs(0.4 * np.cos(2 * t) + 50 * np.sign(np.sin(2 * t)))
    write_csv(tmp_path / "log.csv", np.column_stack([t, -0.1 * np.cos(2 * t), size]), "t,x,w")
    result = replay(SPECS / "one_mass.yaml", tmp_path / "log.csv")
    assert [line for line in result.warnings if "never negative" in line and "magnitude without its sign" in line]


def test_a_unit_of_another_dimension_is_told_once(tmp_path: Path) -> None:
    """It was a note and a warning too."""
    log = tmp_path / "log.csv"
    axis_log(log).write_text(log.read_text().replace("t,x,w", "t [s],x [deg],w [N]", 1))
    told = stiction("replay", SPECS / "one_mass.yaml", log).out
    (line,) = [line for line in told.splitlines() if "in `deg`" in line]
    assert line.startswith("warning: ") and "no unit that can be converted to m" in line


@pytest.mark.parametrize("seconds", [12, 39])
def test_an_encoder_that_wraps_is_warned_of_with_the_key_that_unwraps_it(tmp_path: Path, seconds: int) -> None:
    """Only a speed outside the envelope was warned of. The axis moves on at 0.3 m/s, with a ripple; it wraps at 1 m."""
    t = np.arange(0, seconds, PERIOD)
    x = (0.3 * t + 0.02 * np.sin(2 * t)) % 1.0
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, x, 50 - 0.08 * np.sin(2 * t)]), "t,x,w")
    result = replay(SPECS / "one_mass.yaml", log)
    cause, *symptoms = result.warnings
    assert re.match(rf"x jumps by (1|0\.999\d*) m {int(0.3 * seconds)} times", cause) and "`unwrap: {" in cause
    assert not [line for line in symptoms if "unwrap" in line or "seems" in line]
    (tmp_path / "meta.yaml").write_text("unwrap: {x: 1}\n")
    assert not [line for line in replay(SPECS / "one_mass.yaml", log).warnings if "unwrap" in line]


def test_a_position_at_a_slower_rate_is_warned_of_with_its_column(tmp_path: Path) -> None:
    """Three of four samples are invalid then: the estimates are mostly held, which a count alone does not explain."""
    lines = axis_log(tmp_path / "log.csv").read_text("utf-8").splitlines()
    at = lines[0].split(",").index("x")
    for k, line in enumerate(lines[1:]):
        fields = line.split(",")
        fields[at] = fields[at] if k % 4 == 0 else ""
        lines[k + 1] = ",".join(fields)
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n", "utf-8")
    result = replay(SPECS / "one_mass.yaml", tmp_path / "log.csv")
    assert result.faults > 0.7 * result.samples
    assert any("samples were invalid" in w and "`missing: join`" in w and ":3:" in w for w in result.warnings), (
        result.warnings
    )


def test_a_replay_outlives_forces_that_cannot_be_computed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(log_warnings, "column_problems", fails)
    assert replay(SPECS / "one_mass.yaml", axis_log(tmp_path / "log.csv", gain=-1.0)).samples == 6000


def test_a_replay_outlives_declared_friction_beyond_a_double(tmp_path: Path) -> None:
    """1e20 N s/m at 1e299 m/s: an OverflowError ended it."""
    text = (SPECS / "one_mass.yaml").read_text(encoding="utf-8")
    text = text.replace("law: coulomb, a: 50", "law: static_viscous, F_c: 50, F_s: 60, F_v: 1e20")
    (tmp_path / "s.yaml").write_text(text.replace("  v: [-5, 5]", "  v: [-1e299, 1e299]"), encoding="utf-8")
    log = write_csv(tmp_path / "log.csv", record(300)[:, [0, 1, 3]], "t,x,w")
    result = stiction("replay", tmp_path / "s.yaml", log, "-o", tmp_path / "out.csv")
    assert result.code == 0 and not result.err, result.err
    assert len(read_csv(tmp_path / "out.csv")[1]) == 300


def test_a_signal_outside_the_envelope_is_warned_of_with_its_share(tmp_path: Path) -> None:
    """Positions in mm: the speed is 200 |sin 2t|, of which the envelope has 5; of the input it has less than 50.2 N."""
    spec = tmp_path / "spec.yaml"
    text = (SPECS / "one_mass.yaml").read_text(encoding="utf-8")
    spec.write_text(text.replace("envelope: ", "envelope:\n  w: [-60, 50.2] #"), encoding="utf-8")
    log = axis_log(tmp_path / "log.csv", scale=1000.0)
    out = stiction("replay", spec, log, "--json")
    t = np.arange(6000) * PERIOD
    found = {line.split()[0]: line for line in json.loads(out.out)["warnings"] if "the spec's envelope [" in line}
    assert set(found) == {"w", "v_hat"}
    expected = {
        "w": np.mean(0.4 * np.cos(2 * t) + 50 * np.sign(np.sin(2 * t)) > 50.2),
        "v_hat": np.mean(np.abs(200 * np.sin(2 * t)) > 5),
    }
    for name, line in found.items():
        share = float(line.split(" for ")[1].split("%")[0]) / 100
        assert share == pytest.approx(expected[name], abs=0.0006 if name == "w" else 0.01)
    assert "[-60, 50.2]" in found["w"] and "[-5, 5]" in found["v_hat"]


def test_unix_time_stamps_are_printed_to_the_sample(tmp_path: Path) -> None:
    """Expected is the time that the result holds, as a decimal to the sample."""
    table = record(400)
    table[:, 0] += 1_770_000_012.0
    result = replay(SPEC, write_csv(tmp_path / "log.csv", table))
    at = [Decimal(repr(p.time)) - 1_770_000_012 for p in result.peaks]
    said = [Decimal(word) - 1_770_000_012 for word in re.findall(r"at t = (\S+) s", result.text())]
    assert said and all(abs(a - b) < Decimal(repr(PERIOD)) / 2 for a, b in zip(said, at, strict=True))
    assert "e+09" not in result.text()
