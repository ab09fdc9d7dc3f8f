"""The balance of forces along a measured motion: what the motion takes, and what each input gives.

M(x) a − g(x, v, 0) + U λ = g(x, v, w) − g(x, v, 0), both sides low-passed alike, with the declared friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.logs.log import Log
from codegen.logs.motion import Motion, low_pass
from codegen.mechanics import System
from codegen.mechanics.casadi_form import symbol_values, to_casadi


@dataclass(frozen=True, eq=False)
class Forces:
    """Generalised forces along the motion, low-passed, of the K samples where every contact slips.

    Attributes:
        inertia: (K, n) M(x) a.
        rest: (K, n) g(x, v, 0) − U λ with the declared friction.
        friction: (K, n) U λ, which is in ``rest`` too.
        standing: (K, n) g(x, 0, 0): gravity and springs, which is in ``rest`` too.
        driven: (m, K, n) what each input alone adds to g.
        motion: (K, 2n) positions and velocities.
    """

    inertia: Array
    rest: Array
    friction: Array
    standing: Array
    driven: Array
    motion: Array

    @property
    def given(self) -> Array:
        """(K, n) what the inputs add to g."""
        return np.asarray(self.driven.sum(axis=0))

    @property
    def misfit(self) -> float:
        """Σ(M a − g + U λ)² over the sum of the squares of these forces, the mean over the coordinates."""
        left = np.sum((self.inertia - self.rest - self.given) ** 2, axis=0)
        whole = np.sum(self.inertia**2 + self.rest**2 + self.given**2, axis=0)
        return float(np.mean(left[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 1.0

    @property
    def moving_misfit(self) -> float:
        """Σ(M a − g + U λ)² over the squares of what the motion takes beside gravity and springs, as in ``misfit``.

        Where a weight is most of the balance, the squares of all forces say little of the motion.
        """
        left = np.sum((self.inertia - self.rest - self.given) ** 2, axis=0)
        moving = self.rest - self.standing
        whole = np.sum(self.inertia**2 + moving**2 + (self.inertia - moving) ** 2, axis=0)
        return float(np.mean(left[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 1.0

    def inertia_factor(self, i: int) -> tuple[float, float]:
        """By how much the inputs' force on coordinate i is inertia, over M a, and the partial correlation.

        Springs, dampers and offsets that the spec may lack are regressors too, so that they do not pass for inertia.
        """
        others = np.column_stack([self.friction[:, i], self.motion, np.ones(len(self.motion))])
        return partial_correlation(self.given[:, i], self.inertia[:, i], others)

    def friction_factor(self, i: int) -> tuple[float, float]:
        """The same of the declared friction."""
        others = np.column_stack([self.inertia[:, i], self.motion, np.ones(len(self.motion))])
        return partial_correlation(self.given[:, i], self.friction[:, i], others)


def unexplained(wanted: Array, others: Array) -> Array:
    """Columns (K, m), or one of (K,), less their least-squares combination of other columns, (K, n)."""
    size = np.linalg.norm(others, axis=0)
    basis = others[:, size > 0] / size[size > 0]
    return np.asarray(wanted - basis @ np.linalg.lstsq(basis, wanted, rcond=1e-8)[0])


def partial_correlation(wanted: Array, column: Array, others: Array) -> tuple[float, float]:
    """Least-squares weight of a column beside others, and its partial correlation; zeros where it says nothing."""
    left = unexplained(np.column_stack([wanted, column]), others)
    power = float(left[:, 1] @ left[:, 1])
    if power <= 1e-12 * float(column @ column):
        return 0.0, 0.0
    product, whole = float(left[:, 0] @ left[:, 1]), float(left[:, 0] @ left[:, 0])
    return product / power, product / float(np.sqrt(power * whole)) if whole > 0 else 0.0


def forces_along(log: Log, system: System, motion: Motion) -> Forces:
    """The balance of forces of a system along the motion of a log."""
    before = np.vstack([log.inputs[:1], log.inputs[:-1]])
    mean_input = 0.5 * (before + log.inputs)
    evaluate = _function(system, motion.threshold).map(log.size)
    n, m = len(system.positions), len(system.inputs)

    def along(inputs: Array) -> list[Array]:
        arguments = (motion.positions, motion.velocities, motion.accelerations, inputs)
        results = evaluate(*(np.ascontiguousarray(a.T) for a in arguments))
        return [np.array(r.full(), dtype=np.float64).T for r in results]

    inertia, rest, friction, standing, slip_margin = along(np.zeros_like(mean_input))
    driven = []
    for j in range(m):
        alone = np.zeros_like(mean_input)
        alone[:, j] = mean_input[:, j]
        driven.append(along(alone)[1] - rest)
    stacked = np.hstack([inertia, rest, friction, standing, motion.positions, motion.velocities, *driven])
    finite: Flags = np.all(np.isfinite(stacked), axis=1)
    smooth, _ = low_pass(log, np.where(finite[:, None], stacked, 0.0), motion.cutoff_hz)
    slipping: Flags = np.all(slip_margin > 0, axis=1)
    parts = smooth[motion.usable & finite & slipping].reshape(-1, 6 + m, n)
    moved = parts[:, 4:6].reshape(-1, 2 * n)
    return Forces(parts[:, 0], parts[:, 1], parts[:, 2], parts[:, 3], np.moveaxis(parts[:, 6:], 1, 0), moved)


def _function(system: System, threshold: Array) -> casadi.Function:
    """(x, v, a, w) → M a; g − U λ; U λ; g at rest; |u| less the slip that speeds of ``threshold``, (n), amount to.

    All are columns.
    """
    groups = (system.positions, system.velocities, system.accelerations, system.inputs)
    arguments = [casadi.SX.sym("q", len(group)) for group in groups]
    names = symbol_values(system.values, *zip(groups, arguments, strict=True))
    slip = to_casadi(system.slip_velocity, names)
    names |= {c.slip: slip[k] for k, c in enumerate(system.contacts)}
    friction = casadi.SX.zeros(len(system.positions))
    if system.contacts:
        forces = casadi.vertcat(*(to_casadi(c.force, names) for c in system.contacts))
        friction = casadi.mtimes(to_casadi(system.distribution, names), forces)
    force = to_casadi(system.force, names) - friction
    at_rest = names | {system.velocities[k]: casadi.SX(0.0) for k in range(len(system.velocities))}
    standing = to_casadi(system.force, at_rest)
    inertia = casadi.mtimes(to_casadi(system.mass_matrix, names), arguments[2])
    margin = casadi.fabs(slip) - casadi.mtimes(casadi.fabs(casadi.jacobian(slip, arguments[1])), casadi.DM(threshold))
    outputs = (inertia, force, friction, standing, margin)
    return casadi.Function("forces", arguments, [casadi.densify(o) for o in outputs])
