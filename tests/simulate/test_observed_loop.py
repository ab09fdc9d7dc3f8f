"""The generated observer in the loop: compiled C and twin, its sample time, cancelling, and the loop by other means."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from codegen.base import compiler
from codegen.observers import observer_of
from codegen.replay.engine import engine_of
from codegen.simulate import observed_loop
from codegen.simulate.closed_loop import simulate
from codegen.simulate.controller import Feedback
from codegen.simulate.loop_run import write_log
from codegen.simulate.observed_loop import Cancellation, SampledLoop, run_loop
from codegen.simulate.sensors import Sensors
from tests.expected_errors import refused
from tests.machines import arm, axis, one_mass, two_mass
from tests.twin import TwinEngine

from .event_integrator import Mass, integrate

OBSERVER = """
observer:
  kind: cfo
  velocity: {velocity}
  gains: {{K_F: 20, {more}}}
  sample_time: {period}
"""
RIG = """
simulation:
  duration: {duration}
  sample_time: 0.002
  reference: {{x: 0.2*sgn(sin(4*t))}}
  inputs: {{w: 0.5*sin(20*t)}}
  position_gain: {{w: 60}}
  velocity_gain: {{w: 12}}
  input_limit: {{w: 12}}
  encoder_step: {{x: 1e-4}}
  position_noise: {{x: 2e-5}}
  observer: true
"""
TWO = """
observer: {kind: gto, velocity: estimated, gains: {K_2: -30, K_v: 80}, sample_time: 0.002}
simulation:
  duration: 1
  sample_time: 0.002
  inputs: {w: 14*sin(4*t)}
  velocity_noise: {v2: 0.003}
  observer: true
  cancel: 0.5
  cancel_delay: 2
"""


def by_twin(function, *arguments):
    """The function's result where the generated observer is the Python twin."""
    with patch("codegen.replay.engine.Engine", TwinEngine):
        return function(*arguments)


def estimated(period: float = 0.002) -> str:
    return OBSERVER.format(velocity="estimated", more="K_v: 60", period=period)


def rig(duration: float = 1.0, more: str = "", period: float = 0.002):
    return one_mass(m=1, a=4, more=estimated(period) + RIG.format(duration=duration) + more)


@pytest.mark.parametrize("cancel", ["", "  cancel: 0.9\n", "  cancel: 0.9\n  cancel_delay: 2\n"])
def test_compiled_c_and_twin_close_the_loop_with_the_same_bits(cancel: str):
    spec, system = rig(more=cancel)
    compiled, twin = simulate(spec, system), by_twin(simulate, spec, system)
    asked = ("u_cancel_w",) if cancel else ()
    assert compiled.outputs == ("v_hat", "a_hat_rail", "F_hat_rail", "F_hat_on_x", *asked)
    for name in ("estimates", "inputs", "true_positions", "positions"):
        assert np.array_equal(getattr(compiled, name), getattr(twin, name))
    assert np.max(np.abs(compiled.friction_estimate)) > 1


def test_two_coordinates_with_measured_velocities_have_the_same_bits():
    spec, system = two_mass(more=TWO)
    compiled, twin = simulate(spec, system), by_twin(simulate, spec, system)
    assert np.array_equal(compiled.estimates, twin.estimates)
    assert np.array_equal(compiled.friction, compiled.contact_forces @ np.array([[1, -1], [0, 1]]).T.T)
    assert np.std((compiled.velocities - compiled.true_velocities)[:, 1]) == pytest.approx(0.003, rel=0.1)
    assert np.all(compiled.velocities[:, 0] == compiled.true_velocities[:, 0])


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_loop_is_the_one_that_scipy_and_the_twin_close_by_hand(delay: int):
    # The same loop written out: SciPy from event to event, the twin stepped, PD on a difference, a share cancelled.
    text = "simulation: {duration: 0.6, sample_time: 0.01}\n"
    spec, system = one_mass(m=2, a=3, more=estimated(0.01) + text)
    observer = engine_of(spec, observer_of(spec), spec.code)
    reference = 0.2

    gains = {"position_gain": np.array([[40.0]]), "velocity_gain": np.array([[8.0]])}
    controller = Feedback(1, reference=lambda t: np.array([reference]), **gains)
    cancellation = Cancellation(0.7, delay)
    run = run_loop(system, SampledLoop(controller, observer, cancellation), 0.01, 60, substeps=200)

    engine = by_twin(engine_of, spec, observer_of(spec), spec.code)
    mass = Mass(2, lambda w, x, v: w, lambda speed, s: 3)
    x, v, before, difference, sent, friction = 0.0, 0.0, 0.0, 0.0, 0.0, [0.0] * delay
    for k in range(60):
        assert run.true_positions[k, 0] == pytest.approx(x, abs=1e-7)
        assert run.true_velocities[k, 0] == pytest.approx(v, abs=1e-6)
        if k == 0:
            engine.start(np.array([x, 0.0]))
        difference += ((x - before) / 0.01 - difference) / 5
        before = x
        if delay == 0:
            friction.append(engine.trial_step(np.array([[x, sent]]))[3])
        used = friction[-1] if delay == 0 else friction[-delay]
        sent = 40 * (reference - x) - 8 * difference + 0.7 * used
        estimate = engine.run(np.array([[x, sent]]))[0][0]
        if delay:
            friction.append(estimate[3])
        assert run.inputs[k, 0] == pytest.approx(sent, abs=1e-5)
        assert run.estimates[k] == pytest.approx(estimate, abs=1e-5)
        path = integrate(mass, np.array([0.0, 0.01]), np.array([sent, sent]), x, v)
        x, v = path[0][-1], path[1][-1]
    assert np.ptp(run.true_positions) > 0.1


