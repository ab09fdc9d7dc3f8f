"""The balance of forces along a measured motion: the force that the motion requires, and the force of each input.

M(x) a − g(x, v, 0) + U λ = g(x, v, w) − g(x, v, 0), both sides with the same low-pass, with the declared friction and
the declared effects on mass, force and friction. Those of an actuator, a sensor or a transmission are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.base.arrays import Array, Flags
from codegen.logs.log import Log
from codegen.logs.motion import Motion, low_pass
from codegen.mechanics import System
from codegen.mechanics.casadi_form import over_rows, symbol_values, to_casadi
from codegen.mechanics.system import TIME


@dataclass(frozen=True, eq=False)
class Forces:
    """Generalised forces along the motion, low-passed, of the K samples where every contact slips.

    Attributes:
        inertia: (K, n) M(x) a.
        undriven: (K, n) g(x, v, 0) − U λ, all forces but those of inputs, with the declared friction.
        friction: (K, n) U λ, which is in ``undriven`` too.
        static: (K, n) g(x, 0, 0): gravity and springs, which is in ``undriven`` too.
        driven: (m, K, n) the force of each input alone.
        motion: (K, 2n) positions and velocities.
    """

    inertia: Array
    undriven: Array
    friction: Array
    static: Array
    driven: Array
    motion: Array

    @property
    def applied(self) -> Array:
        """(K, n) the force of all inputs."""
        return np.asarray(self.driven.sum(axis=0))

    @property
    def misfit(self) -> float:
        """Σ(M a − g + U λ)² over the sum of the squares of these forces, the mean over the coordinates."""
        return _unbalanced(self.inertia - self.undriven - self.applied, self.inertia, self.undriven, self.applied)

    @property
    def moving_misfit(self) -> float:
        """Σ(M a − g + U λ)² over the sum of the squares of the forces without gravity and springs; see ``misfit``."""
        moving = self.undriven - self.static
        return _unbalanced(self.inertia - self.undriven - self.applied, self.inertia, moving, self.inertia - moving)

    def inertia_factor(self, i: int) -> tuple[float, float]:
        """Least-squares factor of M a in the inputs' force on coordinate i, and the partial correlation.

        Friction, springs, dampers and offsets are regressors too, so that they are not taken for inertia.
        """
        others = np.column_stack([self.friction[:, i], self.motion, np.ones(len(self.motion))])
        return partial_correlation(self.applied[:, i], self.inertia[:, i], others)

    def friction_factor(self, i: int) -> tuple[float, float]:
        """Least-squares factor of the declared friction in the inputs' force on coordinate i; partial correlation."""
        others = np.column_stack([self.inertia[:, i], self.motion, np.ones(len(self.motion))])
        return partial_correlation(self.applied[:, i], self.friction[:, i], others)


def unexplained(wanted: Array, others: Array) -> Array:
    """Residual of columns, (K, m) or (K,), after least squares on other columns, (K, n)."""
    size = np.linalg.norm(others, axis=0)
    basis = others[:, size > 0] / size[size > 0]
    return np.asarray(wanted - basis @ np.linalg.lstsq(basis, wanted, rcond=1e-8)[0])


def hat_functions(x: Array, most: int) -> Array:
    """(K, k) piecewise linear functions of a position x, (K,), which add up to 1: one for each of k knots at quantiles.

    ``most``: largest number of knots.
    """
    knots = np.unique(np.quantile(x, np.linspace(0, 1, most)))
    return np.column_stack([np.interp(x, knots, row) for row in np.eye(len(knots))])


def correlation(one: Array, other: Array) -> float:
    """The correlation of two forces, (K,), about zero; 0 if one of them is zero."""
    norms = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / norms if norms > 0 else 0.0


def partial_correlation(wanted: Array, column: Array, others: Array) -> tuple[float, float]:
    """Least-squares weight of a column among others, and its partial correlation; zeros if the others explain it."""
    left = unexplained(np.column_stack([wanted, column]), others)
    power = float(left[:, 1] @ left[:, 1])
    if power <= 1e-12 * float(column @ column):
        return 0.0, 0.0
    product, whole = float(left[:, 0] @ left[:, 1]), float(left[:, 0] @ left[:, 0])
    return product / power, product / float(np.sqrt(power * whole)) if whole > 0 else 0.0


