"""Interval enclosures of the parameters of a family over cells of the envelope, in the checker's interval arithmetic.

Over a cell each parameter lies in an interval, and A is multi-affine in the parameters. So A lies in the convex hull
of its values at the vertices of the box of these intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise, product
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric
from codegen.certify.family import PI, Family, NotEnclosable
from codegen.certify.prefix import fraction, to_prefix
from codegen.checker import verify
from codegen.mechanics.casadi_form import at_points, function_of

MOST_PARAMETERS = 12
"""Largest number of varying parameters: a cell has 2^12 vertices, the most that the checker accepts."""
ROUNDS = 14
"""Largest number of bisections of an interval of a variable."""
MOST_CELLS, MOST_CORNERS = 4096, 2**20
"""Largest number of cells, and of vertices of all cells together."""
LOOSE = 1.03
"""A cell is bisected if an enclosure exceeds the sampled range [a, b] by more than (LOOSE − 1) max(b − a, |a|, |b|)."""
MOST_SAMPLES = 40_000
"""Number of points above which random points replace the full grid for the sampled ranges."""

Interval = tuple[Fraction, Fraction]
"""(low, high)."""
Cell = Mapping[sympy.Symbol, Interval]
"""Variable → its interval."""
Box = tuple[Interval, ...]
"""Interval of each parameter, in their order."""
Value = Callable[[Mapping[str, Interval]], Interval]
"""Name of a variable → interval, to the enclosure of an expression."""


@dataclass(frozen=True, eq=False)
class Cells:
    """The partition of the envelope into cells, with the error matrices at the vertices.

    Attributes:
        splits: variable → breakpoints, exact.
        matrices: A at the vertices of every cell, each once, N by m by m.
    """

    splits: Mapping[sympy.Symbol, list[Any]]
    matrices: Array


class Enclosure:
    """Evaluation of A at the vertices of the parameter boxes that enclose cells of the variables.

    Raises:
        NotEnclosable: with more than twelve parameters that vary.
    """

    def __init__(self, family: Family) -> None:
        count_varying = sum(not e.is_Rational for e in family.parameters.values())
        if count_varying > MOST_PARAMETERS:
            varying = [str(family.bounded.get(v, v)) for v in family.variables if v != PI]
            count = f"the error dynamics depend on {', '.join(varying)} through {count_varying} expressions"
            raise NotEnclosable(f"{count} that vary over the envelope, and at most {MOST_PARAMETERS} can be covered")
        self._values = _parsed(family.parameters, family.variables)
        self._function = function_of(family.matrix, [*family.parameters])

    def vertices(self, cells: Iterable[Cell]) -> Array:
        """A at the vertices of the parameter boxes of cells, each once, N by m by m."""
        return self.at(_boxes(self._values, cells))

    def at(self, boxes: Iterable[Box]) -> Array:
        """A at the vertices of parameter boxes, each once, N by m by m."""
        if not self._values:
            return np.asarray(self._function(0.0).full())[None]
        ends = [[sorted({float(low), float(high)}) for low, high in box] for box in boxes]
        grids = [np.stack(np.meshgrid(*box, indexing="ij"), axis=-1).reshape(-1, len(box)) for box in ends]
        corners = grids[0] if len(grids) == 1 else np.unique(np.concatenate(grids), axis=0)
        return at_points(self._function, corners)


def exact_ranges(family: Family) -> dict[sympy.Symbol, Interval]:
    """Variable → (low, high) as fractions."""
    return {v: (fraction(low), fraction(high)) for v, (low, high) in family.variables.items()}


def _parsed(parameters: Mapping[sympy.Symbol, Any], variables: Iterable[sympy.Symbol]) -> list[Value]:
    """For each parameter the function that encloses it over a cell, in the checker's interval arithmetic."""
    known = [v.name for v in variables]
    return [verify.parse(to_prefix(e), known, s.name)[1] for s, e in parameters.items()]


def cells_of(breaks: Mapping[sympy.Symbol, Sequence[Any]]) -> list[Cell]:
    """The cells of a rectangular grid with these breakpoints."""
    return [dict(zip(breaks, cell, strict=True)) for cell in product(*map(pairwise, breaks.values()))]


def enclose_family(family: Family) -> Cells:
    """Partition the envelope until the enclosures are within 3 % of the sampled ranges, by at most 14 bisections.

    Raises:
        NotEnclosable: with more than twelve parameters that vary.
        codegen.checker.verify.Refused: if interval arithmetic cannot enclose an expression.
    """
    enclosure = Enclosure(family)
    breaks, boxes = _partition(tuple(family.parameters.items()), tuple(family.variables.items()))
    splits = {v: [sympy.Rational(b.numerator, b.denominator) for b in bs] for v, bs in breaks.items() if len(bs) > 2}
    return Cells(splits, enclosure.at(boxes))