def test_an_estimate_of_the_same_instant_is_the_one_its_step_gives():
    spec, system = rig(more="  cancel: 0.8\n")
    run = simulate(spec, system)
    inside = np.abs(run.inputs[:, 0]) < 12
    assert np.array_equal(run.cancelling, 0.8 * run.friction_estimate)
    assert np.mean(inside) > 0.5


def test_replaying_the_loops_log_gives_its_estimates():
    spec, system = rig(more="  cancel: 0.9\n  cancel_delay: 1\n")
    run = simulate(spec, system)
    engine = by_twin(engine_of, spec, observer_of(spec), spec.code)
    rows = np.hstack([run.positions, run.inputs])
    engine.start(rows[0])
    assert np.array_equal(engine.run(rows)[0], run.estimates[:, :-1])


def test_an_observer_slower_than_the_loop_sees_every_other_sample():
    spec, system = rig(period=0.004)
    run = simulate(spec, system)
    assert np.array_equal(run.estimates[:-1:2], run.estimates[1::2])
    engine = by_twin(engine_of, spec, observer_of(spec), spec.code)
    rows = np.hstack([run.positions, run.inputs])[::2]
    engine.start(rows[0])
    assert np.array_equal(engine.run(rows)[0], run.estimates[::2])


def test_cancelling_takes_the_hang_off_away():
    # PD stops where its spring force is below the friction; with most of that cancelled it stops nearer.
    errors = []
    for cancel in ("", "  cancel: 0.9\n"):
        run = simulate(*rig(1.5, more=cancel))
        late = (run.time > 0.6) & (run.time < 0.78)
        errors.append(np.max(np.abs(run.true_positions[late, 0] - 0.2)))
    assert errors[1] < 0.5 * errors[0]


def test_measured_velocity_reaches_the_observer_with_its_noise():
    text = OBSERVER.format(velocity="measured", more="", period=0.002) + RIG.format(duration=0.5)
    spec, system = one_mass(m=1, a=4, more=text + "  velocity_noise: {v: 0.01}\n")
    run = simulate(spec, system)
    assert np.std(run.velocities - run.true_velocities) == pytest.approx(0.01, rel=0.15)
    engine = by_twin(engine_of, spec, observer_of(spec), spec.code)
    rows = np.hstack([run.positions, run.velocities, run.inputs])
    engine.start(rows[0])
    assert np.array_equal(engine.run(rows)[0], run.estimates)
    # The controller has the tachometer too, not a difference of positions.
    k = 40
    target = 0.2 * np.sign(np.sin(4 * run.time[k]))
    w = 0.5 * np.sin(20 * run.time[k]) + 60 * (target - run.positions[k, 0]) - 12 * run.velocities[k, 0]
    assert run.inputs[k, 0] == pytest.approx(np.clip(w, -12, 12), abs=1e-12)


def test_sensor_noise_is_white_and_the_same_at_any_sample_time():
    sensors = Sensors(position_noise=np.array([1e-3]))
    _, system = rig()
    for period in (0.001, 0.01):
        run = run_loop(system, SampledLoop(Feedback(1), sensors=sensors, seed=3), period, 4000)
        noise = (run.positions - run.true_positions)[:, 0]
        assert np.std(noise) == pytest.approx(1e-3, rel=0.05)
        assert abs(np.mean(noise[1:] * noise[:-1])) < 0.06 * 1e-6


def test_an_integral_removes_the_error_and_rests_at_the_limit():
    _, system = one_mass(m=1, a=0, b=2)
    gains = {"position_gain": np.array([[40.0]]), "velocity_gain": np.array([[10.0]])}

    def reference(t: float) -> np.ndarray:
        return np.array([1.0])

    load = Feedback(1, lambda t: np.array([-3.0]), reference, integral_gain=np.array([[30.0]]), **gains)
    late = run_loop(system, SampledLoop(load), 0.005, 4000).true_positions[-1, 0]
    assert late == pytest.approx(1, abs=1e-6)
    limit, far = np.array([2.0]), []
    for known in (None, limit):
        controller = Feedback(1, reference=reference, integral_gain=np.array([[30.0]]), limit=known, **gains)
        far.append(run_loop(system, SampledLoop(controller, limit=limit), 0.005, 1200))
    over = [np.max(run.true_positions) - 1 for run in far]
    assert all(np.max(np.abs(run.inputs)) == 2 for run in far)
    assert over[1] < 0.3 * over[0]


