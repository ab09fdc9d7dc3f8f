"""The set-valued law inside one step."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from codegen.simulate.contact import Levels, contact_forces

NUMBERS = st.floats(-20, 20)
LEVELS = st.floats(0, 10)


def solver(contacts: int):
    """The solver as a compiled function of (slip, free, mobility, forward, backward, step, start)."""
    columns = {n: casadi.SX.sym(n, contacts) for n in ("slip", "free", "forward", "backward", "start")}
    mobility, h = casadi.SX.sym("mobility", contacts, contacts), casadi.SX.sym("h")
    slip, free, forward, backward, start = columns.values()
    q = contact_forces(slip, free, mobility, Levels(forward, backward), h, start)
    return casadi.Function("solve", [slip, free, mobility, forward, backward, h, start], [q])


LONE, TWO, THREE = solver(1), solver(2), solver(3)
STACK = np.array([[1.0, 0.0], [-1.0, 1.0]])
"""U of a body on another one, which lies on the ground."""


@settings(deadline=None)
@given(slip=NUMBERS, free=NUMBERS, mobility=st.floats(0.1, 5), forward=LEVELS, backward=LEVELS, step=st.floats(1e-4, 1))
def test_lone_contact_is_the_exact_motion(slip, free, mobility, forward, backward, step):
    q = float(LONE(slip, free, mobility, forward, backward, step, 0.0))
    level = forward if slip >= 0 else backward
    deceleration = mobility * level - np.sign(slip) * free
    stops = slip == 0 or (deceleration > 0 and abs(slip) / deceleration < step)
    if stops:
        left = step - (abs(slip) / deceleration if slip != 0 else 0.0)
        held = -backward <= free / mobility <= forward
        against = forward if free > 0 else -backward
        end = 0.0 if held else (free - mobility * against) * left
    else:
        end = slip + step * (free - mobility * np.sign(slip) * level)
    assert abs(slip + step * (free - mobility * q) - end) < 1e-9 * (1 + abs(slip) + abs(free))
    assert -backward - 1e-9 <= q <= forward + 1e-9


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_coupled_contacts_at_rest_reach_the_law_with_a_warm_start(seed):
    rng = np.random.default_rng(seed)
    shape = rng.standard_normal((3, 5))
    mobility = shape @ shape.T + 0.5 * np.eye(3)
    free, level = 5 * rng.standard_normal(3), rng.uniform(0, 2, 3)
    q = np.zeros(3)
    for _ in range(100):
        q = THREE(np.zeros(3), free, mobility, level, level, 0.01, q).full().ravel()
    slip = free - mobility @ q
    assert np.all(np.abs(q) <= level + 1e-12)
    inside = np.abs(q) < level - 1e-9
    assert np.all(np.abs(slip[inside]) < 1e-6)
    assert np.all(slip[~inside] * np.sign(q[~inside]) > -1e-6)


def least_dissipation(free, mobility, level):
    """At rest: slip accelerations of the q that makes ½ q'Aq − free'q least over its box, by SciPy's active sets."""
    root = np.linalg.cholesky(mobility)
    q = lsq_linear(root.T, np.linalg.solve(root, free), (-level, level), method="bvls", tol=1e-14).x
    return free - mobility @ q


def assert_at_once(solve, free, mobility, level):
    """One step from a guess of zero gives the accelerations of the law."""
    count = len(free)
    q = solve(np.zeros(count), free, mobility, level, level, 0.01, np.zeros(count)).full().ravel()
    expected = least_dissipation(free, mobility, level)
    assert free - mobility @ q == pytest.approx(expected, abs=1e-8 * np.max(np.abs(free)))


def test_coupled_contacts_at_rest_reach_the_law_from_a_guess_of_zero():
    rng = np.random.default_rng(11)
    for _ in range(400):
        free, level = 5 * rng.standard_normal(3), rng.uniform(0, 2, 3)
        shape = rng.standard_normal((3, 5))
        assert_at_once(THREE, free, shape @ shape.T + 0.5 * np.eye(3), level)
        inverse = np.diag(np.exp(rng.uniform(-3, 3, 2)))
        assert_at_once(TWO, STACK.T @ inverse @ free[:2], STACK.T @ inverse @ STACK, level[:2])


def test_a_heavy_body_on_a_light_one():
    inverse = np.diag([0.10061, 5.29875])
    free = STACK.T @ [-0.13846, -0.09881]
    assert_at_once(TWO, free, STACK.T @ inverse @ STACK, np.array([0.31582, 0.22318]))
