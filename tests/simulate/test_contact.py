"""The set-valued law inside one step."""

from __future__ import annotations

import casadi
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

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


LONE, THREE = solver(1), solver(3)


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
