"""Vectorised evaluation of Ψ and the sampled matrix over operating points and gains, and of their worst eigenvalues."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.feasibility.axes import SAMPLE_TIME, GainAxis
from codegen.analysis.operating_points import OperatingPoints, matrix_function
from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import at_points

BATCH = 60_000
"""Most pairs of gain set and operating point that are evaluated at once."""


@dataclass(frozen=True)
class Settings:
    """Several gain sets, each with a sample time.

    Attributes:
        gains: (sets, gain symbols), in the order of ``symbols``.
        sample_time: (sets,) in s.
    """

    symbols: tuple[sympy.Symbol, ...]
    gains: Array
    sample_time: Array

    def __len__(self) -> int:
        return len(self.gains)

    @property
    def columns(self) -> Array:
        """Gains and sample time, (sets, gains + 1)."""
        return np.column_stack([self.gains, self.sample_time])

    def along(self, axis: GainAxis, values: Any) -> Settings:
        """The sets with the values of one axis replaced; a single set is repeated for each value."""
        values = np.atleast_1d(np.asarray(values, dtype=float))
        gains, period = self.gains, self.sample_time
        if len(self) == 1 != len(values):
            gains, period = np.repeat(gains, len(values), axis=0), np.repeat(period, len(values))
        if axis.name == SAMPLE_TIME and not axis.weights:
            return Settings(self.symbols, gains, values)
        gains = gains.copy()
        for s, weight in axis.weights.items():
            gains[:, self.symbols.index(s)] = weight * values
        return Settings(self.symbols, gains, period)

    def numbers(self, axis: GainAxis) -> Array:
        """The number of an axis in every set."""
        s, weight = next(iter(axis.weights.items()))
        return np.asarray(self.gains[:, self.symbols.index(s)] / weight)

    def rows(self, index: Any) -> Settings:
        """Some of the sets."""
        return Settings(self.symbols, self.gains[index], self.sample_time[index])


def joined(parts: Sequence[Settings]) -> Settings:
    """The sets of several Settings, in order."""
    return Settings(
        parts[0].symbols, np.vstack([p.gains for p in parts]), np.concatenate([p.sample_time for p in parts])
    )


class GainDynamics:
    """Ψ and A of one observer as numerical functions of gains, sample time and operating point.

    Points with equal matrices are evaluated once. To save time most evaluations are at the deciding points only: those
    at which some gain set was found to be worst.

    Attributes:
        every: indices of the distinct points.
        active: indices of the deciding points.
    """

    def __init__(self, dynamics: ErrorDynamics, points: OperatingPoints) -> None:
        self.symbolic, self.points = dynamics, points
        self.symbols = tuple(dynamics.observer.gains)
        self._functions = {
            name: matrix_function(dynamics, dynamics.in_force(matrix), points.variables, self.symbols)
            for name, matrix in (("continuous", dynamics.jacobian), ("sampled", dynamics.sampled))
        }
        self.every = self.active = np.arange(len(points.values))

    def settings(self) -> Settings:
        """The spec's own gains and sample time, one set."""
        observer = self.symbolic.observer
        gains = np.array([[float(observer.gains[s]) for s in self.symbols]])
        return Settings(self.symbols, gains, np.array([float(observer.sample_time)]))

    def matrices(self, which: str, settings: Settings, at: Any = None) -> Array:
        """Ψ ("continuous") or A ("sampled") in force errors, (sets, points, m, m). ``at``: deciding points."""
        at = self.active if at is None else np.asarray(at)
        sets, count = len(settings), len(at)
        values = np.tile(self.points.values[at], (sets, 1))
        result = at_points(self._functions[which], np.hstack([values, np.repeat(settings.columns, count, axis=0)]))
        return result.reshape(sets, count, *result.shape[1:])

    def measures(self, which: str, settings: Settings, at: Any = None) -> Array:
        """Spectral radius of the step ("sampled"), or spectral abscissa of Ψ in 1/s ("continuous"); (sets, points).

        Infinite where a matrix is not finite.
        """
        at = self.active if at is None else np.asarray(at)
        step = max(1, BATCH // len(at))
        return np.vstack(
            [self._measures(which, settings.rows(slice(k, k + step)), at) for k in range(0, len(settings), step)]
        )

    def worst(self, which: str, settings: Settings, every: bool = False) -> Array:
        """The largest measure over the deciding points, or over all points with ``every``; (sets,)."""
        found: Array = self.measures(which, settings, self.every if every else None).max(axis=1)
        return found

    def worst_eigenvalue(self, which: str, settings: Settings, at: int) -> complex:
        """The eigenvalue that determines the measure of one set at a point, with non-negative imaginary part."""
        values = np.linalg.eigvals(self.matrices(which, settings, [at])[0, 0])
        values = self.symbolic.multipliers(values, float(settings.sample_time[0])) if which == "sampled" else values
        worst = complex(values[(np.abs(values) if which == "sampled" else values.real).argmax()])
        return complex(worst.real, abs(worst.imag))

    def start(self, settings: Settings) -> None:
        """Remove points with equal matrices (at the first three sets), and find the deciding points of all sets."""
        few = settings.rows(slice(0, 3))
        both = [self.matrices(which, few, self.every) for which in self._functions]
        flat = np.concatenate([m.transpose(1, 0, 2, 3).reshape(len(self.every), -1) for m in both], axis=1)
        self.every = self.every[np.sort(np.unique(flat, axis=0, return_index=True)[1])]
        self.active = self.every[:0]
        self.focus(settings)

    def focus(self, settings: Settings) -> None:
        """Add to the deciding points those at which one of these sets is worst."""
        at = [self.every[self.measures(w, settings, self.every).argmax(axis=1)] for w in self._functions]
        self.active = np.unique(np.concatenate([self.active, *at]))

    def _measures(self, which: str, settings: Settings, at: Any) -> Array:
        matrices = self.matrices(which, settings, at)
        finite = np.asarray(np.isfinite(matrices).all(axis=(2, 3)))
        eigenvalues = np.linalg.eigvals(np.where(finite[:, :, None, None], matrices, 0.0))
        if which == "sampled":
            measure = np.abs(self.symbolic.multipliers(eigenvalues, settings.sample_time[:, None, None])).max(axis=2)
        else:
            measure = eigenvalues.real.max(axis=2)
        return np.where(finite, measure, np.inf)
