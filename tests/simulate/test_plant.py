"""Plants against closed forms and SciPy's integrators."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codegen.simulate.closed_loop import simulate
from tests.machines import arm, one_mass, two_mass
from tests.simulate.open_loop import simulate_open_loop

from .event_integrator import Mass, integrate


def test_mass_slides_to_rest_and_stays_there():
    _, system = one_mass(m=2, a=3)
    time = np.arange(0, 3, 0.01)
    push = np.where(time > 2, 2.999, 0.0)[:, None]
    x, v = simulate_open_loop(system, time, push, np.array([0.0]), np.array([1.5]))
    stop = 1.5**2 * 2 / (2 * 3)
    assert x[-1, 0] == pytest.approx(stop, abs=2e-6)
    assert np.all(np.abs(v[time > 1.01]) < 1e-14)
    assert x[-1, 0] == x[150, 0]


def test_push_above_the_level_moves_it():
    _, system = one_mass(m=2, a=3)
    time = np.arange(0, 1, 0.01)
    x, v = simulate_open_loop(system, time, np.full((100, 1), -5.0), np.zeros(1), np.zeros(1))
    assert np.allclose(v[:, 0], -time, atol=1e-12)
    assert np.allclose(x[:, 0], -(time**2) / 2, atol=1e-12)


def test_oscillator_loses_four_a_over_k_each_period():
    m, k, a = 2.0, 50.0, 3.0
    _, system = one_mass(m=m, a=a, k=k)
    half = np.pi * np.sqrt(m / k)
    time = np.linspace(0, 8 * half, 801)
    x, v = simulate_open_loop(system, time, np.zeros((801, 1)), np.array([0.5]), np.zeros(1), substeps=20)
    turning = x[::100, 0]
    expected = [(0.5 - 2 * i * a / k) * (-1) ** i for i in range(5)]
    assert turning[:5] == pytest.approx(expected, abs=1e-5)
    # The amplitude 0.02 m is within a/k: it sticks.
    assert turning[5:] == pytest.approx(expected[4], abs=1e-5)
    assert np.all(np.abs(v[420:]) < 1e-13)


def test_stick_slip_under_a_sine_follows_the_event_integrator():
    _, system = one_mass(m=2, a=3, k=20)
    time = np.arange(0, 4, 0.01)
    w = 6 * np.sin(3 * time) + 2 * np.sin(7.7 * time)
    mass = Mass(2, lambda w, x, v: w - 20 * x, lambda speed, s: 3)
    x, v = integrate(mass, time, w, 0.0, 0.0)
    assert np.mean(v == 0) > 0.05
    got_x, got_v = simulate_open_loop(system, time, w[:, None], np.zeros(1), np.zeros(1), substeps=50)
    assert np.max(np.abs(got_x[:, 0] - x)) < 2e-7
    assert np.max(np.abs(got_v[:, 0] - v)) < 2e-6


def test_reversals_do_not_spoil_second_order():
    _, system = one_mass(m=2, a=3, k=20)
    time = np.arange(0, 4, 0.02)
    w = 20 * np.sin(3 * time)
    x, _ = integrate(Mass(2, lambda w, x, v: w - 20 * x, lambda speed, s: 3), time, w, 0.0, 0.0)
    errors = []
    for substeps in (4, 8, 16, 32):
        got, _ = simulate_open_loop(system, time, w[:, None], np.zeros(1), np.zeros(1), substeps)
        errors.append(np.max(np.abs(got[:, 0] - x)))
    assert errors[0] / errors[3] > 30
    assert errors[3] < 1e-5


def test_two_masses_two_contacts_against_a_stiff_regularisation():
    _, system = two_mass()
    time = np.arange(0, 3, 0.02)
    w = 14 * np.sin(4 * time)
    width = 1e-6

    def rate(_, y, w):
        between, ground = 2 * np.tanh((y[2] - y[3]) / width), 5 * np.tanh(y[3] / width)
        return [y[2], y[3], (-40 * y[0] - between) / 1, (w - 60 * y[1] + between - ground) / 2]

    state, path = np.zeros(4), [np.zeros(4)]
    for k in range(len(time) - 1):
        solved = solve_ivp(rate, (time[k], time[k + 1]), state, "Radau", args=(w[k],), rtol=1e-8, atol=1e-11)
        state = solved.y[:, -1]
        path.append(state)
    path = np.array(path)
    x, v = simulate_open_loop(system, time, w[:, None], np.zeros(2), np.zeros(2), substeps=100)
    slips = np.abs(np.column_stack([v[:, 0] - v[:, 1], v[:, 1]]))
    assert np.all(np.mean(slips < 1e-9, axis=0) > 0.03)
    assert np.all(np.mean(slips > 0.01, axis=0) > 0.3)
    assert np.max(np.abs(x - path[:, :2])) < 2e-5
    assert np.max(np.abs(v - path[:, 2:])) < 5e-4


def test_energy_balances_work_and_friction():
    more = "simulation: {duration: 3, sample_time: 1e-4, inputs: {w: 14*sin(4*t)}}"
    log = simulate(*two_mass(more=more))
    x, v, force = log.true_positions, log.true_velocities, log.contact_forces
    energy = (v**2 @ [1, 2] + x**2 @ [40, 60]) / 2
    step = np.diff(x, axis=0)
    work = np.cumsum(log.inputs[:-1, 0] * step[:, 1])
    lost = np.cumsum(np.sum(force[:-1] * np.column_stack([step[:, 0] - step[:, 1], step[:, 1]]), axis=1))
    assert lost[-1] > 1
    assert np.max(np.abs(energy[1:] - work + lost)) < 1e-4 * lost[-1]
    assert np.all(np.abs(force) <= [2 + 1e-12, 5 + 1e-12])


def test_smooth_motion_is_second_order():
    _, system = one_mass(m=2, a=0, k=50, b=3)
    time = np.arange(0, 2, 0.04)
    damping = 3 / 4
    omega = np.sqrt(25 - damping**2)
    exact = np.exp(-damping * time) * (np.cos(omega * time) + damping / omega * np.sin(omega * time))
    errors = []
    for substeps in (1, 2, 4, 8):
        x, _ = simulate_open_loop(system, time, np.zeros((50, 1)), np.ones(1), np.zeros(1), substeps)
        errors.append(np.max(np.abs(x[:, 0] - exact)))
    ratios = np.array(errors[:-1]) / errors[1:]
    assert np.all((ratios > 3.6) & (ratios < 4.5))


def test_arm_with_coriolis_forces():
    _, system = arm(a=0)
    A, B, C, G = 0.05, 0.02, 0.015, 0.3

    def rate(_, y):
        q1, q2, p1, p2 = y
        mass = np.array([[A + 2 * C * np.cos(q2), B + C * np.cos(q2)], [B + C * np.cos(q2), B]])
        force = [0.1 + C * np.sin(q2) * (2 * p1 * p2 + p2**2) - G * np.cos(q1), 0.02 - C * np.sin(q2) * p1**2]
        return [p1, p2, *np.linalg.solve(mass, force)]

    time = np.arange(0, 2, 0.01)
    start = np.array([0.3, -0.5, 1.0, 2.0])
    exact = solve_ivp(rate, (0, time[-1]), start, "DOP853", t_eval=time, rtol=1e-11, atol=1e-12).y.T
    w = np.tile([0.1, 0.02], (len(time), 1))
    errors = []
    for substeps in (5, 10, 20):
        x, v = simulate_open_loop(system, time, w, start[:2], start[2:], substeps)
        errors.append(np.max(np.abs(np.hstack([x, v]) - exact)))
    assert errors[2] < 1e-3
    assert errors[0] / errors[1] > 3.5
    assert errors[1] / errors[2] > 3.5


def test_arm_holds_still_inside_its_friction():
    _, system = arm(a=0.2)
    time = np.arange(0, 1, 0.01)
    w = np.tile([0.3 * np.cos(0.4), 0.0], (100, 1)) + np.array([0.19, -0.19])
    x, _ = simulate_open_loop(system, time, w, np.array([0.4, 1.0]), np.zeros(2))
    assert np.max(np.abs(x - [0.4, 1.0])) < 1e-8
    assert np.all(x[50:] == x[50])


def test_time_in_an_expression_counts_from_the_first_sample():
    # No declared force may hold t; a level that drifts does.
    spec, system = one_mass(m=2, a=3)
    system = system.with_level(0, 2 * spec.symbol("t"))
    time = 100 + np.arange(0, 2, 0.01)
    _, v = simulate_open_loop(system, time, np.full((200, 1), 5.0), np.zeros(1), np.zeros(1))
    t = time - 100
    assert np.allclose(v[t < 1, 0], (t - t**2 / 2)[t < 1], atol=1e-9)


def test_divergence_is_infinite_and_shapes_are_checked():
    _, system = one_mass(b=-1e6)
    time = np.arange(0, 1, 0.01)
    x, v = simulate_open_loop(system, time, np.zeros((100, 1)), np.zeros(1), np.full(1, 1.0))
    assert np.isinf(x[-1, 0])
    assert np.isinf(v[-1, 0])
    with pytest.raises(ValueError, match="inputs of shape"):
        simulate_open_loop(system, time, np.zeros((99, 1)), np.zeros(1), np.zeros(1))
    with pytest.raises(ValueError, match="does not increase evenly"):
        simulate_open_loop(system, time * 0, np.zeros((100, 1)), np.zeros(1), np.zeros(1))
