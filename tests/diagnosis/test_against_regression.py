"""An effect that only imitates a vibration in time is refused by a regression that knows no law."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.evidence.residual_regression import remainders
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict import against_regression as regression
from codegen.diagnosis.verdict.against_regression import (
    ForceEvidence,
    OtherCause,
    against_regression,
    changes_beside,
    force_evidence,
)
from codegen.logs import Log, read_log
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

MOTION = "0.12*sin(2*pi*0.23*t) + 0.08*sin(2*pi*0.371*t + 1) + 0.05*sin(2*pi*0.617*t + 2) + 0.03*sin(2*pi*1.13*t)"
COGGING = "[{kind: cogging, on: x, parameters: {amplitude: 0.8, period: 0.05, phase: 0.3}}]"
HZ = 2.7


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return log_of(stage(reference=MOTION, duration=20.0), tmp_path_factory.mktemp("log"), "plain.csv")


def shaken(log: Log) -> Log:
    """The log of a machine that something else pushes to and fro; no column of the log holds this force."""
    inputs = log.inputs.copy()
    inputs[:, 0] -= 1.5 * np.sin(2 * np.pi * HZ * log.sample_time * np.arange(log.size))
    return replace(log, inputs=inputs)


def best_cogging(problem: Problem) -> FoundEffect:
    """The single sine over position that removes most of the force residual, by least squares over many periods."""
    system, motion = problem.system, problem.motion
    used = problem.used[:, 0]
    r = inverse_dynamics_residual(system, motion)[:, 0]
    best: tuple[float, float, np.ndarray[Any, Any]] = (np.inf, 0.0, np.zeros(2))
    for period in np.geomspace(0.02, 0.2, 240):
        turn = 2 * np.pi * motion.positions[:, 0] / period
        waves = motion.low_pass(np.column_stack([np.sin(turn), np.cos(turn)]))
        weights = np.linalg.lstsq(waves[used], -r[used], rcond=None)[0]  # the residual lacks the force
        left = float(np.sum((r + waves @ weights)[used] ** 2))
        best = min(best, (left, float(period), weights), key=lambda found: found[0])
    _, period, (sine, cosine) = best
    values = {"amplitude": float(np.hypot(sine, cosine)), "period": period, "phase": float(np.arctan2(cosine, sine))}
    return FoundEffect("cogging", "x", values, {}, (), {})


def judged(log: Log) -> tuple[str, Problem, FoundEffect]:
    spec = stage(reference=MOTION)
    system = system_of(spec)
    problem = Problem(system, smooth_motion(log), {})
    found = best_cogging(problem)
    far = SimpleNamespace(by_segment=np.array([1e6]), residual=np.zeros((1, 40)))
    words = against_regression(far, problem, system, with_effects(system, (found,)), (found,))  # type: ignore[arg-type]
    return words, problem, found


def test_a_sine_over_position_does_not_stand_for_a_vibration(plain: Log) -> None:
    words, problem, found = judged(shaken(plain))
    assert "vibration" in words and f"{HZ} Hz" in words
    system = problem.system
    one = force_evidence(problem, system, with_effects(system, (found,)), ["cogging"], [0])[0]
    assert one.vibration.alone > 0.9
    assert one.vibration.both - one.vibration.alone < 0.02


def test_cogging_is_not_refused_with_a_vibration_beside_it(tmp_path: Path) -> None:
    cogging = log_of(stage(COGGING, reference=MOTION, duration=20.0), tmp_path, "cogging.csv")
    for log in (cogging, shaken(cogging)):
        words, _, found = judged(log)
        assert found.parameters["period"] == pytest.approx(0.05, rel=0.02)
        assert words == ""


@pytest.mark.parametrize("noise", [160.0, 2.7])
def test_a_lag_does_not_stand_for_a_vibration_that_the_loop_answers(noise: float, tmp_path: Path) -> None:
    """A force of 7 Hz in no column, and a loop that works against it: the input has the same line, and a lag of it
    makes two thirds of the force, which was more than the half that was asked for. It is refused however many times
    the ``noise`` the free runs leave.
    """
    text = stage(reference=MOTION, duration=20.0).text
    for old, new in (
        ("  w: {unit: N}\n", "  w: {unit: N}\n  d: {unit: N}\n"),
        ("force: [w - b*v]", "force: [w + d - b*v]"),
        ("  reference:", '  inputs: {d: "1.5*sin(2*pi*7*t)"}\n  reference:'),
        ("w: 900", "w: 2500"),
        ("w: 30", "w: 60"),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    plant = parse_spec(text, Path("shaken.yaml"))
    write_log(tmp_path / "shaken.csv", plant, simulate(plant, system_of(plant)))
    problem = Problem(system_of(stage()), smooth_motion(read_log(tmp_path / "shaken.csv", stage())), {})
    lag = FoundEffect("actuator_lag", "w", {"tau": 0.01}, {}, (), {})
    lagged = with_effects(problem.system, (lag,))
    one = force_evidence(problem, problem.system, lagged, ["actuator_lag"], [0])[0]
    assert one.vibration.by_law > 0.6 and one.vibration.alone > 0.99
    left = SimpleNamespace(by_segment=np.array([40 * noise**2]), residual=np.zeros((1, 40)))
    words = against_regression(left, problem, problem.system, lagged, (lag,))  # type: ignore[arg-type]
    assert "a vibration of constant frequency, 7 Hz" in words


@pytest.mark.parametrize("noise", [160.0, 2.7])
@pytest.mark.parametrize("grows", [False, True])
def test_a_constant_force_does_not_stand_for_one_that_grows(plain: Log, grows: bool, noise: float) -> None:
    """A force that rises from 0 to 3 N over the log is no offset of 1.5 N; a constant 1.5 N is one."""
    inputs, rise = plain.inputs.copy(), np.linspace(0, 1, plain.size)
    inputs[:, 0] -= 3 * rise if grows else 1.5
    system = system_of(stage(reference=MOTION))
    problem = Problem(system, smooth_motion(replace(plain, inputs=inputs)), {})
    offset = FoundEffect("offset", "x", {"f0": 1.5}, {}, (), {})
    left = SimpleNamespace(by_segment=np.array([40 * noise**2]), residual=np.zeros((1, 40)))
    words = against_regression(left, problem, system, with_effects(system, (offset,)), (offset,))  # type: ignore[arg-type]
    assert ("a slow change in time" in words) == grows and bool(words) == grows


@pytest.mark.parametrize("force", [0.0, 1.0])
def test_the_constant_of_a_regression_does_not_stand_for_an_offset(plain: Log, force: float) -> None:
    """Beside a vibration an offset was refused: the constant of the vibration's regression explained it."""
    log = shaken(plain)
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(replace(log, inputs=log.inputs - force)), {})
    offset = FoundEffect("offset", "x", {"f0": 1.0}, {}, (), {})
    augmented = with_effects(problem.system, (offset,))
    far = SimpleNamespace(by_segment=np.array([1e6]), residual=np.zeros((1, 40)))
    words = against_regression(far, problem, problem.system, augmented, (offset,))  # type: ignore[arg-type]
    assert bool(words) == (force == 0)
    one = force_evidence(problem, problem.system, augmented, ["offset"], [0])[0]
    assert one.vibration.alone == pytest.approx(1.5**2 / 2 / (1.5**2 / 2 + force**2), abs=0.05)


