"""A saturation with rounded corners: its curve, what diagnosis inverts, and what the generated code does with it."""

from __future__ import annotations

from math import hypot
from pathlib import Path

import numpy as np
import pytest
import sympy

from codegen.base.errors import BadInput
from codegen.diagnosis.fit.residual import evaluate_forces, inverse_dynamics_residual
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.mechanics.actuator import Actuator, Limit
from codegen.mechanics.system import Matrix
from codegen.simulate.drive import Chains, MeanInput
from codegen.spec import parse_spec
from tests.diagnosis.stage import TRAIN, log_of, stage, system_of
from tests.effects.test_in_code import W, X, estimates
from tests.expected_errors import refused

TEXT = """\
name: axis
coordinates: {x: {velocity: v, unit: m}}
inputs: {u: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [u]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 3, unit: N}]}
"""


def curve(w: float, limit: float, rounding: float) -> float:
    """By the distances of the point (w, rounding·limit) from the two corners."""
    steep = (1 - rounding**2) ** 0.5
    corner, width = limit * steep, limit * rounding
    return (hypot(w + corner, width) - hypot(w - corner, width)) / (2 * steep)


def axis(parameters: str) -> System:
    spec = parse_spec(
        TEXT + f"effects: [{{kind: saturation, on: u, parameters: {{{parameters}}}}}]\n", Path("axis.yaml")
    )
    return add_declared_effects(build_system(spec), spec)


def passed(system: System, w: float) -> float:
    u = system.inputs[0]
    return float(system.actuator(0).static(u).subs({u: w} | dict(system.values)).doit())


def acting(parameters: str, commands: np.ndarray) -> np.ndarray:
    return Chains(axis(parameters), ()).act(commands[:, None], np.zeros(0), 1e-3, 1)[:, 0]


@pytest.mark.parametrize("w", [-70.0, -8.0, -1.0, 0.0, 0.3, 7.9, 8.1, 300.0])
def test_the_rounded_curve(w: float) -> None:
    assert passed(axis("limit: 8, rounding: 0.6"), w) == pytest.approx(curve(w, 8, 0.6))
    assert acting("limit: 8, rounding: 0.6", np.array([w]))[0] == pytest.approx(curve(w, 8, 0.6))


def test_slope_and_limits_do_not_depend_on_the_rounding() -> None:
    for rounding in (0.1, 0.5, 0.9):
        system = axis(f"limit: 8, rounding: {rounding}")
        assert (passed(system, 1e-4) - passed(system, -1e-4)) / 2e-4 == pytest.approx(1, abs=1e-6)
        assert passed(system, 1e6) == pytest.approx(8, abs=1e-3) and passed(system, -1e6) == pytest.approx(-8, abs=1e-3)


def test_little_rounding_is_a_sharp_corner() -> None:
    w = np.linspace(-20, 20, 81)
    found = acting("limit: 8, rounding: 1e-6", w)
    np.testing.assert_allclose(found, np.clip(w, -8, 8), atol=1e-5)


def test_a_hyperbolic_tangent_is_nearly_such_a_curve() -> None:
    """Up to 1.5 limits, 0.3 % of what is missing (RMS): the fit of these two numbers is scipy's."""
    w = np.linspace(-1.5, 1.5, 301)
    found = acting("limit: 1.08563, rounding: 0.867139", w)
    missing = w - np.tanh(w)
    assert np.sqrt(np.mean((found - np.tanh(w)) ** 2) / np.mean(missing**2)) < 0.003


@pytest.mark.parametrize("parameters", ["limit: 6", "limit: 6, rounding: 0.7"])
def test_the_command_that_acts_about_a_sample_passes_the_limit_once(parameters: str) -> None:
    """A constant command comes back as it is, and what acts is its saturated value: not saturated twice."""
    system = axis(parameters)
    for command in (-30.0, -4.0, 2.0, 9.0):
        commands = np.full(50, command)
        inverted = MeanInput(system, 0).at(commands, 1e-3, np.zeros(0))
        again = [passed(system, w) for w in inverted]
        np.testing.assert_allclose(again, passed(system, command), rtol=1e-6)


def test_the_force_residual_of_the_true_model_is_noise(tmp_path: Path) -> None:
    """A saturation applied twice would leave a tenth of what it takes."""
    plant = stage("[{kind: saturation, on: w, parameters: {limit: 9, rounding: 0.8}}]", 4.0, TRAIN)
    motion = smooth_motion(log_of(plant, tmp_path, "log.csv"))
    left = inverse_dynamics_residual(system_of(plant), motion)[motion.usable]
    without = inverse_dynamics_residual(system_of(stage()), motion)[motion.usable]
    drive = evaluate_forces(system_of(stage()), [Matrix([system_of(stage()).force[0]])], motion)[0][motion.usable]
    assert np.sqrt(np.mean(without**2)) > 0.05 * np.sqrt(np.mean(drive**2))
    assert np.median(np.abs(left)) < 0.02 * np.median(np.abs(without))


def test_limits_act_one_after_the_other() -> None:
    w = sympy.Symbol("w")
    both = Actuator(limits=(Limit(sympy.Integer(8)), Limit(sympy.Integer(5)))).static(w)
    assert float(both.subs(w, 20).doit()) == 5


@pytest.mark.parametrize(
    ("parameters", "code"),
    [("limit: 8, rounding: 1", "SPEC007"), ("limit: 8, rounding: 0", "SPEC007"), ("rounding: 0.5", "SPEC003"),
     ("limit: 8, roundin: 0.5", "SPEC008")],
)  # fmt: skip
def test_wrong_parameters_are_refused(parameters: str, code: str) -> None:
    with pytest.raises(BadInput) as refused:
        axis(parameters)
    assert refused.value.code == code


def test_a_misspelt_optional_parameter_is_named() -> None:
    with refused("SPEC008 `roundin` rounding"):
        axis("limit: 8, roundin: 0.5")


def test_the_generated_code_runs_the_curve(tmp_path: Path) -> None:
    """C and twin with the effect, against those without it driven by the curve."""
    effect = "{kind: saturation, on: w, parameters: {limit: 15, rounding: 0.5}}"
    acting = np.array([curve(w, 15, 0.5) for w in W])
    plain = estimates(tmp_path / "plain", "", X, acting)
    np.testing.assert_allclose(estimates(tmp_path / "rounded", effect, X, W), plain, atol=1e-9)
    assert np.abs(estimates(tmp_path / "raw", "", X, W) - plain).max() > 0.1
