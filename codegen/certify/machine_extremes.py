"""Extremes of M(x) and ∂g/∂v over the envelope, for a certificate by structure; estimated by optimisation, not proved.

M⁻¹ and ∂g/∂v are taken from the sampled error matrix: its upper right block is −M⁻¹(x), its upper left block
−k I + M⁻¹∂g/∂v. L is the Cholesky factor, M = L L', and |e|_M = √(e'Me).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.operating_points import matrix_function
from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric, powers_of_ten
from codegen.certify.certificate_text import rounded
from codegen.mechanics.casadi_form import at_points

POINTS = 4000
"""Random points of the envelope."""
KEPT, TRIALS, ROUNDS = 20, 10, 30
"""Random search: number of best points that each round starts from, of trial points about each of them, of rounds."""
DECADES = 4
"""A third of the points have their velocities scaled by 10^-s, s uniform in [0, DECADES]."""
SCALED = 0.3
"""Share of trial points that are scaled rather than shifted."""
MARGIN = 0.1
"""Relative margin on the extremes found."""
SHIFTS = np.linspace(0, 1, 21)
"""Values of ζ that are tried, as shares of the largest norm of M⁻¹∂g/∂v."""
DIGITS = 3
"""Significant digits of the extremes in the certificate."""


@dataclass(frozen=True)
class Extremes:
    """The properties of the machine that a certificate by structure assumes, as estimated, with a margin of 10 %.

    Attributes:
        slowest, fastest: range of the eigenvalues ν of G M⁻¹, 1/s; G is the gain of the force estimate.
        growth: μ of M(x + hv) ≤ (1 + μh) M(x), 1/s, exact.
        shift, slope: ζ and η of |(M⁻¹∂g/∂v + ζI) e|_M ≤ η |e|_M, 1/s, exact.
        points: number of evaluations.
    """

    slowest: float
    fastest: float
    growth: Any
    shift: Any
    slope: Any
    points: int


def extremes(analysis: Analysis, k: float, gain: Array) -> Extremes | None:
    """The extremes over the envelope; None if M depends on a position whose velocity is no variable of A.

    The search starts from random points of the envelope. A third of them has every velocity at an end of its range,
    where the slope of the Coriolis forces is largest; a third has velocities scaled toward zero, where friction laws
    are most nonlinear. For each extreme a random search with decreasing step size and a fixed seed follows.

    Args:
        k: gain K_v = k I, 1/s.
        gain: G, n by n, symmetric and positive definite.
    """
    machine = _Machine(analysis, k, gain)
    if machine.moves is None:
        return None
    random = np.random.default_rng(3)
    first = machine.sampled_points(random)
    slopes = machine.slopes(first)
    shift = float(min(SHIFTS * float(_norms(slopes).max()), key=lambda z: float(_norms(slopes, z).max())))

    def largest(measure: Callable[[Array], Array]) -> float:
        return machine.maximised(measure, first, random)

    slowest = -largest(lambda x: -machine.modes(x)[:, 0])
    fastest = largest(lambda x: machine.modes(x)[:, -1])
    growth = max(largest(machine.growths), 0.0)
    slope = largest(lambda x: _norms(machine.slopes(x), shift))
    return Extremes(
        slowest=slowest * (1 - MARGIN),
        fastest=fastest * (1 + MARGIN),
        growth=_up(growth * (1 + MARGIN)),
        shift=rounded(shift, DIGITS) if shift else sympy.Integer(0),
        slope=_up(slope * (1 + MARGIN)),
        points=POINTS + 4 * ROUNDS * KEPT * TRIALS,
    )


def _bell_shaped(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Random numbers of mean 0 and variance 1, each the sum of three uniform ones in [−1, 1].

    Normally distributed ones are computed with a logarithm, which processors round differently.
    """
    return np.asarray(random.uniform(-1, 1, (3, *shape)).sum(axis=0))


def _up(value: float) -> Any:
    """A decimal of ``DIGITS`` digits, as an exact number, that is not below the value."""
    return rounded(value * (1 + 10.0 ** (1 - DIGITS)), DIGITS) if value else sympy.Integer(0)


