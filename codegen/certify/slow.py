"""A parameter-dependent Lyapunov matrix P(θ), linear between breakpoints, where a common P is too slow.

θ is a position on which A depends, its velocity v has a range, and a sample moves θ by h(v + σ), |σ| ≤ h max|v̇|/2.
Where A holds one product of slip signs, each value of it has its own P: between reversals it stays. P is found at
points of the envelope, then the range of θ is halved where A deviates too far from its chord for it; the conditions on
an interval are tested by the checker too (docs/certificate_theory.md), here in floating point.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.linalg import eigh

from codegen.analysis.analysis import Analysis
from codegen.certify.enclosure import Enclosure, exact_ranges
from codegen.certify.family import Family
from codegen.certify.lmi import fall, feasible
from codegen.certify.lyapunov import balance, decay_rate_limit
from codegen.certify.slow_cuts import SlowP, cut, mean_speeds, shares
from codegen.certify.slow_family import along

Array = NDArray[np.float64]
INTERVALS = 12
BELOW = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.5, 0.7)
FINEST = 16 * INTERVALS
MOST_CORNERS = 64


def slow_variable(analysis: Analysis, family: Family) -> tuple[sympy.Symbol, sympy.Symbol] | None:
    """The one position on which A depends, with its velocity; None for several, or where that has no range."""
    system = analysis.dynamics.observer.system
    pairs = [p for p in zip(system.positions, system.velocities, strict=True) if p[0] in family.variables]
    known = len(pairs) == 1 and pairs[0][1] in family.variables and not analysis.dynamics.implicit
    return pairs[0] if known else None


def following(
    family: Family,
    variable: sympy.Symbol,
    velocity: sympy.Symbol,
    h: float,
    signs: tuple[sympy.Symbol, ...] = (),
    acceleration: Fraction | None = None,
) -> SlowP | None:
    """P over θ with nearly the largest rate for which the intervals of θ do not become too many; None if none is found.

    Not looked for where the rest of A has more than 64 corners: the inequalities would be too many.

    Args:
        variable, velocity: θ and its rate.
        h: sample time of the explicit step, s.
        signs: of all slips; they hold between reversals.
        acceleration: the largest |dv/dt|; None if it is not known.
    """
    form, ends = along(family, variable, velocity), exact_ranges(family)
    (low, high), (slow, fast) = ends[variable], ends[velocity]
    reach = h * float(max(abs(slow), abs(fast)))
    if form is None or not 0 < reach < float(high - low) / FINEST:
        return None
    period = Fraction(str(h))
    stray = fast - slow if acceleration is None else min(fast - slow, acceleration * period / 2)
    chosen = [e.free_symbols for e in form.parameters.values() if e.free_symbols and e.free_symbols <= {*signs}]
    own = tuple(sorted(chosen[0], key=str)) if len(chosen) == 1 else ()
    held = [dict.fromkeys(own, 1) | turned for turned in ({}, dict.fromkeys(own[:1], -1))[: 1 + bool(own)]]
    nodes = [low + k * (high - low) / INTERVALS for k in range(INTERVALS + 1)]
    found = SlowP(form, variable, velocity, stray, own, nodes, [], nodes, Fraction(0))
    searches = [_Search(found, h, signs_held) for signs_held in held]
    if max(len(row) for s in searches for row in s.samples) > MOST_CORNERS:
        return None
    limit = min(decay_rate_limit([a for row in s.samples for _, a in row], h) for s in searches)
    for below in BELOW if limit > 0 else ():
        alpha = limit * (1 - below)
        matrices = [p for p in (s.matrices(alpha) for s in searches) if p is not None]
        if len(matrices) == len(searches):
            return cut(found, _levelled(matrices), period, alpha)
    return None


def _levelled(matrices: list[list[Array]]) -> list[list[Array]]:
    """P for the two products of the signs in such a proportion that V grows alike from either to the other."""
    if len(matrices) == 1:
        return matrices
    there, back = (
        max(float(eigh(q, p, eigvals_only=True)[-1]) for p, q in zip(*order, strict=True))
        for order in (matrices, matrices[::-1])
    )
    return [matrices[0], [p * np.sqrt(back / there) for p in matrices[1]]]


class _Search:
    """A at points of θ, in coordinates in which its entries are alike, and what is asked of P there."""

    def __init__(self, found: SlowP, h: float, signs: Mapping[sympy.Symbol, int]) -> None:
        self.nodes, self.h = found.nodes, h
        self.points = sorted({*found.nodes, *((a + b) / 2 for a, b in pairwise(found.nodes))})
        enclosure, ranges = Enclosure(found.family), exact_ranges(found.family)
        ranges |= {sign: (Fraction(x), Fraction(x)) for sign, x in signs.items()}

        def corners(at: Fraction) -> list[tuple[tuple[float, float], Array]]:
            """The mean velocities of a sample and A, for either end of the velocity at its start."""
            return [
                (speeds, a)
                for v, speeds in mean_speeds(ranges[found.velocity], found.stray).items()
                for here in [ranges | {found.variable: (at, at), found.velocity: (v, v)}]
                for a in enclosure.vertices({enclosure.ranges(here)})
            ]

        raw = [corners(at) for at in self.points]
        self.scale = balance([a for row in raw for _, a in row])
        self.samples = [[(v, a * self.scale[None, :] / self.scale[:, None]) for v, a in row] for row in raw]

    def matrices(self, alpha: float) -> list[Array] | None:
        """P at the nodes so that V falls at the sampled values of θ."""
        rate = max(1.0, max(float(np.abs(a).max()) for row in self.samples for _, a in row))
        unit = np.eye(len(self.scale) ** 2)
        conditions = []
        for at, row in zip(self.points, self.samples, strict=True):
            here, slopes = shares(self.nodes, at), self._slopes(at)
            for speeds, a in row:
                now, moved = fall(a, self.h, alpha), self.h * fall(a, self.h, 0.0) - unit
                for slope, speed in product(slopes, speeds):
                    parts = {
                        k: float(here.get(k, 0)) * now + speed * slope.get(k, 0.0) * moved for k in {*here, *slope}
                    }
                    conditions.append({k: part / rate for k, part in parts.items()})
        found = feasible(conditions, len(self.nodes), len(self.scale))
        return None if found is None else [p / self.scale[None, :] / self.scale[:, None] for p in found]

    def _slopes(self, at: Fraction) -> list[dict[int, float]]:
        """Node → its share of the slope of P, for each interval between nodes that the point touches."""
        between = [(k, p, q) for k, (p, q) in enumerate(pairwise(self.nodes)) if p <= at <= q]
        return [{k: -1 / float(q - p), k + 1: 1 / float(q - p)} for k, p, q in between]