@lru_cache(maxsize=16)
def _partition(
    named: tuple[tuple[sympy.Symbol, Any], ...], ranges: tuple[tuple[sympy.Symbol, tuple[Any, Any]], ...]
) -> tuple[dict[sympy.Symbol, list[Fraction]], list[Box]]:
    """Breakpoints of each variable and the parameter boxes of the cells; cached by pairs, which can be hashed."""
    parameters, variables = dict(named), dict(ranges)
    values, sampled = _parsed(parameters, variables), _sampled_ranges(parameters, variables)
    breaks = {v: [*map(fraction, ends)] for v, ends in variables.items()}
    most = min(MOST_CELLS, MOST_CORNERS >> len(parameters))

    for _ in range(ROUNDS):
        at = _loose_intervals(values, parameters, breaks, sampled)
        grown = {v: sorted({*b, *(m for (w, m) in at if w == v)}) for v, b in breaks.items()}
        if not at or np.prod([len(b) - 1 for b in grown.values()]) > most:
            break
        breaks = grown
    return breaks, _boxes(values, cells_of(breaks))


def _loose_intervals(
    values: Sequence[Value],
    parameters: Mapping[sympy.Symbol, Any],
    breaks: Mapping[sympy.Symbol, list[Fraction]],
    sampled: list[tuple[float, float]],
) -> set[tuple[sympy.Symbol, Fraction]]:
    """Breakpoints to add: (variable, midpoint) of the relatively widest side of each cell that needs bisection.

    That is a cell in which the enclosure of a parameter exceeds its sampled range by more than 3 %.
    """
    found = set()
    for value, expression, (low, high) in zip(values, parameters.values(), sampled, strict=True):
        slack = (LOOSE - 1) * max(high - low, abs(high), abs(low))
        used = {v: b for v, b in breaks.items() if expression.has(v)}
        for cell in cells_of(used) if used else ():  # an irrational constant has no variable to bisect
            try:
                lo, hi = verify.widen(*value({v.name: i for v, i in cell.items()}))
            except verify.Refused:
                lo, hi = Fraction(-(10**30)), Fraction(10**30)
            if float(lo) < low - slack or float(hi) > high + slack:
                widest = max(cell, key=lambda v: float(cell[v][1] - cell[v][0]) / float(breaks[v][-1] - breaks[v][0]))
                found |= {(widest, (cell[widest][0] + cell[widest][1]) / 2)}
    return found


def _sampled_ranges(
    parameters: Mapping[sympy.Symbol, Any], ranges: Mapping[sympy.Symbol, tuple[Any, Any]]
) -> list[tuple[float, float]]:
    """(min, max) of every parameter over a grid of the ranges or, if that is too large, over random points of it."""
    variables, expressions = list(ranges), list(parameters.values())
    if not expressions:
        return []
    function = function_of(sympy.Matrix(expressions), variables)
    lines = [_samples(float(lo), float(hi)) for lo, hi in ranges.values()]
    if not variables:
        points = np.zeros((0, 1))
    elif np.prod([len(line) for line in lines]) <= MOST_SAMPLES:
        points = np.array(np.meshgrid(*lines)).reshape(len(variables), -1)
    else:
        generator = np.random.default_rng(2)
        points = np.array([generator.choice(line, MOST_SAMPLES) for line in lines])
    return [(float(row.min()), float(row.max())) for row in at_points(function, points.T)[:, :, 0].T]


def _samples(low: float, high: float) -> NDArray[np.float64]:
    """Sample points of a range: evenly spaced ones, and ones in geometric progression towards zero or its lower end.

    Friction varies fastest near zero velocity.
    """
    near = geometric(1e-4, 1.0, 60)
    around = np.concatenate([low * near, high * near]) if low < 0 < high else low + (high - low) * near
    return np.unique(np.concatenate([np.linspace(low, high, 65), around]))


def _boxes(values: Sequence[Value], cells: Iterable[Cell]) -> list[Box]:
    """The parameter box of each cell, without boxes that another one contains, since its vertices cover them."""
    named = ({v.name: interval for v, interval in cell.items()} for cell in cells)
    boxes = {tuple(verify.widen(*value(cell)) for value in values) for cell in named}
    return [b for b in boxes if not any(other != b and _contains(other, b) for other in boxes)]


def _contains(outer: Box, inner: Box) -> bool:
    """Whether each interval of a box contains that of another one."""
    return all(low <= a and b <= high for (low, high), (a, b) in zip(outer, inner, strict=True))
