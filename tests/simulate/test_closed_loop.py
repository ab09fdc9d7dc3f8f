"""Closed loops: control, encoder, noise, limits and delay as declared; logs written whole or not at all."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.simulate.sensors import VELOCITY_FILTER_SAMPLES, Sensors
from tests.expected_errors import refused
from tests.machines import arm, one_mass, read_machine, two_mass
from tests.simulate.open_loop import simulate_open_loop

EARLIER = 20
"""Samples without a command before a recorded log."""
OPEN = "simulation: {duration: 2, sample_time: 0.002, inputs: {w: 9*sin(5*t)}}\n"
FOLLOW = """
simulation:
  duration: 4
  sample_time: 0.002
  reference: {x: 0.1*sin(3*t) + 0.2}
  inputs: {w: 0.5*sin(20*t)}
  position_gain: {w: 2000}
  velocity_gain: {w: 80}
  input_limit: {w: 12}
  encoder_step: {x: 1e-4}
  position_noise: {x: 2e-4}
  seed: 5
"""
DELAY = "effects: [{kind: input_delay, on: w, parameters: {T: 0.0033}}]\n"


def simulation(**sections: str) -> str:
    lines = "".join(f"  {name}: {{{value}}}\n" for name, value in sections.items())
    return f"simulation:\n  duration: 0.5\n  sample_time: 0.002\n{lines}"


def test_open_loop_is_what_replaying_its_inputs_gives():
    spec, system = one_mass(k=20, more=OPEN)
    log = simulate(spec, system)
    assert np.allclose(log.inputs[:, 0], 9 * np.sin(5 * log.time), atol=1e-13)
    assert np.array_equal(log.positions, log.true_positions)
    x, v = simulate_open_loop(system, log.time, log.inputs, np.zeros(1), np.zeros(1), substeps=20)
    assert np.allclose(x, log.true_positions, atol=1e-12)
    assert np.allclose(v, log.true_velocities, atol=1e-12)
    assert log.contact_forces.shape == (1000, 1)


def test_delay_holds_nothing_before_the_start():
    spec, system = one_mass(k=20, more=DELAY + OPEN.replace("sin(5*t)", "cos(5*t)"))
    log = simulate(spec, system)
    early = log.time[1] * np.arange(-EARLIER, len(log.time))
    before = np.vstack([np.zeros((EARLIER, 1)), log.inputs])
    x, _ = simulate_open_loop(system, early, before, np.zeros(1), np.zeros(1), substeps=100)
    assert np.allclose(x[EARLIER:], log.true_positions, atol=2e-8)


def test_commands_pass_the_actuators_chain_in_a_loop():
    """Sample by sample as over a recorded log; a lag behind a delay that is no whole number of substeps among them."""
    stages = ("input_delay, on: w, parameters: {T: 0.0033}", "input_gain, on: w, parameters: {gain: 1.3}")
    stages += ("dead_zone, on: w, parameters: {width: 1.5}", "saturation, on: w, parameters: {limit: 8}")
    stages += ("actuator_lag, on: w, parameters: {tau: 0.02}",)
    effects = "effects: [" + ", ".join(f"{{kind: {stage}}}" for stage in stages) + "]\n"
    spec, system = one_mass(k=20, more=effects + OPEN.replace("sin(5*t)", "cos(5*t)"))
    log = simulate(spec, system)
    early = log.time[1] * np.arange(-EARLIER, len(log.time))
    before = np.vstack([np.zeros((EARLIER, 1)), log.inputs])
    x, _ = simulate_open_loop(system, early, before, np.zeros(1), np.zeros(1), substeps=100)
    assert np.allclose(x[EARLIER:], log.true_positions, atol=2e-7)


def test_control_follows_within_limits_and_measures_as_declared():
    spec, system = one_mass(m=1, a=2, more=FOLLOW)
    log = simulate(spec, system)
    reference = 0.1 * np.sin(3 * log.time) + 0.2
    assert log.true_positions[0, 0] == reference[0]
    assert np.max(np.abs(log.true_positions[:, 0] - reference)) < 0.03
    assert np.max(np.abs(log.inputs)) == 12
    steps = log.positions / 1e-4
    assert np.allclose(steps, np.round(steps), atol=1e-9)
    noise = np.std(log.positions - log.true_positions)
    assert noise == pytest.approx(np.hypot(2e-4, 1e-4 / np.sqrt(12)), rel=0.1)


def test_command_is_the_declared_law():
    spec, system = one_mass(m=1, a=2, more=FOLLOW)
    log = simulate(spec, system)
    measured, velocity = log.positions[:, 0], 0.0
    for k in range(1, 500):
        difference = (measured[k] - measured[k - 1]) / 0.002
        velocity += (difference - velocity) / (1 + VELOCITY_FILTER_SAMPLES)
        target = 0.1 * np.sin(3 * log.time[k]) + 0.2
        w = 0.5 * np.sin(20 * log.time[k]) + 2000 * (target - measured[k]) - 80 * velocity
        assert log.inputs[k, 0] == pytest.approx(np.clip(w, -12, 12), abs=1e-9)


def test_same_seed_same_bytes(tmp_path: Path):
    spec, system = one_mass(m=1, a=2, more=FOLLOW)
    for name in ("one", "two"):
        write_log(tmp_path / f"{name}.csv", spec, simulate(spec, system))
    other, _ = one_mass(m=1, a=2, more=FOLLOW.replace("seed: 5", "seed: 6"))
    write_log(tmp_path / "other.csv", other, simulate(other, system))
    one, two, third = ((tmp_path / f"{n}.csv").read_bytes() for n in ("one", "two", "other"))
    assert one == two != third
    assert one.startswith(b"t,x,w\n0,")
    rows = np.loadtxt(tmp_path / "one.csv", delimiter=",", skiprows=1)
    assert rows.shape == (2000, 3)
    assert rows[5, 0] == 0.01
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.csv", "other.csv", "two.csv"]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    spec, system = one_mass(more=OPEN)
    log = simulate(spec, system)
    path = tmp_path / "log.csv"
    path.write_text("old")

    def full(file, *_, **__):
        file.write("0,0")
        raise OSError("no space left")

    monkeypatch.setattr(np, "savetxt", full)
    with pytest.raises(OSError, match="no space"):
        write_log(path, spec, log)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_progress_rises_to_one():
    told: list[float] = []
    simulate(*one_mass(more=OPEN), told.append)
    assert told == sorted(told)
    assert told[-1] == 1
    assert len(told) > 5


def test_references_of_an_arm_and_of_an_underactuated_machine():
    both = simulation(reference="q1: 0.5, q2: 0.2", position_gain="u1: 5, u2: 2", velocity_gain="u1: 1, u2: 0.2")
    log = simulate(*arm(more=both))
    assert np.allclose(log.true_positions[0], [0.5, 0.2])
    second = simulation(reference="x2: 0.1*t", position_gain="w: 5000", velocity_gain="w: 100")
    log = simulate(*two_mass(more=second))
    assert log.true_positions[-1, 1] > 0.02
    named = simulation(reference="w: 0.1*t", position_gain="w: 50")
    assert simulate(*one_mass(more=named)).inputs[-1, 0] > 0


def test_machine_without_inputs_or_friction_forces():
    log = simulate(*one_mass(a=0, more="simulation: {duration: 0.1, sample_time: 0.01}"))
    assert np.all(log.true_positions == 0)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("", "SPEC029 `simulation:`"),
        (simulation(reference="x: t"), "SPEC025 simulation.reference.x: `position_gain:"),
        (simulation(reference="x: t, w: t", position_gain="w: 1"), "SPEC025 simulation.reference.w: `w`"),
        (simulation(position_gain="w: 1"), "SPEC025 simulation.position_gain.w: `reference:`"),
        (simulation(reference="x: t", position_gain="w: -1e9"), "SPEC034"),
    ],
)
def test_what_cannot_be_simulated_is_refused(more: str, expected: str):
    with refused(expected):
        simulate(*one_mass(more=more))


TABLE = """\
name: table
coordinates:
  x: {{velocity: v, unit: m}}
  y: {{velocity: s, unit: m}}
  z: {{velocity: u, unit: m}}
