"""Where loads behind springs are while their motors move as measured, from a balance at the first sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.shooting import Shooter
from codegen.diagnosis.fit.trial import Runner, Trial
from codegen.effects.declare import add_declared_effects
from codegen.logs import read_log
from codegen.mechanics import System, build_system
from codegen.spec import Spec, parse_spec

JOINT = """\
name: joint
coordinates: {{q: {{velocity: qd, unit: rad}}}}
inputs: {{u: {{unit: N*m}}}}
parameters: {{J: {{value: 0.6, unit: kg*m^2}}, b: {{value: 1, unit: N*m*s/rad}}, G: {{value: 9, unit: N*m}}}}
mass_matrix: [[J]]
force: [u - b*qd - G*cos(q)]
friction: {{distribution: [[1]], contacts: [{{name: joint, law: coulomb, a: 3, unit: N*m}}]}}
effects: [{effects}]
"""
J, B, G, A = 0.6, 1.0, 9.0, 3.0
K, C, SHARE = 250.0, 0.4, 0.6
STEP = 1e-3


def spec_of(effects: str = "") -> Spec:
    return parse_spec(JOINT.format(effects=effects), Path("joint.yaml"))


def system_of(spec: Spec) -> System:
    return add_declared_effects(build_system(spec), spec)


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_a_weight_hangs_on_its_spring_from_the_first_sample(gap: float) -> None:
    """At rest, k (|dx| − gap/2) = G cos(q_load), by a root finder; it stays there, as nothing moves."""
    kind, more = ("backlash", f", gap: {gap}") if gap else ("compliance", "")
    effect = f"{{kind: {kind}, on: q, parameters: {{k: {K}, c: {C}, load_fraction: {SHARE}{more}}}}}"
    q = 0.3
    hanging = brentq(lambda there: K * (q - there - gap / 2) - G * np.cos(there), q - 0.2, q - gap / 2)
    system, rest, still = system_of(spec_of(effect)), np.full((2000, 1), q), np.zeros((2000, 1))
    record = Record(rest, rest, still, still, STEP, np.ones(1), np.arange(2000, dtype=np.int32), 1)
    loads = Runner(Trial(system, (), ()), Shooter([system], [()]), 0, record, 4).hidden(np.zeros(0))[0, :, 1:]
    np.testing.assert_allclose(loads[:, 0], hanging, atol=1e-6)
    np.testing.assert_allclose(loads[:, 1], 0, atol=1e-4)


def test_cogging_acts_at_the_motor_and_leaves_the_load_where_its_weight_hangs() -> None:
    """Of the force balance at rest, weight and cogging are both on the motor; the load hangs by the weight alone."""
    load = f"{{kind: compliance, on: q, parameters: {{k: {K}, c: {C}, load_fraction: {SHARE}}}}}"
    wave = "{kind: cogging, on: q, parameters: {amplitude: 4, period: 0.7, phase: 0.4}}"
    q = 0.3
    hanging = brentq(lambda there: K * (q - there) - G * np.cos(there), q - 0.2, q)
    rest, still = np.full((2000, 1), q), np.zeros((2000, 1))
    record = Record(rest, rest, still, still, STEP, np.ones(1), np.arange(2000, dtype=np.int32), 1)
    for effects in (f"{load}, {wave}", f"{wave}, {load}"):
        system = system_of(spec_of(effects))
        loads = Runner(Trial(system, (), ()), Shooter([system], [()]), 0, record, 4).hidden(np.zeros(0))[0, :, 1:]
        np.testing.assert_allclose(loads[:, 0], hanging, atol=1e-6)


def test_a_load_follows_the_true_motion_of_its_motor_and_not_an_eccentric_reading() -> None:
    """A reading q + A sin(2πq/P + φ) of the motion q(t) gives the load that q(t) itself gives."""
    load = f"{{kind: compliance, on: q, parameters: {{k: {K}, c: {C}, load_fraction: {SHARE}}}}}"
    size, period, phase = 0.006, 0.45, 0.7
    error = f"amplitude: {size}, period: {period}, phase: {phase}"
    time, turn = np.arange(3000) * STEP, 2 * np.pi / period
    true, speed = 0.5 * np.sin(3 * time), 1.5 * np.cos(3 * time)
    read = true + size * np.sin(turn * true + phase)
    read_speed = speed * (1 + size * turn * np.cos(turn * true + phase))
    found = []
    for effects, q, v in (
        (load, true, speed),
        (f"{load}, {{kind: encoder_eccentricity, on: q, parameters: {{{error}}}}}", read, read_speed),
    ):
        system = system_of(spec_of(effects))
        along, still = (q[:, None], q[:, None], v[:, None]), np.zeros((3000, 1))
        record = Record(*along, still, STEP, np.ones(1), np.arange(0, 3000, 100, dtype=np.int32), 100)
        runner = Runner(Trial(system, (), ()), Shooter([system], [()]), 0, record, 4)
        runs = runner.run(np.zeros(0), record.at_rest)
        found.append((runner.hidden(np.zeros(0))[0, :, 1:], runs))
    (loads, runs), (of_reading, readings) = found
    np.testing.assert_allclose(of_reading, loads, atol=1e-9)
    np.testing.assert_allclose(readings, runs + size * np.sin(turn * runs + phase), atol=1e-9)


def joint_log(folder: Path, name: str, frequencies: tuple[float, ...], duration: float) -> None:
    """Motor and load of a joint by scipy, from rest in a balance of drive, spring and weight; friction as a steep tanh.

    Args:
        frequencies: Hz, of 7, 5 and 2 N·m in addition to what holds the weight.
    """
    motor, load, hold = (1 - SHARE) * J, SHARE * J, G * np.cos(0.2)
    time = np.arange(round(duration / STEP)) * STEP
    drive = hold + sum(u * np.sin(2 * np.pi * f * time) for u, f in zip((7, 5, 2), frequencies, strict=True))

    def rate(t: float, y: np.ndarray, u: float) -> list[float]:
        x, v, at, speed = y
        spring = K * (x - at) + C * (v - speed)
        friction = A * np.tanh(v / 1e-3)
        return [v, (u - B * v - friction - spring) / motor, speed, (spring - G * np.cos(at)) / load]

    state = np.array([0.2 + hold / K, 0.0, 0.2, 0.0])
    rows = []
    for t, u in zip(time, drive, strict=True):
        rows.append(state)
        state = solve_ivp(rate, (t, t + STEP), state, args=(u,), method="LSODA", rtol=1e-8, atol=1e-10).y[:, -1]
    readings = np.round(np.array(rows)[:, 0] / 1.5e-5) * 1.5e-5
    table = np.column_stack([time, readings, drive])
    np.savetxt(folder / f"{name}.csv", table, delimiter=",", header="t,q,u", comments="", fmt="%.9g")


@pytest.mark.slow
def test_a_compliance_under_weight_is_found(tmp_path: Path) -> None:
    """Its load starts below its motor; started level with it, it would ring through seconds of the log and hide it."""
    joint_log(tmp_path, "train", (0.6, 1.7, 4.1), 8.0)
    joint_log(tmp_path, "test", (0.8, 2.1, 4.1), 4.0)
    spec = spec_of()
    train, test = (read_log(tmp_path / f"{name}.csv", spec) for name in ("train", "test"))
    diagnosis, _ = diagnose_log(spec, system_of(spec), train, test)
    assert [e.kind for e in diagnosis.effects] == ["compliance"], diagnosis.sentence
    found = diagnosis.effects[0].parameters
    assert found["k"] == pytest.approx(K, rel=0.05) and found["load_fraction"] == pytest.approx(SHARE, rel=0.1)
