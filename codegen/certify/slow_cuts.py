"""A parameter-dependent P(θ) as the certificate states it, and the breakpoints of θ at which the checker accepts it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.certify.decimals import rounded, rounded_matrix
from codegen.certify.enclosure import exact_ranges
from codegen.certify.family import Family
from codegen.certify.prefix import to_prefix
from codegen.checker import verify

Array = NDArray[np.float64]
Exact = list[list[Fraction]]
LESS = (0.997, 0.994, 0.99, 0.98, 0.95, 0.9, 0.8, 0.65, 0.5)
DIGITS = 6
HALVINGS = 7


@dataclass(frozen=True, eq=False)
class SlowP:
    """What was found.

    Attributes:
        family: A in functions of θ alone and factors free of it.
        variable, velocity: θ and its rate, both with a range.
        stray: how far the mean velocity of a sample is from that at its start; the width of its range if unknown.
        signs: the slip signs whose product chooses P; none if P(θ) is common to all.
        nodes: values of θ at which P was chosen, exact.
        matrices: P there, m by m, exact, linear in between; for the product 1, then for −1.
        breaks: where θ is to be cut, among them the nodes, exact.
        alpha: 1/s, exact.
    """

    family: Family
    variable: sympy.Symbol
    velocity: sympy.Symbol
    stray: Fraction
    signs: tuple[sympy.Symbol, ...]
    nodes: list[Fraction]
    matrices: list[list[Exact]]
    breaks: list[Fraction]
    alpha: Fraction

    @property
    def known_stray(self) -> float | None:
        """``stray``; None where the mean velocity may be anything in its range."""
        low, high = exact_ranges(self.family)[self.velocity]
        return None if self.stray >= high - low else float(self.stray)


def mean_speeds(range_of_velocity: tuple[Fraction, Fraction], stray: Fraction) -> dict[Fraction, tuple[float, float]]:
    """The velocity at the start of a sample, at either end of its range → the least and largest mean of the sample."""
    low, high = range_of_velocity
    far = stray >= high - low
    return {v: (float(low), float(high)) if far else (float(v - stray), float(v + stray)) for v in (low, high)}


def shares(nodes: Sequence[Fraction], at: Fraction) -> dict[int, Fraction]:
    """Node → its share of what is linear between nodes, exact."""
    k = max(i for i, node in enumerate(nodes[:-1]) if node <= at)
    later = (at - nodes[k]) / (nodes[k + 1] - nodes[k])
    return {i: share for i, share in ((k, 1 - later), (k + 1, later)) if share}


def fields(found: SlowP) -> dict[str, Any]:
    """What a certificate says of it, with its numbers as Fractions."""
    matrices = found.matrices
    at = [shares(found.nodes, b) for b in found.breaks]
    size = range(len(matrices[0][0]))

    def there(nodes: list[Exact], here: dict[int, Fraction]) -> Exact:
        return [[sum((s * nodes[k][i][j] for k, s in here.items()), Fraction(0)) for j in size] for i in size]

    each = [[there(nodes, here) for here in at] for nodes in matrices]
    entry = {"variable": found.variable.name, "velocity": found.velocity.name, "stray": found.stray}
    return {
        "splits": {found.variable.name: found.breaks},
        "parameters": [{"name": s.name, "expression": to_prefix(e)} for s, e in found.family.parameters.items()],
        "matrix": [[to_prefix(e) for e in found.family.matrix.row(i)] for i in size],
        "slow": [entry | {"signs": [s.name for s in found.signs], "matrices": each}],
    }


def cut(found: SlowP, matrices: list[list[Array]], h: Fraction, alpha: float) -> SlowP | None:
    """P in short numbers, and θ halved where the checker asks for it; a lower rate, where it asks for much.

    Args:
        matrices: P at the nodes, for every product of the signs.
        alpha: 1/s, at which V falls at the sampled points.
    """
    size = np.max([np.sqrt(np.diag(p)) for each in matrices for p in each], axis=0)
    exact = [[_fractions(rounded_matrix(p, DIGITS, size)) for p in each] for each in matrices]
    for share in LESS:
        rate = Fraction(str(rounded(share * alpha, DIGITS)))
        cuts, asked = replace(found, matrices=exact, breaks=found.nodes, alpha=rate), {*pairwise(found.nodes)}
        for _ in range(HALVINGS):
            halved = {a: (a + b) / 2 for a, b in _failing(cuts, h, asked)}
            if not halved:
                return cuts
            cuts = replace(cuts, breaks=sorted({*cuts.breaks, *halved.values()}))
            asked = {(a, b) for a, b in pairwise(cuts.breaks) if a in halved or a in halved.values()}
    return None


def _fractions(rows: list[list[Any]]) -> Exact:
    return [[Fraction(str(x)) for x in row] for row in rows]


def _failing(found: SlowP, h: Fraction, asked: set[tuple[Fraction, Fraction]]) -> Iterator[tuple[Fraction, Fraction]]:
    """The intervals among those asked on which V may not fall."""
    axes = {v.name: [ends] for v, ends in exact_ranges(found.family).items()}
    axes[found.variable.name] = [*pairwise(found.breaks)]
    stated = fields(found) | {"sample_time": h, "error": found.matrices[0][0]}
    whole = verify.Following(stated, axes)
    known, factor = whole.signed(), 1 - 2 * found.alpha * h
    for k, ends in enumerate(whole.cells):
        if ends in asked:
            try:
                chords = whole.chords(k)
                for signed in known:
                    whole.interval(k, signed, chords, factor)
            except verify.Refused:
                yield ends
