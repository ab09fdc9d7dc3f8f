"""The event-driven reference: modes found and proven; against optimisation, closed forms, SciPy, the time stepper."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from codegen.mechanics.system import with_loads
from codegen.simulate.controller import Feedback
from codegen.simulate.observed_loop import SampledLoop, run_loop
from tests.machines import SPRING_MASS, arm, effect, one_mass, read_machine, two_mass
from tests.simulate.open_loop import free_run_from_rest, simulate_open_loop
from tests.slow_cases import examples, slow_except

from .event_integrator import Mass, integrate
from .event_plant import EventPlant
from .mode_search import Limits, NoMode, find_mode

GRAVITY = "  g: {value: 9.81, unit: m/s^2}\nmass_matrix"
STACK = """
name: stack
coordinates:
  x1: {velocity: v1, unit: m}
  x2: {velocity: v2, unit: m}
  x3: {velocity: v3, unit: m}
inputs:
  w: {unit: N}
parameters:
  m1: {value: 100, unit: kg}
  m2: {value: 1, unit: kg}
  m3: {value: 30, unit: kg}
  g: {value: 0.98, unit: m/s^2}
mass_matrix: [[m1, 0, 0], [0, m2, 0], [0, 0, m3]]
force: [m1*g + w, m2*g, m3*g]
friction:
  distribution: [[1, 0, 0], [-1, 1, 0], [0, -1, 1]]
  contacts:
    - {name: upper, law: coulomb, a: 100, unit: N}
    - {name: middle, law: coulomb, a: 101, unit: N}
    - {name: ground, law: coulomb, a: 130, unit: N}