@pytest.mark.parametrize("noise", [160.0, 2.7])
@pytest.mark.parametrize("true", [False, True])
def test_a_limit_does_not_stand_for_a_drive_that_weakens_with_its_force(plain: Log, true: bool, noise: float) -> None:
    """A limit of the input that leaves twice the squared force is refused however many times the noise free runs leave.

    Of a ball screw with a Stribeck curve free runs, which end at the noise except about stops, preferred a limit by
    which the force residual rose from 4.4 to 6.6 % of the drive force. A true dead zone is not refused.
    """
    w = plain.inputs
    most = float(np.abs(w).max())
    logged = w + 0.1 * most * np.sign(w) if true else w + 0.1 * w * np.abs(w) / most
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(replace(plain, inputs=logged)), {})
    values = ("dead_zone", {"width": 0.1 * most}) if true else ("saturation", {"limit": 0.5 * most})
    found = FoundEffect(values[0], "w", values[1], {}, (), {})
    augmented = with_effects(problem.system, (found,))
    one = force_evidence(problem, problem.system, augmented, [found.kind], [0])[0]
    assert one.own > 0.5 and (one.removed > 0.9 if true else one.removed < -0.5)
    left = SimpleNamespace(by_segment=np.array([40 * noise**2]), residual=np.zeros((1, 40)))
    words = against_regression(left, problem, problem.system, augmented, (found,))  # type: ignore[arg-type]
    assert ("a smooth curve over its own variable" in words) != true and bool(words) != true


@pytest.mark.parametrize("throughout", [False, True])
def test_a_constant_force_does_not_stand_for_one_in_some_intervals(plain: Log, throughout: bool) -> None:
    """3 N in two intervals are no offset of 1.7 N; a constant 1.7 N with a push of 0.5 N in one of them is one."""
    time, inputs = plain.sample_time * np.arange(plain.size), plain.inputs.copy()
    first, second = ((time > a) & (time < b) for a, b in ((2, 8), (11, 15.5)))
    inputs[:, 0] -= 1.7 + 0.5 * first if throughout else 3.0 * (first | second)
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(replace(plain, inputs=inputs)), {})
    system, offset = problem.system, FoundEffect("offset", "x", {"f0": 1.7}, {}, (), {})
    answer = SimpleNamespace(refit=system, augmented=with_effects(system, (offset,)), effects=(offset,))
    left = remainders(answer.augmented, problem.motion, problem.used)
    assert left[0].is_mostly_in_time(problem.material)
    words = changes_beside(problem, answer, left, problem.material)  # type: ignore[arg-type]
    assert ("changes in time" in words) != throughout and bool(words) != throughout


