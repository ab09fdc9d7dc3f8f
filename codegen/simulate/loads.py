"""Loads behind springs, which no log has: where they are while their motors move as measured."""

from __future__ import annotations

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.loads import with_loads
from codegen.mechanics.system import System

Array = NDArray[np.float64]
SETTLING = 4
"""Iterations to the position at which a spring balances its load's weight."""
SURE = 0.01
"""A force that deflects the spring by less than this share of the gap does not tell the side on which the play is taken
out, so the load begins in the middle; one of twice that does."""


def load_states(system: System, positions: Array, velocities: Array, period: float, substeps: int) -> Array:
    """Positions, then velocities of the loads (N, 2 loads) along a measured motion of the motors.

    From a balance of spring, declared force of position and acceleration at the first sample; the motion is linear
    between samples.

    Args:
        positions, velocities: (N, n).
        period: s.
        substeps: steps of RK4 in a sample.
    """
    n, count = system.degrees_of_freedom, len(system.transmissions)
    if count == 0:
        return np.zeros((len(positions), 0))
    full = with_loads(system)
    motor, load = casadi.SX.sym("motor", 2 * n), casadi.SX.sym("load", 2 * count)
    x, v = casadi.vertcat(motor[:n], load[:count]), casadi.vertcat(motor[n:], load[count:])
    names = symbol_values(system.values, (full.positions, x), (full.velocities, v))
    # At the loads no input acts, and each has an inertia of its own.
    force = to_casadi(sympy.ImmutableMatrix(full.force[n:]), names)
    mass = casadi.vertcat(*[to_casadi(full.mass_matrix[n + k, n + k], names) for k in range(count)])
    rate = casadi.Function("rate", [load, motor], [casadi.vertcat(load[count:], force / mass)])

    ends = casadi.SX.sym("ends", 4 * n)
    first, change, h, now = ends[: 2 * n], ends[2 * n :] - ends[: 2 * n], period / substeps, load
    for k in range(substeps):
        at = [first + (k + share) / substeps * change for share in (0, 0.5, 1)]
        k1 = rate(now, at[0])
        k2 = rate(now + h / 2 * k1, at[1])
        k3 = rate(now + h / 2 * k2, at[1])
        k4 = rate(now + h * k3, at[2])
        now = now + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    run = casadi.Function("follow", [load, ends], [now]).mapaccum("history", len(positions) - 1, 1)
    motors = np.hstack([positions, velocities])
    chosen = [t.coordinate for t in system.transmissions]
    settled = _settled(system, positions, velocities, period) if len(positions) > 1 else positions[0, chosen]
    start = np.concatenate([settled, velocities[0, chosen]])
    later = run(start, np.hstack([motors[:-1], motors[1:]]).T).full().T
    return np.vstack([start, later])


def _settled(system: System, positions: Array, velocities: Array, period: float) -> Array:
    """(loads,) positions at the first sample at which k dx = ρ M a less the declared force of position at the load."""
    x, acceleration = positions[0], (velocities[1] - velocities[0]) / period
    still = system.force.subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
    at = casadi.SX.sym("x", len(x))
    names = symbol_values(system.values, (system.positions, at))
    balance = casadi.Function(
        "balance", [at], [to_casadi(sympy.ImmutableMatrix(still), names), to_casadi(system.mass_matrix, names)]
    )
    found = []
    for t in system.transmissions:
        i, there = t.coordinate, x.copy()
        k, gap, share = (float(e.subs(system.values)) for e in (t.stiffness, t.gap, t.load_fraction))
        inertia = share * float(balance(x)[1][i, i])
        for _ in range(SETTLING):
            bend = (inertia * acceleration[i] - float(balance(there)[0][i])) / k
            side = float(np.clip(abs(bend) / (SURE * gap) - 1, 0, 1) * np.sign(bend)) if gap > 0 else 0.0
            there[i] = x[i] - bend - side * gap / 2
        found.append(there[i])
    return np.array(found)
