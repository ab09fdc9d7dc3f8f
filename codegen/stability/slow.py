"""A Lyapunov matrix that follows a slow position: P(θ), linear between breakpoints, where one P for all θ is too slow.

θ is a position on which A depends, and its velocity has a range, so a sample moves θ by at most δ = h max|v|. Over an
interval of θ with the slope S of P, the P of the next sample is P(θ) + dS', |d| ≤ δ, with S' between S and the slope
of the next interval; the fall is affine in the pair of both, so the ends of θ and d decide (docs/certificate.md).
P is found at points of the envelope, then the range of θ is halved where the enclosure of A is too wide for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.stability.analysis import Analysis
from codegen.stability.enclosure import Enclosure, exact_ranges
from codegen.stability.family import Family
from codegen.stability.lmi import fall, feasible
from codegen.stability.lyapunov import balance, decay_rate_limit

Array = NDArray[np.float64]
INTERVALS = 16
BISECTIONS = 8
LESS = (0.99, 0.98, 0.97, 0.95, 0.9, 0.8, 0.65, 0.5)
MOST_INTERVALS = 128
MOST_VERTICES = 64


@dataclass(frozen=True, eq=False)
class SlowP:
    """What was found.

    Attributes:
        variable, velocity: θ and its rate, both with a range.
        nodes: values of θ at which P was chosen, exact.
        matrices: P there, m by m; linear in between.
        breaks: where θ is to be cut, among them the nodes, exact.
        alpha: 1/s.
    """

    variable: sympy.Symbol
    velocity: sympy.Symbol
    nodes: list[Fraction]
    matrices: list[Array]
    breaks: list[Fraction]
    alpha: float


def slow_variable(analysis: Analysis, family: Family) -> tuple[sympy.Symbol, sympy.Symbol] | None:
    """The one position on which A depends, with its velocity; None for several, or where that has no range."""
    system = analysis.dynamics.observer.system
    pairs = [p for p in zip(system.positions, system.velocities, strict=True) if p[0] in family.variables]
    known = len(pairs) == 1 and pairs[0][1] in family.variables and not analysis.dynamics.implicit
    return pairs[0] if known else None


def following(family: Family, variable: sympy.Symbol, velocity: sympy.Symbol, h: float) -> SlowP | None:
    """P over θ with nearly the largest rate for which the intervals of θ do not become too many; None if none is found.

    Not looked for where A has more than 64 vertices at one θ: the inequalities would be too many.

    Args:
        variable, velocity: θ and its rate.
        h: sample time of the explicit step, s.
    """
    low, high = (Fraction(int(end.p), int(end.q)) for end in family.variables[variable])
    nodes = [low + k * (high - low) / INTERVALS for k in range(INTERVALS + 1)]
    reach = max(abs(float(end)) for end in family.variables[velocity])
    if not 0 < h * reach < float(high - low) / MOST_INTERVALS:
        return None
    search = _Search(family, variable, nodes, h, reach)
    if max(map(len, search.samples)) > MOST_VERTICES:
        return None
    limit = decay_rate_limit([a for row in search.samples for a in row], h)
    if limit <= 0:
        return None
    slow, fast, best = 0.0, limit, None
    for _ in range(BISECTIONS):
        alpha = (slow + fast) / 2
        found = search.matrices(alpha)
        slow, fast, best = (slow, alpha, best) if found is None else (alpha, fast, found)
    if best is None:
        return None
    for share in LESS:
        breaks = search.breaks(best, share * slow)
        if breaks is not None:
            return SlowP(variable, velocity, nodes, [search.unscaled(p) for p in best], breaks, share * slow)
    return None


def shares(nodes: list[Fraction], at: Fraction) -> dict[int, Fraction]:
    """Node → its share of what is linear between nodes, exact."""
    k = max(i for i, node in enumerate(nodes[:-1]) if node <= at)
    later = (at - nodes[k]) / (nodes[k + 1] - nodes[k])
    return {i: share for i, share in ((k, 1 - later), (k + 1, later)) if share}


class _Search:
    """A over intervals of θ, in coordinates in which its entries are alike, and what is asked of P there."""

    def __init__(self, family: Family, variable: sympy.Symbol, nodes: list[Fraction], h: float, reach: float) -> None:
        self.variable, self.nodes, self.h, self.reach = variable, nodes, h, reach
        self.enclosure, self.ranges = Enclosure(family), exact_ranges(family)
        self.points = sorted({*nodes, *((a + b) / 2 for a, b in pairwise(nodes))})
        raw = [self._vertices(at, at) for at in self.points]
        self.scale = balance([a for row in raw for a in row])
        self.samples = [self._scaled(row) for row in raw]

    def matrices(self, alpha: float) -> list[Array] | None:
        """P at the nodes so that V falls at the sampled values of θ."""
        rate = max(1.0, max(float(np.abs(a).max()) for row in self.samples for a in row))
        unit = np.eye(len(self.scale) ** 2)
        conditions = []
        for at, row in zip(self.points, self.samples, strict=True):
            here, slopes = self._shares(at), self._slopes(at, at)
            for a, slope, speed in product(row, slopes, (-self.reach, self.reach)):
                now, moved = fall(a, self.h, alpha), self.h * fall(a, self.h, 0.0) - unit
                parts = {k: here.get(k, 0.0) * now + speed * slope.get(k, 0.0) * moved for k in {*here, *slope}}
                conditions.append({k: part / rate for k, part in parts.items()})
        return feasible(conditions, len(self.nodes), len(self.scale))

    def breaks(self, matrices: list[Array], alpha: float) -> list[Fraction] | None:
        """Cuts of θ with which V falls at the rate α over every interval; None where they would be too many."""
        waiting, done = [*pairwise(self.nodes)][::-1], [self.nodes[0]]
        while waiting and len(done) + len(waiting) <= MOST_INTERVALS:
            a, b = waiting.pop()
            if self._falls(matrices, a, b, alpha):
                done.append(b)
            else:
                waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
        return None if waiting else done

    def unscaled(self, p: Array) -> Array:
        """P in the coordinates of the error."""
        return p / self.scale[None, :] / self.scale[:, None]

    def _falls(self, matrices: list[Array], a: Fraction, b: Fraction, alpha: float) -> bool:
        steps = np.eye(len(self.scale)) + self.h * np.array(self._scaled(self._vertices(a, b)))
        slopes = [sum(s * matrices[k] for k, s in slope.items()) for slope in self._slopes(a, b)]
        for end, slope, speed in product((a, b), slopes, (-self.reach, self.reach)):
            p = sum(share * matrices[k] for k, share in self._shares(end).items())
            later = p + self.h * speed * slope
            gap = (1 - 2 * alpha * self.h) * p - steps.transpose(0, 2, 1) @ later @ steps
            if np.linalg.eigvalsh(gap)[:, 0].min() <= 0:
                return False
        return True

    def _vertices(self, a: Fraction, b: Fraction) -> list[Array]:
        return self.enclosure.vertices({self.enclosure.ranges(self.ranges | {self.variable: (a, b)})})

    def _scaled(self, matrices: list[Array]) -> list[Array]:
        return [a * self.scale[None, :] / self.scale[:, None] for a in matrices]

    def _shares(self, at: Fraction) -> dict[int, float]:
        """Node → its share of P there."""
        return {k: float(s) for k, s in shares(self.nodes, at).items()}

    def _slopes(self, a: Fraction, b: Fraction) -> list[dict[int, float]]:
        """Node → its share of the slope of P, for each interval between nodes that [a, b] touches."""
        between = [(k, p, q) for k, (p, q) in enumerate(pairwise(self.nodes)) if p <= b and a <= q]
        return [{k: -1 / float(q - p), k + 1: 1 / float(q - p)} for k, p, q in between]
