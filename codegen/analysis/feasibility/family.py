"""Vectorised evaluation of Ψ and the sampled matrix over operating points and gains, and of their worst eigenvalues."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.feasibility.axes import SAMPLE_TIME, GainAxis
from codegen.analysis.operating_points import OperatingPoints, evaluate_columns, matrix_function
from codegen.base.arrays import Array

BATCH = 60_000


@dataclass(frozen=True)
class Settings:
    """Gain sets, each with a sample time.

    Attributes:
        gains: sets by gain symbols, in the order of ``symbols``.
        sample_time: s, one a set.
    """

    symbols: tuple[sympy.Symbol, ...]
    gains: Array
    sample_time: Array

    def __len__(self) -> int:
        return len(self.gains)

    @property
    def columns(self) -> Array:
        """Gains and sample time, sets by (gains + 1)."""
        return np.column_stack([self.gains, self.sample_time])

    def along(self, axis: GainAxis, values: Any) -> Settings:
        """These sets with the numbers of one axis replaced; a single set is repeated for each value."""
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


class Family:
    """The error dynamics of one observer as functions of gains and sample time.

    Operating points with equal matrices are evaluated once. ``focus`` finds the deciding points, and ``worst``
    evaluates only these unless all are asked for.

    Attributes:
        every: indices of distinct points; ``active`` of the deciding ones.
    """

    def __init__(self, dynamics: ErrorDynamics, points: OperatingPoints) -> None:
        self.dynamics, self.points = dynamics, points
        self.symbols = tuple(dynamics.observer.gains)
        self._functions = {
            name: matrix_function(dynamics, dynamics.in_force(matrix), points, self.symbols)
            for name, matrix in (("continuous", dynamics.jacobian), ("sampled", dynamics.sampled))
        }
        self.every = self.active = np.arange(len(points.values))

    def settings(self) -> Settings:
        """The spec's own gains and sample time, one set."""
        observer = self.dynamics.observer
        gains = np.array([[float(observer.gains[s]) for s in self.symbols]])
        return Settings(self.symbols, gains, np.array([float(observer.sample_time)]))

    def matrices(self, which: str, settings: Settings, at: Any = None) -> Array:
        """Ψ ("continuous") or A ("sampled") in force errors: sets by points by m by m."""
        at = self.active if at is None else np.asarray(at)
        sets, count = len(settings), len(at)
        values = np.tile(self.points.values[at], (sets, 1))
        result = evaluate_columns(self._functions[which], values, np.repeat(settings.columns, count, axis=0))
        return result.reshape(sets, count, *result.shape[1:])

    def measures(self, which: str, settings: Settings, at: Any = None) -> Array:
        """At each set and point: the largest |z| of I + hA ("sampled") or real part of Ψ in 1/s ("continuous").

        Infinite where a matrix is not finite.
        """
        at = self.active if at is None else np.asarray(at)
        step = max(1, BATCH // len(at))
        return np.vstack(
            [self._measures(which, settings.rows(slice(k, k + step)), at) for k in range(0, len(settings), step)]
        )

    def worst(self, which: str, settings: Settings, every: bool = False) -> Array:
        """The largest measure over the points, one a set."""
        found: Array = self.measures(which, settings, self.every if every else None).max(axis=1)
        return found

    def worst_eigenvalue(self, which: str, settings: Settings, at: int) -> complex:
        """That which decides the measure of one set at a point, of Ψ or z of the sampled error; its upper conjugate."""
        values = np.linalg.eigvals(self.matrices(which, settings, [at])[0, 0])
        values = self.dynamics.multipliers(values, float(settings.sample_time[0])) if which == "sampled" else values
        worst = complex(values[(np.abs(values) if which == "sampled" else values.real).argmax()])
        return complex(worst.real, abs(worst.imag))

    def start(self, settings: Settings) -> None:
        """Remove points with equal matrices at all of these sets, and find the deciding ones."""
        few = settings.rows(slice(0, 3))
        both = [self.matrices(which, few, self.every) for which in self._functions]
        flat = np.concatenate([m.transpose(1, 0, 2, 3).reshape(len(self.every), -1) for m in both], axis=1)
        self.every = self.every[np.sort(np.unique(flat, axis=0, return_index=True)[1])]
        self.active = self.every[:0]
        self.focus(settings)

    def focus(self, settings: Settings) -> None:
        """Add the points at which one of these sets is worst to the deciding ones."""
        at = [self.every[self.measures(w, settings, self.every).argmax(axis=1)] for w in self._functions]
        self.active = np.unique(np.concatenate([self.active, *at]))

    def _measures(self, which: str, settings: Settings, at: Any) -> Array:
        matrices = self.matrices(which, settings, at)
        finite = np.asarray(np.isfinite(matrices).all(axis=(2, 3)))
        eigenvalues = np.linalg.eigvals(np.where(finite[:, :, None, None], matrices, 0.0))
        if which == "sampled":
            measure = np.abs(self.dynamics.multipliers(eigenvalues, settings.sample_time[:, None, None])).max(axis=2)
        else:
            measure = eigenvalues.real.max(axis=2)
        return np.where(finite, measure, np.inf)
