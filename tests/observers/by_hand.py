"""The machines of ``tests.machines.TEXTS`` as NumPy functions written by hand from the same mechanics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


def magnitude(z: Any) -> Any:
    """|z| continued to complex numbers as s·z with s the sign of the real part, so that complex steps pass through."""
    return z * np.sign(np.real(z))


@dataclass(frozen=True)
class ByHand:
    """A machine in NumPy. ``known`` are the contact forces of its declared effects, ``drag`` their coordinate forces.

    Every function takes complex numbers.
    """

    mass: Callable[[Any], Any]
    force: Callable[[Any, Any, Any], Any]
    distribution: Callable[[Any], Any]
    known: Callable[[Any], Any]
    drag: Callable[[Any], Any]
    inputs: int

    def total_force(self, x: Any, v: Any, w: Any, effects: bool) -> Any:
        return self.force(x, v, w) + (self.drag(v) if effects else 0)

    def known_friction(self, u: Any, effects: bool) -> Any:
        return self.known(u) if effects else 0 * u


def _stribeck(u: Any, delta: float, v_s: float) -> Any:
    return np.sign(np.real(u)) * delta * np.exp(-((u / v_s) ** 2))


def _arm_mass(x: Any) -> Any:
    m1, m2, l1, b1, b2, i1, i2 = 0.77, 0.27, 0.2, 0.04, 0.065, 0.0086, 0.0013
    c = m2 * l1 * b2 * np.cos(x[1])
    off = i2 + m2 * b2**2 + c
    return np.array([[i1 + i2 + m1 * b1**2 + m2 * (l1**2 + b2**2) + 2 * c, off], [off, i2 + m2 * b2**2]])


def _arm_force(x: Any, v: Any, w: Any) -> Any:
    m1, m2, l1, b1, b2, g = 0.77, 0.27, 0.2, 0.04, 0.065, 9.8
    h = m2 * l1 * b2 * np.sin(x[1])
    far = m2 * b2 * g * np.cos(x[0] + x[1])
    near = g * (m1 * b1 + m2 * l1) * np.cos(x[0])
    return np.array([w[0] + h * (2 * v[0] + v[1]) * v[1] - near - far, w[1] - h * v[0] ** 2 - far])


def _two_mass_force(x: Any, v: Any, w: Any) -> Any:
    slide = 3 * (v[0] - v[1])
    return np.array([-70 * x[0] + 20 * x[1] - slide, 20 * x[0] - 120 * x[1] + slide + w[0]])


BY_HAND = {
    "one_mass": ByHand(
        mass=lambda x: np.array([[1.7]]),
        force=lambda x, v, w: w - 0.4 * v - 30 * x,
        distribution=lambda x: np.array([[1.0]]),
        known=lambda u: 2.5 * u + _stribeck(u, 4, 0.3) + 0.7 * magnitude(u),
        drag=lambda v: -1.3 * v * magnitude(v),
        inputs=1,
    ),
    "two_mass": ByHand(
        mass=lambda x: np.diag([10.0, 50.0]),
        force=_two_mass_force,
        distribution=lambda x: np.array([[1.0, 0], [-1, 1]]),
        known=lambda u: np.array([6 * u[0] + 2 * magnitude(u[0]), _stribeck(u[1], 8, 0.5)]),
        drag=lambda v: np.array([0 * v[0], -4 * v[1] * magnitude(v[1])]),
        inputs=1,
    ),
    "arm": ByHand(
        mass=_arm_mass,
        force=_arm_force,
        distribution=lambda x: np.eye(2),
        known=lambda u: np.array([0.02 * u[0], _stribeck(u[1], 0.03, 0.6) + 0.004 * magnitude(u[1])]),
        drag=lambda v: np.array([-0.01 * v[0] * magnitude(v[0]), 0 * v[1]]),
        inputs=2,
    ),
    "cart": ByHand(
        mass=lambda x: np.array([[0.08, 0.2 * np.cos(x[0])], [0.2 * np.cos(x[0]), 2.5]]),
        force=lambda x, v, w: np.array([-1.96 * np.sin(x[0]), w[0] + 0.2 * v[0] ** 2 * np.sin(x[0])]),
        distribution=lambda x: np.array([[1, 0, 0.4 * np.cos(x[0])], [0, 1, 1]]),
        known=lambda u: np.array([0 * u[0], _stribeck(u[1], 1.1, 0.4), 0.9 * u[2] + 0.2 * magnitude(u[2])]),
        drag=lambda v: np.array([0 * v[0], -0.5 * v[1] * magnitude(v[1])]),
        inputs=1,
    ),
}