def test_log_holds_the_estimates_and_measured_velocities(tmp_path: Path):
    text = OBSERVER.format(velocity="measured", more="", period=0.002) + RIG.format(duration=0.2)
    spec, system = one_mass(m=1, a=4, more=text)
    run = simulate(spec, system)
    write_log(tmp_path / "log.csv", spec, run)
    first, *lines = (tmp_path / "log.csv").read_text().splitlines()
    assert first == "t,x,v,w,a_hat_rail,F_hat_rail,F_hat_on_x"
    assert float(lines[50].split(",")[-1]) == pytest.approx(run.friction_estimate[50, 0], rel=1e-8)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (estimated() + RIG.format(duration=1) + "  cancel: 90\n", "SPEC007 simulation.cancel: 90"),
        (estimated() + RIG.format(duration=1) + "  cancel_delay: -1\n", "SPEC007 simulation.cancel_delay: -1"),
        (
            estimated() + RIG.format(duration=1).replace("observer: true", "cancel: 1"),
            "SPEC024 simulation.cancel: `cancel`",
        ),
        (estimated(0.003) + RIG.format(duration=1), "SPEC024 simulation.sample_time: 0.002 0.003"),
        (RIG.format(duration=1), "SPEC029 `observer:`"),
        (RIG.format(duration=1) + "  velocity_noise: {x: 1}\n", "SPEC008 velocity_noise.x: `x`"),
    ],
)
def test_what_cannot_be_observed_is_refused(more: str, expected: str):
    with refused(expected):
        simulate(*one_mass(m=1, a=4, more=more))


def test_an_observer_of_another_machine_is_refused():
    spec, _ = rig()
    _, system = two_mass()
    with pytest.raises(ValueError, match="'x' is not in list"):
        run_loop(system, SampledLoop(Feedback(1), engine_of(spec, observer_of(spec), spec.code)), 0.002, 10)


def test_peeking_leaves_the_observer_as_it_is():
    spec, _ = rig()
    rows = np.column_stack([0.1 * np.sin(np.arange(40.0)), np.cos(np.arange(40.0))])
    for make in (engine_of, partial(by_twin, engine_of)):
        observer = make(spec, observer_of(spec), spec.code)
        observer.start(rows[0])
        plain = observer.run(rows)[0]
        observer.start(rows[0])
        peeked, stepped = [], []
        for row in rows:
            peeked.append(observer.trial_step(row[None] * [1, 0]))
            observer.trial_step(np.full((1, 2), np.nan))
            stepped.append(observer.run(row[None])[0][0])
        assert np.array_equal(np.array(stepped), plain)
        assert np.array_equal(np.array(peeked), plain)


JOINTED = "effects: [{kind: compliance, on: x, parameters: {k: 900, c: 2, load_fraction: 0.4}}]\n"
PLANTS = {
    "two contacts": lambda: two_mass()[1],
    "sines": lambda: arm(a=0.05)[1],
    "bristle": lambda: axis("law: lugre, sigma_0: 1e5, sigma_1: 300, sigma_2: 0.4, F_c: 2, F_s: 3, v_s: 0.01")[1],
    "load": lambda: one_mass(more=JOINTED)[1],
}


@pytest.mark.parametrize("name", PLANTS)
def test_a_compiled_plant_has_the_bits_of_the_interpreted_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no compiler, the run is the interpreted one."""
    system = PLANTS[name]()
    m = len(system.inputs)
    drive = Feedback(m, feedforward=lambda t: 9 * np.sin(5 * t + np.arange(m)))
    calls, compiled = [], observed_loop.compiled_in_place

    def prepared(*arguments):
        calls.append(compiled(*arguments))
        return calls[-1]

    monkeypatch.setattr(observed_loop, "compiled_in_place", prepared)
    interpreted = run_loop(system, SampledLoop(drive), 0.004, 150, substeps=8)
    monkeypatch.setattr(observed_loop, "WORTH_COMPILING", 0)
    runs = [run_loop(system, SampledLoop(drive), 0.004, 150, substeps=8)]
    monkeypatch.setenv("CC", "/nowhere/cc")
    compiler.loaded.cache_clear()
    runs.append(run_loop(system, SampledLoop(drive), 0.004, 150, substeps=8))
    assert len(calls) == 2 and isinstance(calls[0][0], tuple) and not isinstance(calls[1][0], tuple)
    assert np.ptp(interpreted.true_positions) > 1e-3
    for run in runs:
        for found, expected in ((run.true_positions, interpreted.true_positions), (run.friction, interpreted.friction)):
            assert np.array_equal(found, expected)
