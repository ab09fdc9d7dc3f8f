"""A payload on an arm: no effect is a mass, but the declared value that explains the log is told."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from codegen.base.resources import resource_folder
from codegen.diagnosis.case import values_of_zero
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.measure import measure
from codegen.diagnosis.fit.residual import Problem, level_parameters
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects, with_values
from codegen.diagnosis.results import ErrorFigures, Fact, FoundEffect
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.wrong_values import explaining_values, refused_for_a_value
from codegen.effects.declare import system_of
from codegen.logs import Log
from codegen.mechanics import System
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of
from tests.slow_cases import slow_except

ARM = (resource_folder("specs") / "two_link_arm.yaml").read_text(encoding="utf-8")
SHORT = "duration: 20", "duration: 8"
PAYLOAD = ARM.replace("m2: {value: 0.2713", "m2: {value: 0.35269")


def arm(text: str = ARM) -> Spec:
    return parse_spec(text, Path("arm.yaml"))


def short_log(text: str, folder: Path, name: str) -> Log:
    assert SHORT[0] in text
    return log_of(arm(text.replace(*SHORT)), folder, name)


def told(log: Log) -> list[Fact]:
    system = system_of(arm())
    return explaining_values(arm(), system, Problem(system, smooth_motion(log), {}))


def test_the_mass_that_differs_is_told_with_its_value(tmp_path: Path) -> None:
    wrong, then = told(log_of(arm(PAYLOAD), tmp_path, "log.csv"))
    assert wrong.topic == "declared value" and wrong.words.startswith("m2 = 0.3527 kg would explain")
    assert "declared is 0.2713 kg (+30 %)" in wrong.words and "no tolerance" in wrong.detail
    assert then.topic == "next" and "`tolerance`" in then.words


def test_a_tolerance_of_zero_is_told() -> None:
    """A share of nothing: a gravity term declared as 0 with 50 % was never fitted, without a word."""
    assert "m2: {value: 0.2713" in ARM
    line = next(line for line in ARM.splitlines() if "m2: {value: 0.2713" in line)
    for given, words in (
        ("  m2: {value: 0, unit: kg, tolerance: 50%}", "m2 is declared as zero, and its tolerance of 50 %"),
        ("  m2: {value: 1, unit: kg, tolerance: 50%}", ""),
        ("  m2: {value: 0, unit: kg}", ""),
    ):
        found = values_of_zero(arm(ARM.replace(line, given)))
        assert [words in f.words for f in found] == [True] * bool(words)


@pytest.mark.slow
def test_nothing_is_told_of_what_no_declared_value_explains(tmp_path: Path) -> None:
    lag = ARM.replace("observer:", "effects: [{kind: actuator_lag, on: w1, parameters: {tau: 0.03}}]\nobserver:", 1)
    assert told(short_log(ARM, tmp_path, "right.csv")) == []
    assert told(short_log(lag, tmp_path, "lag.csv")) == []


def judged(text: str, folder: Path, *effects: FoundEffect) -> Answer:
    """What becomes of effects that a diagnosis of the arm as declared would name."""
    return refused(arm(), short_log(text, folder, "log.csv"), effects)


def refused(spec: Spec, log: Log, effects: Sequence[FoundEffect], refit: System | None = None) -> Answer:
    """What becomes of effects; the log itself is held out. Without a refit, the declared system is it."""
    system = system_of(spec)
    problem, refit = Problem(system, smooth_motion(log), {}), refit or system
    augmented = with_effects(system, effects)

    def measured(model: System) -> ErrorFigures:
        return measure(model, problem.motion, problem.used, slice(0, log.size))

    figures = (measured(system), measured(refit), measured(augmented))
    return refused_for_a_value(spec, Answer("effect", tuple(effects), refit, augmented, figures), problem, measured)


def test_weaker_motors_do_not_stand_in_for_a_payload(tmp_path: Path) -> None:
    """Gains of 0.83 and 0.77 of both motors were named for a mass that was 30 % too small in the spec."""
    gains = [FoundEffect("input_gain", w, {"gain": g}, {"gain": "1"}) for w, g in (("w1", 0.827), ("w2", 0.766))]
    answer = judged(PAYLOAD, tmp_path, *gains)
    assert answer.verdict == "unknown" and "another value of m2 alone" in answer.against[0].words


def test_three_effects_are_refused_for_a_value_that_leaves_as_little(tmp_path: Path) -> None:
    """Both gains and a weight left 0.03 % of the squared residual, the payload's mass alone 0.01 %."""
    gains = [FoundEffect("input_gain", w, {"gain": g}, {}) for w, g in (("w1", 0.7712), ("w2", 0.7659))]
    effects = (*gains, FoundEffect("gravity_imbalance", "theta1", {"G": 0.06333, "phase": -1.5708}, {}))
    assert refused(arm(), log_of(arm(PAYLOAD), tmp_path, "log.csv"), effects).verdict == "unknown"