"""


def slope(angle: float, m: float, a: float):
    """A mass on a slope, held by a force of more than what pulls it down."""
    text = SPRING_MASS.replace("force: [w - k*x - b*v]", f"force: [w + m*g*sin({angle})]").replace(
        "mass_matrix", GRAVITY.replace("{", "{{").replace("}", "}}")
    )
    return read_machine(text.format(m=m, a=a, k=0, b=0))[1]


def by_events(system, time, w, x0=None):
    """(N, 2 n) states at ``time`` under held commands (N, m), the forces λ (N, contacts), and the plant."""
    n = system.degrees_of_freedom
    plant = EventPlant(system, time[1] - time[0], np.zeros(n) if x0 is None else np.asarray(x0), np.zeros(n))
    states, forces = [], []
    for t, command in zip(time, w, strict=True):
        states.append(plant.state.copy())
        plant.move(t, np.atleast_1d(command))
        forces.append(plant.forces.copy())
    return np.array(states), np.array(forces), plant


@settings(deadline=None, max_examples=examples(60))
@given(seed=st.integers(0, 10**6), count=st.integers(1, 4), scale=st.floats(0.1, 30))
def test_the_mode_at_rest_is_the_one_that_dissipation_chooses(seed: int, count: int, scale: float):
    # Coulomb at rest: λ minimises ½ λ'Aλ − free'λ over its box, a convex problem that SciPy solves with no modes.
    random = np.random.default_rng(seed)
    root = random.normal(size=(count, count))
    A, free, level = (
        root @ root.T + 0.1 * np.eye(count),
        scale * random.normal(size=count),
        random.uniform(0.1, 5, count),
    )
    mode = find_mode([0] * count, range(count), free, A, Limits(level, level, level, level))
    lower = np.linalg.cholesky(A)
    best = lsq_linear(lower.T, np.linalg.solve(lower, free), bounds=(-level, level), method="bvls", tol=1e-14)
    assert mode.forces == pytest.approx(best.x, abs=1e-5 * scale)
    assert mode.accelerations == pytest.approx(free - A @ best.x, abs=1e-4 * scale)
    # The proof: every inequality of the mode, as the law has it.
    for way, force, rate, bound in zip(mode.directions, mode.forces, free - A @ mode.forces, level, strict=True):
        assert abs(force) <= bound * (1 + 1e-8)
        assert (way == 0 and abs(rate) < 1e-9 * scale * 100) or (way * rate >= 0 and force == way * bound)


def test_contacts_that_depend_on_each_other_share_a_load_and_move_as_one():
    # Two contacts at one place: U has two equal columns, U'M⁻¹U is singular, the sum of the forces is what counts.
    level = np.array([2.0, 3.0])
    limits = Limits(level, level, level, level)
    A = np.ones((2, 2)) / 4
    held = find_mode([0, 0], [0, 1], np.full(2, 4.9 / 4), A, limits)
    assert held.directions == (0, 0)
    assert np.sum(held.forces) == pytest.approx(4.9) and np.all(np.abs(held.forces) <= level * (1 + 1e-9))
    moved = find_mode([0, 0], [0, 1], np.full(2, 7.0 / 4), A, limits)
    assert moved.directions == (1, 1)
    assert moved.accelerations == pytest.approx([0.5, 0.5])


def test_two_contacts_of_one_slide_against_one_with_both_levels():
    text = SPRING_MASS.replace("distribution: [[1]]", "distribution: [[1, 1]]").replace(
        "{{name: rail, law: coulomb, a: {a}, unit: N}}",
        "{{name: rail, law: coulomb, a: 1, unit: N}}\n    - {{name: seal, law: coulomb, a: 2, unit: N}}",
    )
    double = read_machine(text.format(m=2, k=20, b=0, a=0))[1]
    single = one_mass(m=2, a=3, k=20)[1]
    time = np.arange(0, 2, 0.01)
    w = 6 * np.sin(3 * time)[:, None]
    x, v = simulate_open_loop(double, time, w, np.zeros(1), np.zeros(1), 20)
    y, u = simulate_open_loop(single, time, w, np.zeros(1), np.zeros(1), 20)
    # In the step of a reversal each of the two changes over by itself.
    assert np.max(np.abs(x - y)) < 2e-7 and np.max(np.abs(v - u)) < 1e-6
    states, forces, _ = by_events(double, time, w)
    exact, alone, _ = by_events(single, time, w)
    assert np.max(np.abs(states - exact)) < 1e-9
    assert np.max(np.abs(np.sum(forces, axis=1) - alone[:, 0])) < 1e-6
    assert np.all(np.abs(forces) <= [1 + 1e-9, 2 + 1e-9])


def test_no_mode_is_said_so():
    level = np.array([np.nan])
    with pytest.raises(NoMode):
        find_mode([0], [0], np.zeros(1), np.ones((1, 1)), Limits(level, level, level, level))


def test_static_friction_above_sliding_friction_sticks_where_it_can():
    limits = Limits(*(np.array([a]) for a in (2.0, 2.0, 3.0, 3.0)))
    assert find_mode([0], [0], np.array([2.5]), np.ones((1, 1)), limits).directions == (0,)
    away = find_mode([0], [0], np.array([3.1]), np.ones((1, 1)), limits)
    assert away.directions == (1,) and away.accelerations[0] == pytest.approx(1.1)


def test_one_mass_is_the_independent_integration():
    _, system = one_mass(m=2, a=3, k=20)
    time = np.arange(0, 4, 0.01)
    w = 6 * np.sin(3 * time) + 2 * np.sin(7.7 * time)
    x, v = integrate(Mass(2, lambda w, x, v: w - 20 * x, lambda speed, s: 3), time, w, 0.0, 0.0)
    states, _, plant = by_events(system, time, w)
    assert plant.events > 2 and np.mean(v == 0) > 0.05
    assert np.max(np.abs(states - np.column_stack([x, v]))) < 1e-11


def test_a_late_input_acts_at_its_instant():
    more = "effects: [{kind: input_delay, on: w, parameters: {T: 0.0237}}]"
    _, system = one_mass(m=2, a=3, more=more)
    time = np.arange(0, 1, 0.01)
    states, _, _ = by_events(system, time, np.where(time < 0.5, 8.0, -8.0)[:, None])
    # (8 − 3)/2 from 0.0237 s to 0.5237 s, then −(8 + 3)/2 to rest, and −(8 − 3)/2 from there.
    late, rest = time - 0.0237, 0.5 + 1.25 / 5.5
    exact = np.where(late < 0.5, 2.5 * np.maximum(late, 0), 1.25 - 5.5 * (late - 0.5))
    exact = np.where(late < rest, exact, -2.5 * (late - rest))
    assert states[:, 1] == pytest.approx(exact, abs=1e-11)


@pytest.mark.slow
def test_a_pulled_stack_breaks_away_where_statics_says():
    # Ground holds to 5 N; then both accelerate, and the top mass (1 kg, 2 N) stays behind from 2 m/s² on: w = 5 + 3·2.
    free = read_machine(TWO_WITHOUT_SPRINGS)[1]
    time = np.arange(0, 13, 0.05)
    states, forces, _ = by_events(free, time, time[:, None])
    slip = states[:, 2] - states[:, 3]
    assert np.all(states[time <= 5.0] == 0)
    assert np.all(states[time > 5.09, 3] > 0)
    assert np.max(np.abs(slip[time < 11.01])) < 1e-12
    assert np.all(slip[time > 11.09] < 0)
    expected = np.clip((time - 5) / 3, 0, 2)
    assert np.max(np.abs(-forces[:, 0] - expected)) < 1e-9


TWO_WITHOUT_SPRINGS = """
name: pulled
coordinates:
  x1: {velocity: v1, unit: m}
  x2: {velocity: v2, unit: m}