def test_an_effect_is_named_beside_a_single_push(plain: Log) -> None:
    """Beside 10 N in one of 20 seconds a true offset of 1.7 N is named: the push has 0.9 of its RMS."""
    time, inputs = plain.sample_time * np.arange(plain.size), plain.inputs.copy()
    since = time - 9.0
    inputs[:, 0] -= 1.7 + 10.0 * np.where((since > 0) & (since < 1), np.sin(np.pi * since), 0.0)
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(replace(plain, inputs=inputs)), {})
    system, offset = problem.system, FoundEffect("offset", "x", {"f0": 1.7}, {}, (), {})
    answer = SimpleNamespace(refit=system, augmented=with_effects(system, (offset,)), effects=(offset,))
    left = remainders(answer.augmented, problem.motion, problem.used)
    assert left[0].is_mostly_in_time(problem.material)
    assert not changes_beside(problem, answer, left, problem.material)  # type: ignore[arg-type]


@pytest.mark.parametrize(("other", "refused"), [(1.2, True), (6.0, False)])
def test_an_effect_is_named_beside_a_larger_force_in_some_intervals(plain: Log, other: float, refused: bool) -> None:
    """Beside a true offset of 2 N a force in four of ten intervals: of 0.3 times its RMS an objection, of 1.5 none."""
    time, inputs = plain.sample_time * np.arange(plain.size), plain.inputs.copy()
    inputs[:, 0] -= 2.0 + other * np.isin((time // 2.0).astype(int), (1, 4, 5, 8))
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(replace(plain, inputs=inputs)), {})
    system, offset = problem.system, FoundEffect("offset", "x", {"f0": 2.0}, {}, (), {})
    answer = SimpleNamespace(refit=system, augmented=with_effects(system, (offset,)), effects=(offset,))
    left = remainders(answer.augmented, problem.motion, problem.used)
    assert left[0].is_mostly_in_time(problem.material)
    assert bool(changes_beside(problem, answer, left, problem.material)) is refused  # type: ignore[arg-type]


@pytest.mark.parametrize(("removed", "refused"), [(-0.77, True), (0.04, False)])
def test_near_the_noise_a_curve_refuses_only_an_effect_that_increases_the_residual_force(
    plain: Log, removed: float, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A true limit of a voltage removed 4 % of the squared residual force, and a curve over the voltage 16 %."""
    nothing = OtherCause("nothing", 0.0, 0.0, 0.0)
    one = ForceEvidence(removed, 0.5, 0.03, nothing, nothing)
    monkeypatch.setattr(regression, "force_evidence", lambda *_: [one])
    problem = Problem(system_of(stage(reference=MOTION)), smooth_motion(plain), {})
    found = FoundEffect("saturation", "w", {"limit": 5.0}, {}, (), {})
    augmented = with_effects(problem.system, (found,))
    left = SimpleNamespace(by_segment=np.array([40.0]), residual=np.zeros((1, 40)))
    words = against_regression(left, problem, problem.system, augmented, (found,))  # type: ignore[arg-type]
    assert ("a smooth curve over its own variable" in words) is refused


def shares(one: ForceEvidence) -> list[float]:
    return [share for what in (one.vibration, one.drift) for share in (what.alone, what.by_law, what.both)]


@pytest.mark.parametrize("times", [2.0**-20, 2.0**20])
def test_the_evidence_is_that_of_a_machine_with_other_forces(times: float, tmp_path: Path) -> None:
    """Of a small motor, whose forces are micronewtons, the law explained 8.8 % in place of all, and was refused."""
    text, values = stage(reference=MOTION).text, {"value: 2,": 2.0, "value: 6,": 6.0, "a: 4.0,": 4.0}
    for old, value in values.items():
        assert text.count(old) == 1
        text = text.replace(old, f"{old.split()[0]} {value * times!r},")
    log = log_of(stage(COGGING, reference=MOTION, duration=20.0), tmp_path, "cogging.csv")
    found = []
    for system, inputs, amplitude in (
        (system_of(stage(reference=MOTION)), log.inputs, 0.8),
        (system_of(parse_spec(text, Path("stage.yaml"))), log.inputs * times, 0.8 * times),
    ):
        problem = Problem(system, smooth_motion(replace(log, inputs=inputs)), {})
        cogging = FoundEffect("cogging", "x", {"amplitude": amplitude, "period": 0.05, "phase": 0.3}, {}, (), {})
        found += force_evidence(problem, system, with_effects(system, (cogging,)), ["cogging"], [0])
    usual, other = ([one.removed, one.own, *shares(one)] for one in found)
    assert found[0].vibration.by_law > 0.9
    assert other == pytest.approx(usual, rel=1e-6, abs=1e-9)
