"""Laws that the catalogue lacks, which look like an effect whose parameters vary over the log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import MATERIAL, FoundEffect
from codegen.diagnosis.verdict.against_regression import Varying, varying
from codegen.logs import Log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import TEST, TRAIN, among, log_of, stage, system_of
from tests.slow_cases import slow_except

MOTION = "0.12*sin(2*pi*0.23*t) + 0.08*sin(2*pi*0.371*t + 1) + 0.05*sin(2*pi*0.617*t + 2) + 0.03*sin(2*pi*1.13*t)"
PERIOD = 0.06
SPEED_WAVE = " - d*v*sin(2*pi*x/p)"
"""Friction in proportion to the speed, and periodic in position."""
DAMPING_OVER_PLACE = " - d*v*(1 + 0.25*x/p)"


def machine(force: str = "", effects: str = "", reference: str = MOTION, duration: float = 20.0) -> Spec:
    """The stage with a further force, an expression over position, speed and input."""
    text = stage(f"[{effects}]", reference=reference, duration=duration).text
    further = f"  p: {{value: {PERIOD}, unit: m}}\n  d: {{value: 8, unit: N*s/m}}\n  f: {{value: 3, unit: N}}\n"
    text = text.replace("  b: {", f"{further}  b: {{").replace("[w - b*v]", f"[w - b*v{force}]")
    return parse_spec(text, Path("stage.yaml"))


def found(kind: str, on: str = "rail", **values: float) -> FoundEffect:
    return FoundEffect(kind, on, values, {})


def judged(log: Log, *effects: FoundEffect) -> Varying | None:
    """The objection to effects of the stage."""
    system = system_of(stage())
    problem = Problem(system, smooth_motion(log), {})
    return varying(problem, with_effects(system, effects), effects, MATERIAL)


OF_WAVE = [("position_dependent_friction", "cogging", "viscous"), ("position_dependent_friction", "viscous")]


@pytest.mark.parametrize("kinds", slow_except(OF_WAVE, OF_WAVE[1:]), ids=["all", "few"])
def test_friction_in_proportion_to_the_speed_and_periodic_in_position_is_not_named(
    kinds: tuple[str, ...], tmp_path: Path
) -> None:
    train = log_of(machine(SPEED_WAVE, reference=TRAIN, duration=14.0), tmp_path, "train.csv")
    test = log_of(machine(SPEED_WAVE, reference=TEST, duration=10.0), tmp_path, "test.csv")
    spec = stage()
    with among(*kinds):
        diagnosis = diagnose_log(spec, system_of(spec), train, test)[0]
    assert diagnosis.verdict == "unknown" and not diagnosis.effects


def test_the_variable_of_a_force_without_a_name_is_found(tmp_path: Path) -> None:
    wave = judged(
        log_of(machine(SPEED_WAVE), tmp_path, "wave.csv"),
        found("position_dependent_friction", amplitude=2.0, period=PERIOD, phase=0.0),
    )
    assert wave is not None and (wave.over, wave.effect.kind) == ("speed", "position_dependent_friction")
    damping = judged(log_of(machine(DAMPING_OVER_PLACE), tmp_path, "damping.csv"), found("viscous", b=8.0))
    assert damping is not None and damping.over == "position"


@pytest.mark.parametrize("b", [8.0, 4.0])
@pytest.mark.parametrize(("rise", "refused"), [(0.04, False), (0.06, True)])
def test_an_objection_counts_only_the_force_that_constant_values_leave(
    rise: float, refused: bool, b: float, tmp_path: Path
) -> None:
    """Damping that depends on the position a little: 1.7 and 2.5 % of the drive force.

    With half of the damping in the effect the residual force is ten times as large, but constant values explain it.
    """
    log = log_of(machine(f" - d*v*(1 + {rise}*x/p)"), tmp_path, "log.csv")
    assert (judged(log, found("viscous", b=b)) is not None) == refused


@pytest.mark.parametrize(
    ("kind", "on", "values", "missing"),
    [
        ("position_dependent_friction", "rail", {"amplitude": 1.5, "period": PERIOD, "phase": 0.4}, ""),
        ("position_dependent_friction", "rail", {"amplitude": 1.5, "period": PERIOD, "phase": 0.4}, " - d*v"),
        ("viscous", "rail", {"b": 8.0}, " - f*sin(0.6*x/p)"),
        ("cogging", "x", {"amplitude": 1.5, "period": PERIOD, "phase": 0.4}, " - d*v"),
        ("stribeck", "rail", {"delta": 2.0, "v_s": 0.06}, ""),
        ("spring", "x", {"k": 15.0}, " - d*v"),
    ],
)
def test_a_true_effect_is_not_refused_for_what_else_is_missing(
    kind: str, on: str, values: dict[str, float], missing: str, tmp_path: Path
) -> None:
    """Beside a vibration in time, and beside a second missing effect."""
    written = ", ".join(f"{name}: {value}" for name, value in values.items())
    log = log_of(machine(missing, f"{{kind: {kind}, on: {on}, parameters: {{{written}}}}}"), tmp_path, "log.csv")
    shaken = log.inputs - 0.8 * np.sin(2 * np.pi * 2.7 * log.sample_time * np.arange(log.size))[:, None]
    near = {name: 1.03 * value for name, value in values.items()}
    for one in (log, replace(log, inputs=shaken)):
        assert judged(one, found(kind, on, **near)) is None


def test_a_gain_that_is_another_one_for_a_while_is_not_named(tmp_path: Path) -> None:
    """A single interval, which no other part of the log predicts."""
    log = log_of(machine(), tmp_path, "log.csv")
    time = log.sample_time * np.arange(log.size)
    warm = replace(log, inputs=log.inputs / np.where(time < 2.5, 1.0, 0.6)[:, None])
    refused = judged(warm, found("input_gain", "w", gain=0.605))
    assert refused is not None and (refused.over, refused.effect.kind) == ("time", "input_gain")


@pytest.mark.parametrize("push", [1.5, 6.0])
def test_a_constant_gain_is_not_refused_for_a_push(push: float, tmp_path: Path) -> None:
    """Nor for friction that is larger in the same interval."""
    log = log_of(machine(effects="{kind: input_gain, on: w, parameters: {gain: 0.6}}"), tmp_path, "log.csv")
    time = log.sample_time * np.arange(log.size)
    during = ((time > 4.0) & (time < 6.5))[:, None]
    direction = np.sign(np.gradient(log.positions, axis=0))
    for force in (np.ones_like(direction), direction):
        assert (
            judged(replace(log, inputs=log.inputs + push * during * force), found("input_gain", "w", gain=0.605))
            is None
        )


def drifting(folder: Path, slope: float = 0.0, level: float = 0.0, push: float = 0.0, start: float = 0.5) -> Log:
    """40 s with friction ``slope`` v + ``level`` sgn v that decays within 1.5 s, and a force for 1 s."""
    log = log_of(machine(duration=40.0), folder, "log.csv")
    time = (log.sample_time * np.arange(log.size))[:, None]
    speed = np.gradient(log.positions, log.sample_time, axis=0)
    pushed = (time > start) & (time < start + 1)
    more = (slope * speed + level * np.sign(speed)) * np.exp(-time / 1.5) + push * pushed
    return replace(log, inputs=log.inputs + more)


def test_viscous_friction_that_falls_as_it_warms_is_no_drift_of_the_level(tmp_path: Path) -> None:
    """It acts in the first seconds: nearly all gains there are positive, but their z-score is 1.8."""
    refused = judged(drifting(tmp_path, slope=20.0), found("friction_drift", delta=2.0, T=1.5))
    assert refused is not None and (refused.over, refused.effect.kind) == ("speed", "friction_drift")


@pytest.mark.parametrize(("push", "start"), [(0.0, 0.5), (3.0, 0.5), (8.0, 1.2), (-8.0, 2.0)])
def test_a_level_that_drifts_is_not_refused(push: float, start: float, tmp_path: Path) -> None:
    """Nor beside a force from outside in the seconds in which it acts."""
    log = drifting(tmp_path, level=3.0, push=push, start=start)
    assert judged(log, found("friction_drift", delta=2.8, T=1.6)) is None
