"""Each effect of the catalogue on one mass, against the event integrator."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, pi, sin

import numpy as np
import pytest

from tests.machines import one_mass
from tests.simulate.open_loop import simulate_open_loop

from .event_integrator import Mass, integrate

TIME = np.arange(0, 2.5, 0.01)
COMMAND = 9 * np.sin(4 * TIME) + 3 * np.sin(9.1 * TIME + 0.4)


def mass(
    m: float = 2.0,
    gain: float = 1.0,
    force: Callable[[float, float], float] = lambda x, v: 0.0,
    level: Callable[[float, float], float] = lambda speed, s: 3.0,
) -> Mass:
    return Mass(m, lambda w, x, v: gain * w + force(x, v), level)


CASES = {
    "none": ("", mass(), 0.0),
    "viscous": ("on: rail, parameters: {b: 2.5}", mass(force=lambda x, v: -2.5 * v), 0.0),
    "offset": ("on: x, parameters: {f0: 1.2}", mass(force=lambda x, v: 1.2), 0.0),
    "coulomb_asymmetry": ("on: rail, parameters: {d: -0.8}", mass(level=lambda u, s: 3 - 0.8 * s), 0.0),
    "viscous_asymmetry": ("on: rail, parameters: {d_b: 1.1}", mass(force=lambda x, v: -1.1 * abs(v)), 0.0),
    "stribeck": (
        "on: rail, parameters: {delta: 1.5, v_s: 0.2}",
        mass(level=lambda u, s: 3 + 1.5 * exp(-((u / 0.2) ** 2))),
        0.0,
    ),
    "cogging": (
        "on: x, parameters: {amplitude: 2, period: 0.11, phase: 0.7}",
        mass(force=lambda x, v: 2 * sin(2 * pi * x / 0.11 + 0.7)),
        0.0,
    ),
    "quadratic_drag": ("on: x, parameters: {c: 4}", mass(force=lambda x, v: -4 * v * abs(v)), 0.0),
    "spring": ("on: x, parameters: {k: 35}", mass(force=lambda x, v: -35 * x), 0.0),
    "inertia_error": ("on: x, parameters: {delta: 0.6}", mass(m=2.6), 0.0),
    "input_gain": ("on: w, parameters: {gain: 0.85}", mass(gain=0.85), 0.0),
    "input_delay": ("on: w, parameters: {T: 0.0237}", mass(), 0.0237),
}


@pytest.mark.parametrize("kind", CASES)
def test_effect(kind: str):
    declared, reference, delay = CASES[kind]
    more = f"effects: [{{kind: {kind}, {declared}}}]" if declared else ""
    _, system = one_mass(m=2, a=3, more=more)
    x, v = integrate(reference, TIME, COMMAND, 0.05, 0.0, delay)
    got_x, got_v = simulate_open_loop(system, TIME, COMMAND[:, None], np.array([0.05]), np.zeros(1), substeps=100)
    assert np.max(np.abs(got_x[:, 0] - x)) < 2e-6
    assert np.max(np.abs(got_v[:, 0] - v)) < 2e-5
    if declared:
        _, plain = one_mass(m=2, a=3)
        without, _ = simulate_open_loop(plain, TIME, COMMAND[:, None], np.array([0.05]), np.zeros(1))
        assert np.max(np.abs(without[:, 0] - x)) > 0.005