class Balance:
    """The balance of forces of a system along motions; its CasADi function is built once."""

    def __init__(self, system: System) -> None:
        self._function = _function(system)
        self._n, self._m, self._contacts = len(system.positions), len(system.inputs), len(system.contacts)

    def along(self, log: Log, motion: Motion) -> Forces:
        """The forces along the motion of a log."""
        forces, driven, finite, slipping = self._sampled(log, motion)
        columns = np.hstack([*forces, *driven, motion.positions, motion.velocities])
        smooth, _ = low_pass(log, np.where(finite[:, None], columns, 0.0), motion.cutoff_hz)
        parts = smooth.reshape(len(smooth), -1, self._n)[motion.usable & finite & slipping]
        inertia, undriven, friction, static = (parts[:, k] for k in range(4))
        moved = parts[:, 4 + self._m :].reshape(-1, 2 * self._n)
        return Forces(inertia, undriven, friction, static, np.moveaxis(parts[:, 4 : 4 + self._m], 1, 0), moved)

    def _sampled(self, log: Log, motion: Motion) -> tuple[list[Array], list[Array], Flags, Flags]:
        """M a, g(x, v, 0) − U λ, U λ and g(x, 0, 0), each (N, n); the force of each input alone, each (N, n); and (N,)
        whether all of these are finite, and whether every contact slips.
        """
        contacts = self._contacts
        before = np.vstack([log.inputs[:1], log.inputs[:-1]])
        moved = motion.positions, motion.velocities, motion.accelerations
        threshold = np.broadcast_to(motion.threshold, motion.positions.shape)
        since = (log.time - log.time[0])[:, None]
        rows = np.hstack([*moved, 0.5 * (before + log.inputs), threshold, np.zeros((log.size, 1)), since])
        found = over_rows(self._function, rows)
        inertia, undriven, friction, static, *alone = np.split(found[:, contacts:], 4 + self._m, axis=1)
        forces, driven = [inertia, undriven, friction, static], [force - undriven for force in alone]
        finite: Flags = np.all(np.isfinite(np.hstack([*forces, *moved[:2], *driven])), axis=1)
        slipping: Flags = np.all(found[:, :contacts] > 0, axis=1)
        return forces, driven, finite, slipping


def _unbalanced(residual: Array, *forces: Array) -> float:
    """Σ residual² over the sum of the squares of the forces, the mean over the coordinates; all are (K, n)."""
    left = np.sum(residual**2, axis=0)
    whole = np.sum(sum(force**2 for force in forces), axis=0)
    return float(np.mean(left[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 1.0


def _function(system: System) -> casadi.Function:
    """(x, v, a, w, speeds, zero, t) → |u| − |∂u/∂v| speeds of each contact; M a; g − U λ without input; U λ; g at rest;
    g − U λ with each input alone.

    ``speeds`` (n) are the thresholds of motion. ``zero`` is 0 in each row; it replaces the inputs that are left out.
    """
    groups = (system.positions, system.velocities, system.accelerations, system.inputs)
    arguments = [casadi.SX.sym("q", len(group)) for group in groups]
    speeds, zero = casadi.SX.sym("speeds", len(system.positions)), casadi.SX.sym("zero")
    time = casadi.SX.sym("t")
    names = symbol_values(system.values, *zip(groups, arguments, strict=True)) | {TIME: time}
    slip = to_casadi(system.slip_velocity, names)
    names |= {c.slip: slip[k] for k, c in enumerate(system.contacts)}
    none = names | dict.fromkeys(system.inputs, zero)
    distribution, nothing = to_casadi(system.distribution, none), casadi.SX.zeros(len(system.positions))

    def friction(at: Mapping[sympy.Symbol, Any]) -> Any:
        forces = [to_casadi(c.force, at) for c in system.contacts]
        return casadi.mtimes(distribution, casadi.vertcat(*forces)) if forces else nothing

    inputs = none, *(none | {w: names[w]} for w in system.inputs)
    undriven, *alone = (to_casadi(system.force, at) - friction(at) for at in inputs)
    static = to_casadi(system.force, none | dict.fromkeys(system.velocities, casadi.SX(0.0)))
    inertia = casadi.mtimes(to_casadi(system.mass_matrix, none), arguments[2])
    margin = casadi.fabs(slip) - casadi.mtimes(casadi.fabs(casadi.jacobian(slip, arguments[1])), speeds)
    outputs = casadi.vertcat(margin, inertia, undriven, friction(none), static, *alone)
    row = casadi.vertcat(*arguments, speeds, zero, time)
    return casadi.Function("forces", [row], [casadi.densify(outputs)], {"cse": True})