inputs:
  w: {unit: N}
parameters:
  m1: {value: 1, unit: kg}
  m2: {value: 2, unit: kg}
mass_matrix: [[m1, 0], [0, m2]]
force: [0, w]
friction:
  distribution: [[1, 0], [-1, 1]]
  contacts:
    - {name: between, law: coulomb, a: 2, unit: N}
    - {name: ground, law: coulomb, a: 5, unit: N}
"""

STATIC = SPRING_MASS.replace("law: coulomb, a: {a}", "law: static_viscous, F_c: 2, F_s: 3, F_v: 0.5")
COMPLIANT = f"effects: {effect('compliance', 'x', k=900, c=2, load_fraction=0.4)}\n"
PLAY = f"effects: {effect('backlash', 'x', gap=0.005, k=900, c=2, load_fraction=0.4)}\n"
MACHINES = {
    "two masses": (lambda: two_mass()[1], lambda t: 14 * np.sin(4 * t)[:, None]),
    "arm": (lambda: arm(a=0.05)[1], lambda t: np.column_stack([0.3 + 0.2 * np.sin(5 * t), 0.1 * np.sin(3 * t)])),
    "stiction": (
        lambda: read_machine(
            SPRING_MASS.replace("law: coulomb, a: {a}", "law: static_viscous, F_c: 2, F_s: 3, F_v: 0.5").format(
                m=2, k=20, b=0
            )
        )[1],
        lambda t: 7 * np.sin(2.3 * t)[:, None],
    ),
    "load behind a spring": (lambda: one_mass(more=COMPLIANT)[1], lambda t: 9 * np.sin(2.3 * t)[:, None]),
    "load behind play": (lambda: one_mass(more=PLAY)[1], lambda t: 9 * np.sin(2.3 * t)[:, None]),
}


@pytest.mark.parametrize("name", slow_except(list(MACHINES), ["two masses", "stiction"]))
def test_both_time_steppers_converge_to_the_events(name: str):
    """Those of the simulator and of the diagnosis: they share laws and terms, but not the solver of the contacts."""
    make, command = MACHINES[name]
    system = make()
    n, full = system.degrees_of_freedom, with_loads(system)
    time = np.arange(0, 2, 0.02)
    w = command(time)
    states, forces, plant = by_events(full, time, w)
    positions, velocities = (part[:, :n] for part in np.hsplit(states, 2))
    assert plant.events > 0
    simulated, predicted = [], []
    for substeps in (25, 100, 400):
        x, v = simulate_open_loop(system, time, w, np.zeros(n), np.zeros(n), substeps)
        simulated.append(np.max(np.abs(np.hstack([x - positions, v - velocities]))))
        predicted.append(np.max(np.abs(free_run_from_rest(system, time, w, substeps) - positions)))
    assert simulated[2] < 1e-5 * np.max(np.abs(states))
    assert predicted[2] < 1e-7 * np.max(np.abs(positions))
    # Where play ends, the damper's force jumps somewhere in a substep: first order there, and not evenly so.
    least = 4 if name == "load behind play" else 50
    assert simulated[0] / simulated[2] > least and predicted[0] / predicted[2] > least
    assert np.all(np.abs(forces) < 4 * np.max(np.abs(w)) + 10)


def test_closed_loop_by_events_is_the_one_by_steps():
    _, system = two_mass()
    controller = Feedback(1, feedforward=lambda t: np.array([14 * np.sin(4 * t)]), velocity_gain=np.array([[0.0, 3.0]]))
    by_events = functools.partial(EventPlant, system)
    steps, events = (
        run_loop(system, SampledLoop(controller), 0.01, 150, substeps=200, make_plant=p) for p in (None, by_events)
    )
    assert np.max(np.abs(steps.true_positions - events.true_positions)) < 1e-6
    assert np.max(np.abs(steps.inputs - events.inputs)) < 1e-4
    assert np.max(np.abs(events.true_positions)) > 0.05


def test_laws_with_states_are_left_to_the_time_stepper():
    system = read_machine(SPRING_MASS.replace("law: coulomb, a: {a}", "law: dahl, a: 3, c: 200").format(m=1, k=0, b=0))[
        1
    ]
    with pytest.raises(ValueError, match="dahl"):
        EventPlant(system, 0.01, np.zeros(1), np.zeros(1))


@pytest.mark.slow
@pytest.mark.parametrize(("m", "a", "seconds"), [(2, 7, 1000), (3.7, 11.3, 50), (0.3, 0.9, 50)])
def test_a_stuck_mass_on_a_slope_stays_for_ever(m: float, a: float, seconds: float):
    system = slope(0.3, m, a)
    time = np.arange(0, seconds, 0.01)
    x, v = simulate_open_loop(system, time, np.zeros((len(time), 1)), np.zeros(1), np.zeros(1), 5)
    assert np.all(x == 0) and np.all(v == 0)
    states, forces, _ = by_events(system, time[:200], np.zeros((200, 1)))
    assert np.all(states == 0)
    assert forces[-1, 0] == pytest.approx(m * 9.81 * np.sin(0.3), rel=1e-12)
    sliding = slope(0.3, m, 0.99 * m * 9.81 * np.sin(0.3))
    moved = simulate_open_loop(sliding, time[:100], np.zeros((100, 1)), np.zeros(1), np.zeros(1), 5)[0]
    assert moved[-1, 0] == pytest.approx(0.005 * 9.81 * np.sin(0.3) * time[99] ** 2, rel=1e-9)


def test_a_stack_stuck_on_a_slope_stays_for_ever_and_shares_its_weight():
    # Each contact carries all that lies above it; masses of 100, 1 and 30 kg couple the contacts as hard as can be.
    _, system = read_machine(STACK)
    time = np.arange(0, 100, 0.01)
    x, v = simulate_open_loop(system, time, np.zeros((len(time), 1)), np.full(3, 0.7), np.zeros(3), 5)
    assert np.all(x == 0.7) and np.all(v == 0)
    states, forces, _ = by_events(system, time[:20], np.zeros((20, 1)), np.full(3, 0.7))
    assert np.all(states == [0.7, 0.7, 0.7, 0, 0, 0])
    assert forces[-1] == pytest.approx([98, 98.98, 128.38], rel=1e-12)


def test_a_sliding_stack_comes_to_an_exact_rest():
    _, system = read_machine(STACK)
    time = np.arange(0, 60, 0.01)
    w = np.where(time < 0.3, 300.0, 0.0)[:, None]
    x, v = simulate_open_loop(system, time, w, np.zeros(3), np.zeros(3), 5)
    assert np.max(v) > 0.05
    assert np.all(v[-100:] == 0) and np.all(x[-100] == x[-1])


@pytest.mark.parametrize("method", slow_except(["steps", "events"], ["steps"]))
def test_no_contact_creates_energy_and_the_balance_closes(method: str):
    # ½v'Mv + ½k x² gains the input's work and loses what the contacts take, at every sample; none gives any back.
    _, system = two_mass()
    controller = Feedback(1, feedforward=lambda t: np.array([14 * np.sin(4 * t)]))
    plants = {"steps": None, "events": functools.partial(EventPlant, system)}
    period = 2e-4 if method == "steps" else 4e-3
    run = run_loop(system, SampledLoop(controller), period, round(1.5 / period), make_plant=plants[method])
    x, v, force = run.true_positions, run.true_velocities, run.contact_forces
    slip = v @ np.array([[1, 0], [-1, 1]])
    moved = np.diff(x, axis=0)
    taken = force[:-1] * (moved @ np.array([[1, 0], [-1, 1]]))
    lost = np.sum(taken)
    energy = (v**2 @ [1, 2] + x**2 @ [40, 60]) / 2
    gained = np.cumsum(run.inputs[:-1, 0] * moved[:, 1])
    assert lost > 1
    if method == "events":
        assert np.min(force * slip) >= -1e-12 * np.max(force * slip)
    else:
        # In the step of a reversal the mean force may oppose the mean slip; it is less than a step's share.
        assert np.min(taken) >= -2e-6 * lost
    tolerance = 2e-4 if method == "steps" else 4e-3
    assert np.max(np.abs(energy[1:] - gained + np.cumsum(np.sum(taken, axis=1)))) < tolerance * lost
