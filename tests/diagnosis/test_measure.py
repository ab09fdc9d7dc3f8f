"""What share of the drive a force is: the same on either side of a gear, one number for newtons and newton metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base import compiler
from codegen.diagnosis.fit.measure import (
    RESTART_S,
    Drive,
    force_errors,
    free_run_errors,
    free_run_series,
    measure,
    restart_within_reach,
)
from codegen.diagnosis.fit.signals import Motion, smooth_motion
from codegen.diagnosis.verdict.admission import is_shown_worse, worsened
from codegen.effects.declare import add_declared_effects
from codegen.logs import Log
from codegen.mechanics import System, build_system
from codegen.mechanics.system import with_loads
from codegen.spec import parse_spec
from tests.simulate.open_loop import simulate_open_loop

RATIO, ROTOR, LOAD = 51.0, 1.25e-4, 0.42
JOINT = """\
name: joint
coordinates: {{q: {{velocity: qd, unit: rad}}, p: {{velocity: pd, unit: rad}}}}
inputs: {{i: {{unit: A}}}}
parameters:
  kt: {{value: 0.072, unit: N*m/A}}
  k: {{value: 4, unit: N*m/rad}}
  J: {{value: {rotor}, unit: kg*m^2}}
  L: {{value: {load}, unit: kg*m^2}}
mass_matrix: [[J, 0], [0, L]]
force: [kt*i - k*(q - {gear}*p), {gear}*k*(q - {gear}*p)]
friction: {{distribution: [[1], [0]], contacts: [{{name: motor, law: coulomb, a: 0.05, unit: N*m}}]}}
"""
ONE = """\
name: one
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 1, unit: N}]}
"""


def test_a_refit_of_a_level_is_simulated_by_the_code_of_the_declared_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulated error is that of the plant with this level; nothing is compiled for it."""
    time = np.arange(0, 6, 0.002)
    w = (9 * np.sin(4 * time) + 3 * np.sin(9.1 * time))[:, None]
    declared, refit = (build_system(parse_spec(ONE.replace("a: 1", f"a: {a}"), Path("one.yaml"))) for a in ("1", "3"))
    x, _ = simulate_open_loop(refit, time, w, np.zeros(1), np.zeros(1))
    log = smooth_motion(Log(Path("a.csv"), "a", time, x, None, w, 0.002, 20.0, None, None, ()))
    wrong = free_run_series(declared, log)
    sources: list[str] = []
    monkeypatch.setattr(compiler, "cached_library", lambda *given: sources.append("compiled"))
    error = free_run_series(refit, log)
    assert not sources
    assert np.nanmax(np.abs(error)) < 0.02 * np.nanmax(np.abs(wrong))


TWO = """\
name: two
coordinates: {x: {velocity: v, unit: m}, y: {velocity: u, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0], [0, m]]
force: [w, 0.01*w]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: a, law: coulomb, a: A, unit: N}, {name: b, law: coulomb, a: B, unit: N}]
"""


def test_a_joint_whose_reading_never_changes_refuses_no_values() -> None:
    """Of an arm that moves one joint at a time: others stick as declared, and slip a little with a refit."""
    plant, declared, refit = (
        build_system(parse_spec(TWO.replace("A", a).replace("B", b), Path("two.yaml")))
        for a, b in (("3", "1"), ("1", "1"), ("3", "0.05"))
    )
    time = np.arange(0, 6, 0.002)
    w = (9 * np.sin(4 * time) + 3 * np.sin(9.1 * time))[:, None]
    x, _ = simulate_open_loop(plant, time, w, np.zeros(2), np.zeros(2))
    assert not x[:, 1].any()
    motion = smooth_motion(Log(Path("a.csv"), "a", time, x, None, w, 0.002, 20.0, None, None, ()))
    used = np.repeat(motion.usable[:, None], 2, axis=1)
    ours, theirs = (measure(system, motion, used, slice(None)) for system in (refit, declared))
    assert np.isnan(ours.free_run_rmse_rows[1]) and ours.free_run_rmse == ours.free_run_rmse_rows[0] > 0
    assert not worsened(ours, theirs)
    assert not is_shown_worse(ours, theirs)
    assert restart_within_reach(plant, motion, slice(None)) == RESTART_S


FLEXIBLE = (
    ONE.replace("{", "{{").replace("}", "}}")
    + "effects: [{{kind: compliance, on: x, parameters: {{k: {k}, c: 0.1, load_fraction: 0.5}}}}]\n"
)


