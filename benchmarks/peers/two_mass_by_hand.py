"""Two masses, one step, in Python by hand: on floats (as numba takes it), and on numpy's vectors."""

from __future__ import annotations

from typing import Any

import numpy as np

M1, M2, ETA1, ETA2, ETA3, H = 10.0, 50.0, 100.0, 50.0, 20.0, 0.001
LEVELS = (10.0, 20.0)
CONSTANTS = ((ETA2 + ETA3), (ETA1 + ETA3), ETA3, 1.0 / M1, 1.0 / M2, 500.0, 700.0, 10.0, 10.0, H)


def scalar_step(state: Any, constants: Any, row: Any, outputs: Any) -> None:
    """State, four; constants, ten; row, three; outputs, eight: anything with an index."""
    stiffness_1, stiffness_2, coupling, over_m1, over_m2, K_between, K_ground, K_v1, K_v2, h = constants
    x1, x2, w = row[0], row[1], row[2]
    v1 = state[0] + K_v1 * x1
    v2 = state[1] + K_v2 * x2
    slip = v1 - v2
    s_between = 1.0 if slip > 0.0 else (-1.0 if slip < 0.0 else 0.0)
    s_ground = 1.0 if v2 > 0.0 else (-1.0 if v2 < 0.0 else 0.0)
    a_between = state[2] - K_between * abs(slip)
    a_ground = state[3] - K_ground * abs(v2)
    F_between = s_between * a_between
    F_ground = s_ground * a_ground
    on_2 = F_ground - F_between
    v1_dot = over_m1 * (coupling * x2 - stiffness_1 * x1 - F_between)
    v2_dot = over_m2 * (w + coupling * x1 - stiffness_2 * x2 - on_2)
    state[0] += h * (v1_dot - K_v1 * v1)
    state[1] += h * (v2_dot - K_v2 * v2)
    state[2] += h * K_between * s_between * (v1_dot - v2_dot)
    state[3] += h * K_ground * s_ground * v2_dot
    outputs[0] = v1
    outputs[1] = v2
    outputs[2] = a_between
    outputs[3] = a_ground
    outputs[4] = F_between
    outputs[5] = F_ground
    outputs[6] = F_between
    outputs[7] = on_2


K_F = np.array([500.0, 700.0])
K_V = np.array([10.0, 10.0])
U = np.array([[1.0, 0.0], [-1.0, 1.0]])
STIFFNESS = np.array([[-(ETA2 + ETA3), ETA3], [ETA3, -(ETA1 + ETA3)]])
MASS_INVERSE = np.diag([1.0 / M1, 1.0 / M2])
DRIVE = np.array([0.0, 1.0])


def vector_step(z_v: Any, z: Any, x: Any, w: float) -> tuple[Any, Any, Any]:
    """Next velocity state, next friction state, outputs."""
    v = z_v + K_V * x
    slip = U.T @ v
    sign = np.sign(slip)
    level = z - K_F * np.abs(slip)
    friction = level * sign
    force = U @ friction
    a = MASS_INVERSE @ (STIFFNESS @ x + DRIVE * w - force)
    following = z + H * K_F * sign * (U.T @ a)
    return z_v + H * (a - K_V * v), following, np.concatenate([v, level, friction, force])
