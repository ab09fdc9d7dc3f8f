"""Effects simulated on one mass against SciPy with events, written from effects.md."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, pi, sin
from pathlib import Path

import numpy as np
import pytest
from simulate.machines import ONE_MASS

from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.simulate import simulate_open_loop
from codegen.spec import parse_spec

from .hybrid import Truth, integrate

TIME = np.arange(0, 2.0, 0.01)
COMMAND = 9 * np.sin(4 * TIME) + 3 * np.sin(9.1 * TIME + 0.4)
M, A = 2.0, 3.0


def mass(
    force: Callable[..., float] = lambda t, x, v, w: 0.0,
    level: Callable[..., float] = lambda t, x, v, w, s: A,
    effective: Callable[[float], float] = lambda w: w,
) -> Truth:
    """m v' = w_eff + force − λ."""

    def drive(t, y, w):
        return effective(w) + force(t, *y, w)

    return Truth(
        lambda t, y, w, friction: [y[1], (drive(t, y, w) - friction) / M],
        drive,
        lambda t, y, w, s: max(0.0, level(t, *y, w, s)),
    )


def lagging(tau: float, effective: Callable[[float], float] = lambda w: w) -> Truth:
    """The third state is w_eff."""
    return Truth(
        lambda t, y, w, friction: [y[1], (y[2] - friction) / M, (effective(w) - y[2]) / tau],
        lambda t, y, w: y[2],
        lambda t, y, w, s: A,
    )


def dead(w: float, width: float) -> float:
    return np.sign(w) * max(abs(w) - width, 0)


CHAIN = (
    "{kind: actuator_lag, on: w, parameters: {tau: 0.05}}, {kind: saturation, on: w, parameters: {limit: 7}},"
    " {kind: input_gain, on: w, parameters: {gain: 1.2}}, {kind: dead_zone, on: w, parameters: {width: 2}}"
)
CASES = {
    "gravity_imbalance": (
        "on: x, parameters: {G: 4, phase: 0.6}",
        mass(lambda t, x, v, w: -4 * sin(x + 0.6)),
    ),
    "hardening_spring": ("on: x, parameters: {k3: 900}", mass(lambda t, x, v, w: -900 * x**3)),
    "cogging_harmonics": (
        "on: x, parameters: {period: 0.4, sin_1: 1, cos_1: 0.5, sin_3: -2, cos_3: 0.7}",
        mass(
            lambda t, x, v, w: (
                sin(2 * pi * x / 0.4)
                + 0.5 * np.cos(2 * pi * x / 0.4)
                - 2 * sin(6 * pi * x / 0.4)
                + 0.7 * np.cos(6 * pi * x / 0.4)
            )
        ),
    ),
    "position_dependent_friction": (
        "on: rail, parameters: {amplitude: 1.5, period: 0.11, phase: 0.7}",
        mass(level=lambda t, x, v, w, s: A + 1.5 * sin(2 * pi * x / 0.11 + 0.7)),
    ),
    "load_dependent_friction": (
        "on: rail, parameters: {mu: 0.2}",
        mass(level=lambda t, x, v, w, s: A + 0.2 * abs(w)),
    ),
    "drive_backdrive_friction": (
        "on: rail, parameters: {mu_drive: 0.1, mu_back: 0.3}",
        mass(level=lambda t, x, v, w, s: A + (0.1 if w * s > 0 else 0.3) * abs(w)),
    ),
    "friction_drift": (
        "on: rail, parameters: {delta: -5, T: 0.6}",
        mass(level=lambda t, x, v, w, s: A - 5 * exp(-t / 0.6)),
    ),
    "dead_zone": ("on: w, parameters: {width: 1.5}", mass(effective=lambda w: dead(w, 1.5))),
    "saturation": ("on: w, parameters: {limit: 6}", mass(effective=lambda w: min(max(w, -6), 6))),
    "actuator_lag": ("on: w, parameters: {tau: 0.03}", lagging(0.03)),
}


def machine(effects: str, unit: str) -> System:
    text = ONE_MASS.format(m=M, k=0, b=0, a=A) + f"effects: [{effects}]\n"
    if unit == "rad":
        for length, angle in (("m", "rad"), ("N", "N*m"), ("kg", "kg*m^2"), ("N/m", "N*m/rad"), ("N*s/m", "N*m*s/rad")):
            text = text.replace(f"unit: {length}}}", f"unit: {angle}}}")
    spec = parse_spec(text, Path("machine.yaml"))
    return add_declared_effects(build_system(spec), spec)


def compare(effects: str, truth: Truth, unit: str = "m", substeps: int = 50, more: tuple[float, ...] = ()) -> None:
    system = machine(effects, unit)
    expected = integrate(truth, TIME, COMMAND, np.array([0.05, 0.0, *more]))
    start = np.array([0.05]), np.zeros(1)
    x, v = simulate_open_loop(system, TIME, COMMAND[:, None], *start, substeps=substeps)
    assert np.max(np.abs(x[:, 0] - expected[:, 0])) < 1e-5
    assert np.max(np.abs(v[:, 0] - expected[:, 1])) < 1e-4
    plain, _ = simulate_open_loop(machine("", unit), TIME, COMMAND[:, None], *start)
    assert np.max(np.abs(plain[:, 0] - expected[:, 0])) > 0.005


@pytest.mark.parametrize("kind", CASES)
def test_motion_with_one_effect(kind: str) -> None:
    declared, truth = CASES[kind]
    unit = "rad" if kind == "gravity_imbalance" else "m"
    compare(f"{{kind: {kind}, {declared}}}", truth, unit, more=(COMMAND[0],) if kind == "actuator_lag" else ())


def test_the_chain_has_one_order_however_declared() -> None:
    """gain → dead zone → saturation → lag, declared the other way round."""

    def effective(w: float) -> float:
        return min(max(dead(1.2 * w, 2), -7), 7)

    compare(CHAIN, lagging(0.05, effective), more=(effective(COMMAND[0]),))
