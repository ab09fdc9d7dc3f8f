"""The extremes of a machine over the envelope that a certificate by structure rests on, estimated by optimisation.

From the sampled error matrix alone: its upper right block is −M⁻¹(x), its upper left −k I + M⁻¹∂g/∂v.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.operating_points import evaluate_columns, matrix_function
from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric, powers_of_ten
from codegen.certify.prefix import rounded

POINTS = 4000
KEPT, CHILDREN, ROUNDS = 20, 10, 30
DECADES = 4
SCALED = 0.3
MARGIN = 0.1
SHIFTS = np.linspace(0, 1, 21)
DIGITS = 3


@dataclass(frozen=True)
class Extremes:
    """Over the sampled operating points, with a margin of 10 %.

    Attributes:
        slowest, fastest: eigenvalues ν of G M⁻¹, 1/s.
        growth: μ, M(x + hv) ≤ (1 + μh) M(x), 1/s, exact.
        shift, slope: ζ, η: |(M⁻¹∂g/∂v + ζ) e|_M ≤ η |e|_M, 1/s, exact.
    """

    slowest: float
    fastest: float
    growth: Any
    shift: Any
    slope: Any
    points: int


def extremes(analysis: Analysis, k: float, gain: Array) -> Extremes | None:
    """The extremes; None where a position that moves M has no velocity among the variables of the error matrix.

    A random sample of the envelope, a third of it with every velocity at an end of its range (where the slope of the
    Coriolis forces is largest) and a third with each scaled toward standstill (where a declared law curves most); then,
    for each extreme, a random search from the best points with decreasing step size. Deterministic.
    """
    machine = _Machine(analysis, k, gain)
    if machine.moves is None:
        return None
    dice = np.random.default_rng(3)
    first = machine.sampled_points(dice)
    seen = machine.slopes(first)
    shift = float(min(SHIFTS * float(_norms(seen).max()), key=lambda z: float(_norms(seen, z).max())))
    measures: list[Callable[[Array], Array]] = [
        lambda x: -machine.modes(x)[:, 0],
        lambda x: machine.modes(x)[:, -1],
        machine.growths,
        lambda x: _norms(machine.slopes(x), shift),
    ]
    worst = [machine.maximised(measure, first, dice) for measure in measures]
    more = 1 + MARGIN
    return Extremes(
        slowest=-worst[0] * (1 - MARGIN),
        fastest=worst[1] * more,
        growth=_up(max(worst[2], 0.0) * more),
        shift=rounded(shift, DIGITS) if shift else sympy.Integer(0),
        slope=_up(worst[3] * more),
        points=POINTS + len(measures) * ROUNDS * KEPT * CHILDREN,
    )


def _bell_shaped(dice: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Random numbers of mean 0 and variance 1 without a logarithm, which machines round differently."""
    return np.asarray(dice.uniform(-1, 1, (3, *shape)).sum(axis=0))


def _up(value: float) -> Any:
    return rounded(value * (1 + 10.0 ** (1 - DIGITS)), DIGITS) if value else sympy.Integer(0)


def _norms(slopes: Array, shift: float = 0.0) -> Array:
    """The smallest η at each point, for a given ζ."""
    return np.asarray(np.linalg.norm(slopes + shift * np.eye(slopes.shape[1]), 2, axis=(1, 2)))


class _Machine:
    """M⁻¹ and the slopes of the forces at points of the envelope, points by n by n each."""

    def __init__(self, analysis: Analysis, k: float, gain: Array) -> None:
        self.analysis, self.k, self.n = analysis, k, len(gain)
        values, vectors = np.linalg.eigh(gain)
        self.root = vectors * np.sqrt(values) @ vectors.T
        variables, system = analysis.points.variables, analysis.dynamics.observer.system
        self.ends = np.array([[float(e) for e in analysis.points.ranges[s]] for s in variables]).reshape(-1, 2)
        column = {s: i for i, s in enumerate(variables)}
        pairs = [(x, v) for x, v in zip(system.positions, system.velocities, strict=True) if x in column]
        self.moves = [(column[x], column[v]) for x, v in pairs] if all(v in column for _, v in pairs) else None
        self.speeds = [column[v] for v in system.velocities if v in column]
        self.h, dynamics = float(analysis.dynamics.observer.sample_time), analysis.dynamics
        self.function = matrix_function(dynamics, dynamics.in_force(dynamics.sampled), analysis.points, ())

    def sampled_points(self, dice: np.random.Generator) -> Array:
        points = dice.uniform(self.ends[:, 0], self.ends[:, 1], (POINTS, len(self.ends)))
        third, count = POINTS // 3, len(self.speeds)
        ends = dice.integers(0, 2, (third, count))
        points[:third, self.speeds] = self.ends[self.speeds, :][np.arange(count), ends]
        points[third : 2 * third, self.speeds] *= powers_of_ten(-dice.uniform(0, DECADES, (third, count)))
        return np.asarray(np.vstack([points, self.analysis.points.values]))

    def maximised(self, measure: Callable[[Array], Array], points: Array, dice: np.random.Generator) -> float:
        """The largest value found by a random search that starts at the best of these points."""
        best = points[np.argsort(measure(points))[-KEPT:]]
        for reach in geometric(0.2, 0.005, ROUNDS):
            width = reach * (self.ends[:, 1] - self.ends[:, 0])
            moved = np.repeat(best, CHILDREN, axis=0)
            step = reach * _bell_shaped(dice, moved.shape)
            scaled = moved * (1 + step + step**2 / 2)  # near standstill a step is a factor
            shifted = moved + width * _bell_shaped(dice, moved.shape)
            moved = np.where(dice.random((len(moved), 1)) < SCALED, scaled, shifted)
            moved = np.clip(moved, self.ends[:, 0], self.ends[:, 1])
            both = np.vstack([best, moved])
            best = both[np.argsort(measure(both))[-KEPT:]]
        return float(measure(best).max())

    def modes(self, points: Array) -> Array:
        """ν, ascending, points by n."""
        return np.linalg.eigvalsh(self.root @ self._blocks(points)[1] @ self.root)

    def growths(self, points: Array) -> Array:
        """The smallest μ at each point."""
        after = points.copy()
        for x, v in self.moves or ():
            after[:, x] += self.h * points[:, v]
        lower, later = np.linalg.cholesky(np.linalg.inv(self._blocks(points)[1])), self._blocks(after)[1]
        left = np.linalg.inv(lower)
        seen = left @ np.linalg.inv(later) @ left.transpose(0, 2, 1)
        return np.asarray((np.linalg.eigvalsh(seen)[:, -1] - 1) / self.h)

    def slopes(self, points: Array) -> Array:
        """M⁻¹∂g/∂v in coordinates in which |e|_M is the plain length, points by n by n."""
        slope, inverse = self._blocks(points)
        root = np.linalg.cholesky(np.linalg.inv(inverse)).transpose(0, 2, 1)
        return np.asarray(root @ slope @ np.linalg.inv(root))

    def _blocks(self, points: Array) -> tuple[Array, Array]:
        """(M⁻¹∂g/∂v, M⁻¹)."""
        a = evaluate_columns(self.function, points, np.full((len(points), 1), self.h))
        return a[:, : self.n, : self.n] + self.k * np.eye(self.n), -a[:, : self.n, self.n :]