def _norms(slopes: Array, shift: float = 0.0) -> Array:
    """The smallest η at each point for a given ζ: |S + ζI|₂, S being ``_Machine.slopes`` there."""
    return np.asarray(np.linalg.norm(slopes + shift * np.eye(slopes.shape[1]), 2, axis=(1, 2)))


class _Machine:
    """M⁻¹ and the slopes of the forces at points of the envelope, points by n by n each.

    A point has a value for each variable of the error matrix (positions and velocities).

    Attributes:
        moves: columns (position, velocity) of each coordinate that varies; None if such a velocity is no variable.
        speeds: columns of the velocities.
        ends: (low, high) of each variable.
        root: √G.
    """

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
        self.function = matrix_function(dynamics, dynamics.in_force(dynamics.sampled), variables)

    def sampled_points(self, random: np.random.Generator) -> Array:
        """The random points with which ``extremes`` starts, and those of the analysis; points by variables."""
        points = random.uniform(self.ends[:, 0], self.ends[:, 1], (POINTS, len(self.ends)))
        third, count = POINTS // 3, len(self.speeds)
        ends = random.integers(0, 2, (third, count))
        points[:third, self.speeds] = self.ends[self.speeds, :][np.arange(count), ends]
        points[third : 2 * third, self.speeds] *= powers_of_ten(-random.uniform(0, DECADES, (third, count)))
        return np.asarray(np.vstack([points, self.analysis.points.values]))

    def maximised(self, measure: Callable[[Array], Array], points: Array, random: np.random.Generator) -> float:
        """The largest value that a random search finds, started at the best ``KEPT`` of these points."""
        best = points[np.argsort(measure(points))[-KEPT:]]
        for size in geometric(0.2, 0.005, ROUNDS):
            width = size * (self.ends[:, 1] - self.ends[:, 0])
            trial = np.repeat(best, TRIALS, axis=0)
            step = size * _bell_shaped(random, trial.shape)
            scaled = trial * (1 + step + step**2 / 2)  # about e^step: a relative step, for points near standstill
            shifted = trial + width * _bell_shaped(random, trial.shape)
            trial = np.where(random.random((len(trial), 1)) < SCALED, scaled, shifted)
            trial = np.clip(trial, self.ends[:, 0], self.ends[:, 1])
            both = np.vstack([best, trial])
            best = both[np.argsort(measure(both))[-KEPT:]]
        return float(measure(best).max())

    def modes(self, points: Array) -> Array:
        """The eigenvalues ν of G M⁻¹, ascending, points by n."""
        return np.linalg.eigvalsh(self.root @ self._blocks(points)[1] @ self.root)

    def growths(self, points: Array) -> Array:
        """The smallest μ at each point: (λ_max(L⁻¹ M(x + hv) L⁻ᵀ) − 1)/h with M(x) = L L'."""
        after = points.copy()
        for x, v in self.moves or ():
            after[:, x] += self.h * points[:, v]
        mass, mass_after = (np.linalg.inv(self._blocks(at)[1]) for at in (points, after))
        inverse = np.linalg.inv(np.linalg.cholesky(mass))
        relative = inverse @ mass_after @ inverse.transpose(0, 2, 1)
        return np.asarray((np.linalg.eigvalsh(relative)[:, -1] - 1) / self.h)

    def slopes(self, points: Array) -> Array:
        """L' (M⁻¹∂g/∂v) L'⁻¹ with M = L L', points by n by n: its 2-norm is the norm of M⁻¹∂g/∂v induced by |e|_M."""
        slope, inverse = self._blocks(points)
        root = np.linalg.cholesky(np.linalg.inv(inverse)).transpose(0, 2, 1)
        return np.asarray(root @ slope @ np.linalg.inv(root))

    def _blocks(self, points: Array) -> tuple[Array, Array]:
        """(M⁻¹∂g/∂v, M⁻¹)."""
        a = at_points(self.function, np.column_stack([points, np.full(len(points), self.h)]))
        return a[:, : self.n, : self.n] + self.k * np.eye(self.n), -a[:, : self.n, self.n :]
