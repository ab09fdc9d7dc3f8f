"""Sensors that read wrong: true positions to readings and back."""

from __future__ import annotations

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.casadi_form import over_rows, symbol_values, to_casadi
from codegen.mechanics.system import System

Array = NDArray[np.float64]
ITERATIONS = 12


class SensorError:
    """x_measured = x + η(x) on each coordinate whose sensor has a declared error.

    A reading belongs to one position where |η'| < 1, which the catalogue demands.
    """

    def __init__(self, system: System) -> None:
        x = casadi.SX.sym("x", system.degrees_of_freedom)
        names = symbol_values(system.values, (system.positions, x))
        error = casadi.vertcat(*[to_casadi(system.sensor_errors.get(s, s * 0), names) for s in system.positions])
        self._any = bool(system.sensor_errors)
        self._error = casadi.Function("error", [x], [casadi.densify(error)])
        slope = casadi.vertcat(*[casadi.jacobian(error[k], x[k]) for k in range(x.shape[0])])
        self._slope = casadi.Function("slope", [x], [casadi.densify(slope)])

    def measured(self, positions: Array) -> Array:
        """Readings at true positions, both (N, n) or (n,)."""
        return positions + _over(self._error, positions) if self._any else positions

    def true(self, readings: Array) -> Array:
        """Positions that give these readings, by Newton's method; both (N, n) or (n,)."""
        if not self._any:
            return readings
        x = readings - _over(self._error, readings)
        for _ in range(ITERATIONS):
            x = x - (self.measured(x) - readings) / (1 + _over(self._slope, x))
        return np.asarray(x, dtype=float)

    def true_velocities(self, positions: Array, velocities: Array) -> Array:
        """From the rate of readings at true positions."""
        return velocities / (1 + _over(self._slope, positions)) if self._any else velocities


def _over(function: casadi.Function, at: Array) -> Array:
    return over_rows(function, np.atleast_2d(at)).reshape(at.shape)
