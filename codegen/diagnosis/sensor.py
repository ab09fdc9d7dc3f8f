"""Encoder errors in a fit: true states from readings, and readings from positions."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import System

Array = NDArray[np.float64]

ITERATIONS, POLISHES = 8, 3
LEAST_SLOPE = 0.2
"""Least slope of a reading over position; below it the reading does not determine the state and is not corrected."""


class Sensors:
    """The position sensors of a system with their declared errors.

    Attributes:
        symbols: whose values every method is given, in order.
    """

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        self._system, self.symbols = system, symbols
        self._wrong = [i for i, x in enumerate(system.positions) if system.sensor_errors.get(x, 0) != 0]

    def true(self, states: Array, numbers: Array) -> Array:
        """(S, 2n) true states for readings ``states``, by fixed-point iteration and then Newton's method."""
        if not self._wrong:
            return states
        n = self._system.degrees_of_freedom
        read, states = states, states.copy()
        with np.errstate(invalid="ignore", over="ignore"):  # for too steep errors the reading is not invertible
            for turn in range(ITERATIONS + POLISHES):
                errors = self._at(self._errors, states[:, :n], numbers)
                slopes = self._slopes_at(states, numbers) if turn >= ITERATIONS else [1.0] * len(errors)
                for i, error, slope in zip(self._wrong, errors, slopes, strict=True):
                    states[:, i] += (read[:, i] - states[:, i] - error) / slope
            for i, slope in zip(self._wrong, self._slopes_at(states, numbers), strict=True):
                states[:, n + i] /= slope
        return states

    def _slopes_at(self, states: Array, numbers: Array) -> list[Any]:
        """Slopes of the readings by position."""
        slopes = self._at(self._slopes, states[:, : self._system.degrees_of_freedom], numbers)
        return [np.where(np.abs(1 + slope) > LEAST_SLOPE, 1 + slope, 1.0) for slope in slopes]

    def measured(self, positions: Array, numbers: Array) -> Array:
        """Readings at positions (..., n)."""
        if not self._wrong:
            return positions
        read = positions.copy()
        with np.errstate(invalid="ignore", over="ignore"):  # mean_residuals handles diverged runs
            for i, error in zip(self._wrong, self._at(self._errors, positions, numbers), strict=True):
                read[..., i] += error
        return read

    def _at(self, function: Any, positions: Array, numbers: Array) -> list[Any]:
        n = self._system.degrees_of_freedom
        return list(function(*(positions[..., i] for i in range(n)), *numbers))

    @cached_property
    def _errors(self) -> Any:
        return self._compiled(lambda error, x: error)

    @cached_property
    def _slopes(self) -> Any:
        return self._compiled(lambda error, x: error.diff(x))

    def _compiled(self, form: Any) -> Any:
        system = self._system
        wrong = [system.positions[i] for i in self._wrong]
        expressions = [form(system.sensor_errors[x], x) for x in wrong]
        return numpy_function(expressions, (*system.positions, *self.symbols), system.values)
