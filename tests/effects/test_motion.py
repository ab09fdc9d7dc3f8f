"""Effects simulated on one mass against SciPy with events, written from effects.md."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, pi, sin
from pathlib import Path

import numpy as np
import pytest

from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.simulate.closed_loop import simulate
from codegen.simulate.sensors import SensorError
from codegen.spec import parse_spec
from tests.machines import SPRING_MASS
from tests.simulate.open_loop import simulate_open_loop

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


STIFF = "k: 900, c: 6, load_fraction: 0.6"
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
FORMS = {
    "position_dependent_friction": (
        "on: rail, parameters: {amplitude: 1.5, period: 0.11, phase: 0.7, amplitude_2: 0.8, phase_2: -2}",
        mass(level=lambda t, x, v, w, s: A + 1.5 * sin(2 * pi * x / 0.11 + 0.7) + 0.8 * sin(4 * pi * x / 0.11 - 2)),
    ),
    "stribeck": (
        "on: rail, parameters: {delta: 3, v_s: 0.2, exponent: 1}",
        mass(level=lambda t, x, v, w, s: A + 3 * exp(-abs(v) / 0.2)),
    ),
    "viscous": (
        "on: rail, parameters: {b: 9, v_s: 0.2, b_inf: 1.5}",
        mass(lambda t, x, v, w: -9 * 0.2 * np.sign(v) * np.log1p(abs(v) / 0.2) - 1.5 * v),
    ),
}


def machine(effects: str, unit: str, spring: float = 0.0) -> System:
    text = SPRING_MASS.format(m=M, k=spring, b=0, a=A) + f"effects: [{effects}]\n"
    if unit == "rad":
        for length, angle in (("m", "rad"), ("N", "N*m"), ("kg", "kg*m^2"), ("N/m", "N*m/rad"), ("N*s/m", "N*m*s/rad")):
            text = text.replace(f"unit: {length}}}", f"unit: {angle}}}")
    spec = parse_spec(text, Path("machine.yaml"))
    return add_declared_effects(build_system(spec), spec)


def dahl(sigma: float) -> Truth:
    """The third state is z."""
    return Truth(
        lambda t, y, w, friction: [y[1], (w - friction) / M, y[1] - sigma / A * y[2] * abs(y[1])],
        lambda t, y, w: w,
        None,
        lambda t, y, w: sigma * y[2],
    )


def two_inertias(
    k: float, c: float, share: float, gap: float = 0.0, at_motor: float = 0.0, spring: float = 0.0
) -> Truth:
    """y = (x, v, load's position, load's velocity); a constant force at the motor, a spring to ground at the load."""

    def between(y) -> float:
        dx, dv = y[0] - y[2], y[1] - y[3]
        if gap == 0:
            return k * dx + c * dv
        depth = abs(dx) - gap / 2
        return np.sign(dx) * max(0.0, k * depth + c * np.sign(dx) * dv) if depth > 0 else 0.0

    return Truth(
        lambda t, y, w, friction: [
            y[1],
            (w + at_motor - between(y) - friction) / ((1 - share) * M),
            y[3],
            (between(y) - spring * y[2]) / (share * M),
        ],
        lambda t, y, w: w + at_motor - between(y),
        lambda t, y, w, s: A,
    )


def compare(
    effects: str,
    truth: Truth,
    unit: str = "m",
    substeps: int = 50,
    more: tuple[float, ...] = (),
    spring: float = 0.0,
) -> None:
    system = machine(effects, unit, spring)
    expected = integrate(truth, TIME, COMMAND, np.array([0.05, 0.0, *more]))
    start = np.array([0.05]), np.zeros(1)
    x, v = simulate_open_loop(system, TIME, COMMAND[:, None], *start, substeps=substeps)
    assert np.max(np.abs(x[:, 0] - expected[:, 0])) < 1e-5
    assert np.max(np.abs(v[:, 0] - expected[:, 1])) < 1e-4
    plain, _ = simulate_open_loop(machine("", unit, spring), TIME, COMMAND[:, None], *start)
    assert np.max(np.abs(plain[:, 0] - expected[:, 0])) > 0.005


@pytest.mark.parametrize(("kind", "case"), [*CASES.items(), *FORMS.items()])
def test_motion_with_one_effect(kind: str, case: tuple[str, Truth]) -> None:
    declared, truth = case
    unit = "rad" if kind == "gravity_imbalance" else "m"
    compare(f"{{kind: {kind}, {declared}}}", truth, unit, more=(COMMAND[0],) if kind == "actuator_lag" else ())


def test_the_chain_has_one_order_however_declared() -> None:
    """gain → dead zone → saturation → lag, declared the other way round."""

    def effective(w: float) -> float:
        return min(max(dead(1.2 * w, 2), -7), 7)

    compare(CHAIN, lagging(0.05, effective), more=(effective(COMMAND[0]),))


def test_presliding() -> None:
    compare("{kind: presliding, on: rail, parameters: {sigma: 400}}", dahl(400), more=(0.0,))


def test_compliance() -> None:
    compare(f"{{kind: compliance, on: x, parameters: {{{STIFF}}}}}", two_inertias(900, 6, 0.6), more=(0.05, 0.0))


def test_backlash() -> None:
    truth = two_inertias(900, 6, 0.6, gap=0.02)
    compare(f"{{kind: backlash, on: x, parameters: {{gap: 0.02, {STIFF}}}}}", truth, more=(0.05, 0.0), substeps=400)


def test_the_force_of_another_effect_acts_at_the_motor_and_a_declared_one_at_the_load() -> None:
    truth = two_inertias(900, 6, 0.6, at_motor=1.3, spring=40.0)
    both = [f"{{kind: compliance, on: x, parameters: {{{STIFF}}}}}", "{kind: offset, on: x, parameters: {f0: 1.3}}"]
    for effects in (both, both[::-1]):
        compare(", ".join(effects), truth, more=(0.05, 0.0), spring=40.0)


def test_an_eccentric_encoder_is_read_wrong_and_put_right() -> None:
    system = machine(
        "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.004, period: 0.06, phase: 0.5}}", "m"
    )
    scale, x = SensorError(system), np.linspace(-0.2, 0.3, 501)[:, None]
    readings = scale.measured(x)
    np.testing.assert_allclose(readings, x + 0.004 * np.sin(2 * pi * x / 0.06 + 0.5), rtol=0, atol=1e-15)
    np.testing.assert_allclose(scale.true(readings), x, rtol=0, atol=1e-14)
    rates = (scale.measured(x + 1e-6) - scale.measured(x - 1e-6)) / 2e-6  # at unit speed
    np.testing.assert_allclose(scale.true_velocities(x, rates), 1, atol=1e-7)


def test_a_log_in_a_loop_holds_the_readings() -> None:
    """Simulated by the section of a spec: readings are the true positions through the sensor."""
    effects = "effects: [{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.004, period: 0.06, phase: 0.5}}]"
    drive = "simulation: {duration: 2, sample_time: 0.01, inputs: {w: 9*sin(5*t)}}"
    spec = parse_spec(SPRING_MASS.format(m=M, k=0, b=0, a=A) + f"{effects}\n{drive}\n", Path("machine.yaml"))
    run = simulate(spec, add_declared_effects(build_system(spec), spec))
    x = run.true_positions
    assert np.ptp(x) > 0.1
    np.testing.assert_allclose(run.positions, x + 0.004 * np.sin(2 * pi * x / 0.06 + 0.5), rtol=0, atol=1e-14)


def test_a_stiff_spring_gets_the_steps_that_it_needs() -> None:
    """4 kHz and heavy damping: the default step of 0.1 ms would not be stable."""
    stiff = "effects: [{kind: compliance, on: x, parameters: {k: 3e8, c: 20000, load_fraction: 0.5}}]"
    drive = "simulation: {duration: 0.5, sample_time: 0.01, inputs: {w: 9*sin(5*t)}}"
    runs = []
    for effects in (stiff, ""):
        spec = parse_spec(SPRING_MASS.format(m=M, k=0, b=0, a=A) + f"{effects}\n{drive}\n", Path("machine.yaml"))
        runs.append(simulate(spec, add_declared_effects(build_system(spec), spec)).true_positions)
    assert np.ptp(runs[1]) > 0.05
    np.testing.assert_allclose(runs[0], runs[1], atol=1e-6)  # so stiff that it moves as one