inputs:
  Fy: {{unit: N}}
  Fx: {{unit: N}}
parameters:
  m: {{value: 2, unit: kg}}
mass_matrix: [[m, 0, 0], [0, m, 0], [0, 0, m]]
force: [Fx, Fy, {third}]
friction:
  distribution: [[1, 0], [0, 1], [0, 0]]
  contacts:
    - {{name: a, law: coulomb, a: 1, unit: N}}
    - {{name: b, law: coulomb, a: 1, unit: N}}
"""


def test_a_reference_is_followed_by_the_input_that_acts_on_its_coordinate():
    """Inputs in another order than coordinates; by index x would be driven away to 266 m."""
    gains = "Fx: 800, Fy: 800", "Fx: 60, Fy: 60"
    for reference in ("x: 0.1, y: -0.05", "Fx: 0.1, Fy: -0.05"):
        more = simulation(reference=reference, position_gain=gains[0], velocity_gain=gains[1])
        log = simulate(*read_machine(TABLE.format(third="0") + more))
        assert log.true_positions[-1] == pytest.approx([0.1, -0.05, 0], abs=3e-3)


@pytest.mark.parametrize(
    ("reference", "third", "found"),
    [
        ("z", "0", "`z`, on which no input acts; expected one for `y` (by `Fy`) or `x` (by `Fx`)"),
        ("z", "Fx + Fy", "`z`, on which `Fy` and `Fx` act"),
        ("Fx", "Fx", "`Fx`: on `x` and `z`"),
    ],
)
def test_a_reference_that_no_single_input_moves_is_refused(reference: str, third: str, found: str):
    gain = "Fx: 800, Fy: 800"
    spec, system = read_machine(TABLE.format(third=third) + simulation(reference=f"{reference}: 0", position_gain=gain))
    with pytest.raises(BadInput, match=re.escape(found)):
        simulate(spec, system)


@pytest.mark.parametrize(
    ("steps", "read"),
    [([0.1, 0.0], [0.3, 0.26]), ([0.1, 0.5], [0.3, 0.5]), ([0.0, 0.0], [0.26, 0.26]), ([0.1], [0.3, 0.3])],
)
def test_positions_are_rounded_to_the_steps_of_those_that_have_some(steps: list[float], read: list[float]) -> None:
    sensors = Sensors(encoder_step=np.array(steps))
    for _ in range(2):
        np.testing.assert_allclose(sensors.encoded(np.array([0.25, 0.25]), np.full(2, 0.01)), read, rtol=1e-12)
