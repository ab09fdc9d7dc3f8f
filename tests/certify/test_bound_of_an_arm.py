"""What two_link_arm lacks for a bound in newtons: the figures in docs/certificate_theory.md, from the derived Psi.

Sums of absolute responses at frozen elbow angles, a lower bound of what any proof for a moving elbow can show; with
noise of half an encoder step, 0.5 rad/s^2 within a sample, and forces that change at the speeds of the envelope.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.app.derived import Derived
from codegen.certify.outcome import Certificate
from codegen.spec import parse_spec
from tests.checker.test_kernel import spec_path
from tests.slow_cases import slow_except

NOISE, ACCELERATION, SPEED, FRICTION = 5e-6, 0.5, 0.3, np.array([0.001, 0.005])
ELBOW = (0.0, 0.8, 1.6, 2.4, math.pi)


class Arm:
    """The arm at this sample time: its matrices over the elbow's angle and the signs of slip."""

    def __init__(self, h: float) -> None:
        text = spec_path("two_link_arm").read_text("utf-8").replace("sample_time: 0.001", f"sample_time: {h}")
        self.machine, self.h = Derived(parse_spec(text, Path("two_link_arm.yaml"))), h
        dynamics = self.machine.analysis.dynamics
        self.system, observer = dynamics.observer.system, dynamics.observer
        values = dict(observer.values)
        self.psi = sympy.Matrix(dynamics.sampled).xreplace(values)
        self.names = sorted(self.psi.free_symbols, key=str)
        self.change = sympy.lambdify(self.names, self.psi, "numpy")
        self.mass = sympy.lambdify(self.system.positions, self.system.mass_matrix.xreplace(values), "numpy")
        force = sympy.Matrix(self.system.modelled_force - observer.true_friction).xreplace(values)
        slopes = force.jacobian([*self.system.positions, *self.system.velocities])
        self.slopes = sympy.lambdify([*self.system.positions, *self.system.velocities], slopes, "numpy")

    def responses(self, elbow: float, signs: tuple[int, int]) -> tuple[Any, Any, Any]:
        """(the step's matrix, columns by noise and motion within a sample, the noise that the same sample shows)."""
        inverse = np.linalg.inv(np.array(self.mass(0.0, elbow), dtype=float))
        at = {
            "W11": inverse[0, 0],
            "W12": inverse[0, 1],
            "W22": inverse[1, 1],
            "theta2": elbow,
            "omega1": 0,
            "omega2": 0,
        }
        at |= {"s_shoulder": signs[0], "s_elbow": signs[1]}
        step = np.eye(4) + self.h * np.array(self.change(*[at[s.name] for s in self.names]), dtype=float)
        gains, velocity = np.array([[0.01, 0], [0.01, 0.005]]), np.array([[1, 0.5], [1, 10.0]])
        shown = np.vstack([velocity, -gains @ np.diag(signs) @ velocity])  # of the noise of the same sample
        jerk = np.zeros(2)
        for shoulder in np.linspace(-math.pi, math.pi, 41):
            by = np.abs(inverse @ np.array(self.slopes(shoulder, elbow, 0, 0), dtype=float))
            jerk = np.maximum(jerk, by @ np.array([SPEED, SPEED, ACCELERATION, ACCELERATION]))
        columns = np.hstack(
            [
                (step - np.eye(4)) @ shown * NOISE,
                shown * self.h**2 * ACCELERATION / 2,
                np.eye(4)[:, :2] * self.h**2 * jerk / 2,
            ]
        )
        return step, columns, np.abs(shown[2:]).sum(axis=1) * NOISE

    def sums(self, angles: Sequence[float], samples: int) -> Any:
        """Sums over so many samples of the two friction errors, for each of these angles and either sign."""
        found = [self.responses(elbow, (1, way)) for elbow in angles for way in (1, -1)]
        step, moved, total = (np.array(part) for part in zip(*found, strict=True))
        for _ in range(samples):
            total, moved = total + np.abs(moved[:, 2:]).sum(axis=2), step @ moved
        return total


@cache
def arm_at(h: float) -> Arm:
    """Each derived once."""
    return Arm(h)


FROZEN = [(0.001, (0.470, 0.0251)), (0.0002, (0.0943, 0.0052))]


@pytest.mark.parametrize(("h", "shares"), slow_except(FROZEN, FROZEN[:1], several=True))
def test_the_share_of_friction_at_frozen_angles(h: float, shares: tuple[float, float]) -> None:
    arm = arm_at(h)
    found = arm.sums((0.0, math.pi), round(20 / h))
    assert len(found) == 4 and np.max(found, axis=0) / FRICTION == pytest.approx(shares, rel=0.02)


BY_V = [(0.001, (1.61, 0.445)), (0.0001, (0.190, 0.051))]


@pytest.mark.parametrize(("h", "shares"), slow_except(BY_V, BY_V[:1], several=True))
def test_the_share_by_the_certificate_s_own_v(h: float, shares: tuple[float, float]) -> None:
    """|e|_P <= sum of |b|_P over 1 - the fall: above the friction of the shoulder, and nearly that of the elbow."""
    arm = arm_at(h)
    outcome = arm.machine.outcome
    assert isinstance(outcome, Certificate)
    p = np.array([[float(Fraction(x)) for x in row] for row in outcome.content["lyapunov_matrix"]])
    left = 1 - math.sqrt(1 - 2 * outcome.decay_rate * arm.h)
    sizes = []
    for elbow in ELBOW:
        for way in (1, -1):
            _, columns, _ = arm.responses(elbow, (1, way))
            sizes.append(np.sqrt(np.einsum("ij,ik,kj->j", columns, p, columns)).sum() / left)
    seen = np.sqrt(np.diag(np.linalg.inv(p)))[2:]
    assert max(sizes) * seen / FRICTION == pytest.approx(shares, rel=0.02)


def test_no_gain_helps_where_gravity_moves_on_within_a_sample() -> None:
    """The code's force is that at the sample; half a sample later gravity is another, by 18 % of the friction."""
    arm = arm_at(0.001)
    slope = np.abs(np.array(arm.slopes(math.pi / 2, 0.0, 0, 0), dtype=float))[:, :2]
    assert slope @ [SPEED, SPEED] * arm.h / 2 / FRICTION == pytest.approx([0.179, 0.0104], rel=0.02)
