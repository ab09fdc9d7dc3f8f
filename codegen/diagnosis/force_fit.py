"""Linear least squares on the force residual: the residual and its slopes by the refitted parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.balance import true_motion
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.residual import effective_inputs, inverse_dynamics_residual
from codegen.diagnosis.signals import Motion
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME, System

Array = NDArray[np.float64]

REWEIGHED = 2
"""Iterations of reweighting each coordinate by its residual RMS (iteratively reweighted least squares)."""


@dataclass(frozen=True, eq=False)
class ForceRows:
    """Linearised low-passed force residual of one coordinate, away from standstill.

    Attributes:
        sample: (R,) index of each row in the motion. residual: (R,) at the system's own values. slopes: (R, p).
    """

    sample: NDArray[np.int_]
    residual: Array
    slopes: Array

    def left(self, change: Array) -> Array:
        """(R,) residual after a parameter change (p,)."""
        return np.asarray(self.residual + self.slopes @ change)


def force_rows(system: System, problem: Problem, symbols: Sequence[sympy.Symbol]) -> list[ForceRows]:
    """The rows of each coordinate that moves."""
    motion = problem.motion
    residual = inverse_dynamics_residual(system, motion)
    slopes = motion.low_pass(_slopes(system, motion, symbols))
    rows = []
    for i in range(system.degrees_of_freedom):
        used = np.flatnonzero(problem.masks.rows[:, i])
        if len(used):
            rows.append(ForceRows(used, residual[used, i], slopes[used, i]))
    return rows


def scales(rows: Sequence[ForceRows], prior_precision: Array, free: NDArray[np.bool_], pull: Array) -> Array:
    """Residual RMS on each coordinate after the fit of the free parameters.

    Args:
        prior_precision: (p,). pull: (p,) from the system's values to the centre of the prior.
    """
    size = np.array([_rms(r.residual) for r in rows])
    for _ in range(REWEIGHED):
        matrix, vector = np.diag(prior_precision), prior_precision * pull
        for r, one in zip(rows, size, strict=True):
            share = independent_samples(r.residual) / len(r.residual)
            matrix = matrix + share * r.slopes.T @ r.slopes / one**2
            vector = vector - share * r.slopes.T @ r.residual / one**2
        change = np.zeros(len(prior_precision))
        if free.any():
            change[free] = np.linalg.lstsq(matrix[np.ix_(free, free)], vector[free], rcond=1e-10)[0]
        size = np.array([_rms(r.left(change)) for r in rows])
    return size


def independent_samples(residual: Array) -> float:
    """Effective number of independent samples: N over the two-sided sum of the autocorrelation up to its first zero."""
    count = len(residual)
    spectrum = np.abs(np.fft.rfft(residual, 2 * count)) ** 2
    correlation = np.fft.irfft(spectrum)[:count]
    if correlation[0] <= 0:
        return float(count)
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation <= 0)
    last = int(ends[0]) if len(ends) else count
    return float(max(1.0, count / (1 + 2 * correlation[1:last].sum())))


def _rms(values: Array) -> float:
    return max(float(np.sqrt(np.mean(values**2))), 1e-300)


def _slopes(system: System, motion: Motion, symbols: Sequence[sympy.Symbol]) -> Array:
    """(N, n, p) slopes of g − M a − U λ by parameters, unfiltered."""
    n, m = system.degrees_of_freedom, len(system.inputs)
    point, moved = casadi.SX.sym("point", 3 * n + m + 1), casadi.SX.sym("moved", len(symbols))
    variables = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME]
    names = {s: casadi.SX(float(v)) for s, v in system.values.items()}
    names |= {s: point[k] for k, s in enumerate(variables)} | {s: moved[k] for k, s in enumerate(symbols)}
    error = casadi.densify(to_casadi(system.equation_error, names))
    slope = casadi.densify(casadi.jacobian(error, moved))
    function = casadi.Function("slopes", [point, moved], [slope])
    since = (motion.time - motion.time[0])[:, None]
    at = np.hstack([*true_motion(system, motion), effective_inputs(system, motion), since])
    own = np.array([float(system.values[s]) for s in symbols])
    flat = np.asarray(function.map(len(at))(at.T, np.repeat(own[:, None], len(at), axis=1)))
    return np.ascontiguousarray(flat.reshape(n, len(at), len(symbols)).transpose(1, 0, 2))