@pytest.mark.parametrize(("wrong", "begun", "most"), [(1.0, 0.04, 0.15), (1.004, 0.0, 0.01)])
def test_the_state_of_a_load_is_estimated_after_each_restart(wrong: float, begun: float, most: float) -> None:
    """A load that swings as the log begins, or a stiffness 0.4 % off: by following the motor its phase is not known.

    The plant is simulated with the load as a coordinate of its own.
    """

    def flexible(k: float) -> System:
        spec = parse_spec(FLEXIBLE.format(k=k), Path("flexible.yaml"))
        return add_declared_effects(build_system(spec), spec)

    time = np.arange(0, 12, 0.002)
    w = (6 * np.sin(4 * time) + 3 * np.sin(9.1 * time) + np.sin(37 * time))[:, None]
    x, _ = simulate_open_loop(with_loads(flexible(2000.0)), time, w, np.array([0.0, begun]), np.zeros(2))
    log = smooth_motion(Log(Path("a.csv"), "a", time, x[:, :1], None, w, 0.002, 20.0, None, None, ()))
    rigid = build_system(parse_spec(ONE, Path("one.yaml")))
    without, found = (free_run_errors(system, log, slice(None))[0][0] for system in (rigid, flexible(wrong * 2000.0)))
    assert found < most * without


def joint(gear: float = RATIO, load: float = LOAD) -> System:
    """A rotor and a load behind a gear; ``gear`` is rotor angle over the load's coordinate."""
    return build_system(parse_spec(JOINT.format(rotor=ROTOR, load=load, gear=gear), Path("joint.yaml")))


def motion(scale: float) -> Motion:
    """Of rotor and load, the load's coordinate counted in ``scale`` per radian of the load."""
    t = np.arange(4000) * 0.002
    load = 0.4 * np.sin(2 * np.pi * 0.5 * t)
    q = RATIO * load + 0.01 * np.sin(2 * np.pi * 2 * t)
    current = np.cos(2 * np.pi * 0.7 * t)[:, None]
    log = Log(Path("a.csv"), "a", t, np.column_stack([q, scale * load]), None, current, 0.002, 20.0, None, None, ())
    return smooth_motion(log)


def test_a_force_behind_a_gear_is_the_same_share_by_the_rotors_turns_as_by_the_loads() -> None:
    wave = 0.3 * np.sin(np.arange(4000) / 90)
    load_side, rotor_side = motion(1.0), motion(RATIO)
    by_load = Drive(joint(), load_side).share(np.column_stack([0 * wave, wave]))
    # In turns of the rotor the load's inertia is L/n², and a torque on it τ/n.
    reflected = Drive(joint(1.0, LOAD / RATIO**2), rotor_side).share(np.column_stack([0 * wave, wave / RATIO]))
    assert by_load == pytest.approx(reflected, rel=1e-9)
    used = load_side.usable
    drive = 0.072 * load_side.inputs[used, 0]
    assert by_load == pytest.approx(np.sqrt((wave[used] ** 2).mean() / LOAD / ((drive**2).mean() / ROTOR)), rel=1e-2)


def test_so_is_the_relative_force_error() -> None:
    everything = np.ones((4000, 2), dtype=bool)
    window = slice(300, 3700)
    one = force_errors(joint(), motion(1.0), everything, window)
    other = force_errors(joint(1.0, LOAD / RATIO**2), motion(RATIO), everything, window)
    assert one[2] == pytest.approx(other[2], rel=1e-9)
    assert one[0] == pytest.approx((other[0][0], RATIO * other[0][1]), rel=1e-9)


def test_on_one_coordinate_the_norm_is_the_rms() -> None:
    system = build_system(parse_spec(ONE, Path("one.yaml")))
    t = np.arange(3000) * 0.002
    x, w = np.sin(3 * t)[:, None], 5 * np.cos(2 * t)[:, None]
    moved = smooth_motion(Log(Path("a.csv"), "a", t, x, None, w, 0.002, 20.0, None, None, ()))
    force = np.cos(t)[:, None] ** 3
    drive = moved.low_pass(moved.inputs)[moved.usable]
    share = np.sqrt((force[moved.usable] ** 2).sum() / (drive**2).sum())
    assert Drive(system, moved).share(force) == pytest.approx(share, rel=1e-12)


def pushed(force: float) -> tuple[System, Motion]:
    """A mass that moves with 0.3 sin 2t, and a model of it that feels this force, which is not there."""
    t = np.arange(5000) * 0.002
    position, acceleration = 0.3 * np.sin(2 * t), -1.2 * np.sin(2 * t)
    command = 2 * acceleration + force * np.cos(2 * t)
    log = Log(Path("a.csv"), "a", t, position[:, None], None, command[:, None], 0.002, 20.0, None, None, ())
    return build_system(parse_spec(ONE.replace("a: 1,", "a: 0,"), Path("one.yaml"))), smooth_motion(log)


@pytest.mark.parametrize(("force", "restart"), [(0.5, 0.5), (20.0, 0.25), (1e4, 0.25)])
def test_free_runs_are_restarted_before_they_leave_the_motion(force: float, restart: float) -> None:
    """An error of ½ (F/m) T² by a way of 0.6 T at most: near for 0.5 N over 0.5 s, far for 20 N."""
    system, motion_of_it = pushed(force)
    assert restart_within_reach(system, motion_of_it, slice(0, 5000)) == restart
    assert restart_within_reach(system, motion_of_it, slice(0, 5000), 0.25) == min(restart, 0.25)
