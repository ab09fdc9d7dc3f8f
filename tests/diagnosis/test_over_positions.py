"""A force over the positions of two axes, such as that of a rope to a fixed point, against effects on one of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis.case import case_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import MATERIAL, FoundEffect
from codegen.diagnosis.verdict.over_positions import over_positions
from codegen.logs import Log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import CROSS, log_of, system_of

SPRING = FoundEffect("spring", "x", {"k": 20.0}, {"k": "N/m"})
VISCOUS = FoundEffect("viscous", "rail", {"b": 8.0}, {"b": "N*s/m"})


def cross() -> Spec:
    return parse_spec(CROSS, Path("cross.yaml"))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return log_of(cross(), tmp_path_factory.mktemp("log"), "train.csv")


def judged(log: Log, force: Array, *named: FoundEffect, material: float = MATERIAL, **wrong: float) -> str:
    """The objection to effects of a machine with this force (N, 2) in addition, which its inputs balance.

    Args:
        material: share of the drive force from which on a force matters.
        wrong: values of the model that are not the machine's; the mass has a tolerance.
    """
    system = system_of(cross())
    motion = smooth_motion(replace(log, inputs=log.inputs - force))
    problem = Problem(system, motion, {s: 0.4 for s in system.values if s.name == "m"}, material=material)
    return over_positions(problem, with_values(system, wrong), named)


def rope(x: Array) -> Array:
    """A rope of 0.2 m to a point beside the motion, as a spring of 40 N/m."""
    to = np.array([0.25, 0.3]) - x
    length = np.linalg.norm(to, axis=1, keepdims=True)
    return np.asarray(40.0 * np.maximum(0.0, 1 - 0.2 / length) * to)


def test_a_rope_to_a_fixed_point_is_no_spring_on_one_axis(log: Log) -> None:
    """On an arm it was named a weight or an offset on one joint, with a spring on another."""
    for on in ("x", "y"):
        words = judged(log, rope(log.positions), replace(SPRING, on=on))
        assert "over the positions of all coordinates" in words


@pytest.mark.parametrize("wrong", [{"m": 5.0}, {"rail_a": 12.0}])
def test_a_wrong_mass_or_level_does_not_hide_the_rope(wrong: dict[str, float], log: Log) -> None:
    """Each leaves more than the rope does, and neither the curve nor the law explains that."""
    assert "over the positions of all coordinates" in judged(log, rope(log.positions), SPRING, **wrong)


def test_a_curve_is_asked_for_where_two_coordinates_move(log: Log) -> None:
    """Alone on its axis a spring that hardens is a matter of the checks on its own variable."""
    x = log.positions * [1, 0]
    words = judged(replace(log, positions=x), -20.0 * x - 300.0 * x**3, SPRING)
    assert words == ""


def test_true_effects_are_not_refused(log: Log) -> None:
    x, speed = log.positions * [1, 0], np.gradient(log.positions, log.sample_time, axis=0) * [1, 0]
    assert judged(log, -20.0 * x, SPRING) == ""
    assert judged(log, -8.0 * speed, VISCOUS) == ""
    assert judged(log, -20.0 * x - 8.0 * speed, SPRING, VISCOUS) == ""


def test_a_law_that_leaves_less_than_twice_as_much_is_not_refused(log: Log) -> None:
    """A force of 4 % of the drive force over the other position, below noise of which the curve leaves as much."""
    x, noise = log.positions * [1, 0], np.random.default_rng(0).standard_normal(log.positions.shape)
    other = log.positions[:, 1:] * [1, 0]
    assert judged(log, noise + 2.0 * other - 20.0 * x, SPRING) == ""
    assert "over the positions" in judged(log, 0.3 * noise + 2.0 * other - 20.0 * x, SPRING)


@pytest.mark.parametrize("curvature", [3.0, 10.0, 30.0])
def test_a_law_that_is_nearly_right_over_its_own_position_is_not_refused(curvature: float, log: Log) -> None:
    """A curve over the effect's own position explains what the spring leaves; no force acts between the axes."""
    x = log.positions * [1, 0]
    assert judged(log, -20.0 * x - curvature * x**2, SPRING) == ""


def test_an_immaterial_force_over_positions_refuses_nothing(log: Log) -> None:
    """A rope of 1 % of the drive force beside a true spring of 15 %, of which the curve leaves a quarter."""
    x = log.positions * [1, 0]
    for wrong in ({}, {"m": 5.0}, {"rail_a": 12.0}):  # of which the levels and the mass are free
        force = 0.06 * rope(log.positions) - 20.0 * x
        assert judged(log, force, SPRING, **wrong) == ""
        assert "over the positions" in judged(log, force, SPRING, material=0.005, **wrong)
    assert "over the positions" in judged(log, rope(log.positions) - 20.0 * x, SPRING)


def test_the_limit_is_that_of_the_call(log: Log) -> None:
    """It was 2 %, whatever ``--material`` said."""
    case = case_of(cross(), system_of(cross()), log, None, 0.005)
    assert case.problem.material == case.material == 0.005


def test_an_effect_that_explains_less_than_an_immaterial_force_over_positions_is_refused(log: Log) -> None:
    """A tether added 1.6 % of the drive force to one joint of an arm, and a spring on it explained less."""
    assert "over the positions" in judged(log, 0.5 * log.positions[:, 1:] * [1, 0], SPRING)


def test_a_true_effect_beside_a_larger_force_over_positions_is_not_refused(log: Log) -> None:
    speed = np.gradient(log.positions, log.sample_time, axis=0) * [1, 0]
    assert judged(log, 3 * rope(log.positions) - 8.0 * speed, VISCOUS) == ""