PENDULUM = """\
name: pendulum
coordinates: {{q: {{velocity: v, unit: rad}}}}
inputs: {{tau: {{unit: N*m}}}}
parameters:
  J: {{value: 0.106, unit: kg*m^2}}
  w: {{value: 3.4, unit: N*m}}
mass_matrix: [[J]]
force: [tau - w*sin(q)]
friction: {{distribution: [[1]], contacts: [{{name: Fb, law: coulomb, a: 0.6, unit: N*m}}]}}
effects: {effects}
simulation:
  duration: 16
  sample_time: 0.004
  reference: {{q: "0.9*sin(2*pi*0.23*t) + 0.2*sin(2*pi*1.3*t)"}}
  position_gain: {{tau: 30}}
  velocity_gain: {{tau: 4}}
  encoder_step: {{q: 0.000767}}
"""


def test_play_is_not_refused_for_a_value_with_which_simulations_are_worse(tmp_path: Path) -> None:
    """Play and a weight left 12 % of the squared residual force, which does not show the load; a mass 9 %."""
    values = {
        "gravity_imbalance": {"G": 0.29, "phase": -3.13},
        "backlash": {"gap": 0.004, "k": 2900, "c": 16, "load_fraction": 0.52},
    }
    missing = json.dumps([{"kind": kind, "on": "q", "parameters": own} for kind, own in values.items()])
    plant, spec = (parse_spec(PENDULUM.format(effects=e), Path("pendulum.yaml")) for e in (missing, "[]"))
    log = log_of(plant, tmp_path, "log.csv")
    assert explaining_values(spec, system_of(spec), Problem(system_of(spec), smooth_motion(log), {}))
    assert refused(spec, log, [FoundEffect(kind, "q", own, {}) for kind, own in values.items()]).verdict == "effect"


TRUE = [
    ("input_gain", "w2", {"gain": 0.8}),
    ("inertia_error", "theta1", {"delta": 0.02}),
    ("spring", "theta2", {"k": 0.5}),
]


@pytest.mark.parametrize(("kind", "on", "parameters"), slow_except(TRUE, [TRUE[1]], several=True))
def test_a_true_effect_is_not_refused_for_a_value(
    kind: str, on: str, parameters: dict[str, float], tmp_path: Path
) -> None:
    entry = f"{{kind: {kind}, on: {on}, parameters: {json.dumps(parameters)}}}"
    lacking = ARM.replace("simulation:", f"effects: [{entry}]\nsimulation:")
    answer = judged(lacking, tmp_path, FoundEffect(kind, on, parameters, {}))
    assert lacking != ARM and answer.verdict == "effect" and not answer.against


def test_a_joint_with_a_wrong_level_and_noise_is_no_half_of_the_residual(tmp_path: Path) -> None:
    """A weight that left only noise was refused: the other joint, whose level the refit has wrong, counted as half."""
    kind, parameters = "gravity_imbalance", {"G": 0.36, "phase": -1.57}
    system = system_of(arm())
    level = level_parameters(system)[-1]
    entry = f"{{kind: {kind}, on: theta1, parameters: {json.dumps(parameters)}}}"
    log = short_log(ARM.replace("simulation:", f"effects: [{entry}]\nsimulation:"), tmp_path, "log.csv")
    refit = with_values(system, {level.name: 1.5 * float(system.values[level])})
    problem = Problem(system, smooth_motion(log), {})
    assert explaining_values(arm(), refit, problem), "another value of a mass would explain most of it"
    assert refused(arm(), log, [FoundEffect(kind, "theta1", parameters, {})], refit).verdict == "effect"


@pytest.mark.slow
def test_a_payload_on_an_arm_is_unknown_and_told(tmp_path: Path) -> None:
    diagnosis, _ = diagnose_log(arm(), system_of(arm()), log_of(arm(PAYLOAD), tmp_path, "log.csv"))
    assert diagnosis.verdict == "unknown" and "m2 = 0.3527 kg" in diagnosis.statement.of("declared value")[0]
