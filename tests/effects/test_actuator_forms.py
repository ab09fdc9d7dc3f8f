"""Two equal lags in series and a threshold: what acts, against scipy's exact discretisation and by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy
from numpy.typing import NDArray
from scipy.signal import cont2discrete

from codegen.diagnosis.fit.residual import inverse_dynamics_residual, used_samples
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.simulate.drive import Chains, HeldInput
from codegen.spec import parse_spec
from tests.diagnosis.stage import diagnosed, log_of, stage, system_of
from tests.effects.test_in_code import W, X, estimates
from tests.expected_errors import refused
from tests.machines import SPRING_MASS
from tests.simulate.open_loop import drive_columns
from tests.slow_cases import slow_except

H, TAU = 1e-3, 2.5e-3


def machine(kind: str, parameters: str) -> System:
    text = SPRING_MASS.format(m=2, k=0, b=0, a=3)
    text += f"effects: [{{kind: {kind}, on: w, parameters: {{{parameters}}}}}]\n"
    spec = parse_spec(text, Path("axis.yaml"))
    return add_declared_effects(build_system(spec), spec)


def mean_behind_two_lags(w: NDArray[np.float64], tau: float, step: float, start: float) -> NDArray[np.float64]:
    """Mean of y over each step of held values: states y_1, y, ∫y of 1/(tau s + 1)², by matrix exponential."""
    a = np.array([[-1 / tau, 0, 0], [1 / tau, -1 / tau, 0], [0, 1, 0]])
    b = np.array([[1 / tau], [0], [0]])
    ad, bd, *_ = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), step)
    state, means = np.array([start, start, 0.0]), []
    for value in w:
        state = ad @ state + bd[:, 0] * value
        means.append(state[2] / step)
        state[2] = 0.0
    return np.array(means)


def test_two_lags_where_a_log_drives_a_plant() -> None:
    """In the simulator, and with the time constant as an argument, as in a diagnosis."""
    system = machine("actuator_lag", f"tau_each: {TAU}")
    true = mean_behind_two_lags(np.repeat(W, 3), TAU, H / 3, W[0])
    columns = drive_columns(system, np.arange(len(W)) * H, W[:, None], 3)[:, 2:]
    np.testing.assert_allclose(columns.ravel(), true, atol=1e-10)
    lag = system.actuator(0).lag
    found = Chains(replace(system, values={}), (lag,)).act(W[:, None], np.array([TAU]), H, 3)
    np.testing.assert_allclose(found[:, 0], true, atol=1e-10)


def test_a_delay_passes_a_command_on_behind_the_dead_zone() -> None:
    """Where a command changes within a step, the mean of what acts is that of two values behind the dead zone."""
    system = machine("dead_zone", "width: 2")
    chain = system.actuator(0).with_stage("delay", sympy.Float(0.4 * H))
    late = replace(system, actuators={system.inputs[0]: chain})
    found = drive_columns(late, np.arange(4) * H, np.array([[0.0], [3.0], [-5.0], [-5.0]]), 1)[:, 2]
    np.testing.assert_allclose(found, [0, 0.6 * 1, 0.4 * 1 - 0.6 * 3, -3], atol=1e-12)


def test_two_lags_where_commands_are_held_sample_by_sample() -> None:
    system = machine("actuator_lag", f"tau_each: {TAU}")
    held = HeldInput(system, H, np.array([0.0, 0.25, 1.0]))
    found = np.array([np.diff([0.0, 0.25, 1.0]) @ held.take(np.array([w]))[:, 0] for w in W])
    np.testing.assert_allclose(found, mean_behind_two_lags(W, TAU, H, 0.0), atol=1e-10)


def test_two_lags_in_the_generated_code(tmp_path: Path) -> None:
    """C and twin with the effect, against those without it driven by what acts."""
    acting = mean_behind_two_lags(W, 0.006, H, W[0])
    plain = estimates(tmp_path / "plain", "", X, acting)
    effect = "{kind: actuator_lag, on: w, parameters: {tau_each: 0.006}}"
    np.testing.assert_allclose(estimates(tmp_path / "lagged", effect, X, W), plain, atol=1e-8)
    assert np.abs(estimates(tmp_path / "raw", "", X, W) - plain).max() > 0.1


def test_up_to_a_threshold_nothing_passes_and_above_it_everything(tmp_path: Path) -> None:
    w = np.array([-7.0, -3.1, -3.0, 0.0, 1.0, 3.0, 3.01, 20.0])
    passed = np.array([-7.0, -3.1, 0.0, 0.0, 0.0, 0.0, 3.01, 20.0])
    system = machine("dead_zone", "threshold: 3")
    np.testing.assert_allclose(drive_columns(system, np.arange(8) * H, w[:, None], 1)[:, 2], passed)
    acting = np.where(np.abs(W) > 3, W, 0.0)
    plain = estimates(tmp_path / "plain", "", X, acting)
    effect = "{kind: dead_zone, on: w, parameters: {threshold: 3}}"
    np.testing.assert_allclose(estimates(tmp_path / "threshold", effect, X, W), plain, atol=1e-9)
    assert np.abs(estimates(tmp_path / "raw", "", X, W) - plain).max() > 0.05


@pytest.mark.parametrize("effect", ["dead_zone, on: w, parameters: {threshold: 3}",
                                    "actuator_lag, on: w, parameters: {tau_each: 20 ms}"])  # fmt: skip
def test_the_force_residual_of_the_true_model_is_small(effect: str, tmp_path: Path) -> None:
    plant = stage(f"[{{kind: {effect}}}]")
    motion = smooth_motion(log_of(plant, tmp_path, "log.csv"))
    sliding = used_samples(system_of(plant), motion)
    left = inverse_dynamics_residual(system_of(plant), motion)[sliding]
    without = inverse_dynamics_residual(system_of(stage()), motion)[sliding]
    assert np.sum(left**2) < 0.01 * np.sum(without**2)


@pytest.mark.parametrize(
    ("kind", "parameters", "told"),
    [
        ("dead_zone", "threshold: 3, width: 2", "SPEC008 `width` together with `threshold` width or threshold"),
        ("dead_zone", "threshold: -3", "SPEC007 threshold"),
        ("actuator_lag", "tau: 0.1, tau_each: 0.1", "SPEC008 `tau` together with `tau_each` tau or tau_each"),
        ("actuator_lag", "", "SPEC003 `tau` tau or tau_each"),
        ("dead_zone", "treshold: 3", "SPEC008 `treshold` threshold"),
    ],
)
def test_wrong_parameters_are_refused(kind: str, parameters: str, told: str) -> None:
    with refused(told):
        machine(kind, parameters)


ALL: tuple[str, ...] = ()
FEW = ("dead_zone", "saturation", "actuator_lag", "input_gain", "viscous")
FORMS = [
    ("dead_zone", "threshold", 5.0, "N", FEW),
    ("dead_zone", "threshold", 5.0, "N", ALL),
    ("actuator_lag", "tau_each", 0.008, "s", ALL),
    ("dead_zone", "width", 2.0, "N", ALL),
    ("actuator_lag", "tau", 0.012, "s", ALL),
]


@pytest.mark.parametrize(("kind", "name", "value", "unit", "kinds"), slow_except(FORMS, FORMS[:1], several=True))
def test_a_diagnosis_finds_each_form(
    kind: str, name: str, value: float, unit: str, kinds: tuple[str, ...], tmp_path: Path
) -> None:
    effect = f"[{{kind: {kind}, on: w, parameters: {{{name}: {value} {unit}}}}}]"
    diagnosis, _ = diagnosed(effect, tmp_path, noise=1e-6, kinds=kinds)
    assert [e.kind for e in diagnosis.effects] == [kind], diagnosis.sentence
    assert diagnosis.effects[0].parameters == pytest.approx({name: value}, rel=0.05)
