"""Interval enclosures of the parameters of a family over cells of the envelope, in the checker's interval arithmetic.

Over a cell each parameter lies in an interval, and A is multi-affine in the parameters. So A lies in the convex hull
of its values at the vertices of the box of these intervals.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from itertools import pairwise, product
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric
from codegen.certify.certificate_text import fraction, to_prefix
from codegen.certify.family import PI, Family, NotEnclosable
from codegen.checker import decay, verify
from codegen.mechanics.casadi_form import at_points, function_of

MOST_PARAMETERS = 12
"""Largest number of varying parameters: a cell has 2^12 vertices, the most that the checker accepts."""
ROUNDS = 14
"""Largest number of bisections of an interval of a variable."""
MOST_CELLS = 4096
"""Largest number of cells; that of the vertices of all cells together is the checker's, ``decay.MAX_TOTAL``."""
LOOSE = 1.005
"""A cell is bisected if an enclosure exceeds the sampled range [a, b] by more than (LOOSE − 1) max(b − a, |a|, |b|)."""
CURVED = 16
"""Weight of a side along which a parameter is not affine: to cut another one tightens its enclosure little."""
MOST_SAMPLES = 40_000
"""Number of points above which random points replace the full grid for the sampled ranges."""

Interval = tuple[Fraction, Fraction]
"""(low, high)."""
Cell = Mapping[sympy.Symbol, Interval]
"""Variable → its interval."""
Value = Callable[[Cell], Interval]
"""Cell → the enclosure of an expression, rounded outwards as the checker does."""


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
        self._values = [_enclosing(e, tuple(family.variables)) for e in family.parameters.values()]
        self._function = function_of(family.matrix, [*family.parameters])

    def vertices(self, cells: Iterable[Cell]) -> Array:
        """A at the vertices of the parameter boxes of cells, each once, N by m by m."""
        if not self._values:
            return np.asarray(self._function(0.0).full())[None]
        found = {tuple((float(low), float(high)) for low, high in (v(cell) for v in self._values)) for cell in cells}
        ends = [[sorted({*pair}) for pair in box] for box in found]
        grids = [np.stack(np.meshgrid(*box, indexing="ij"), axis=-1).reshape(-1, len(box)) for box in ends]
        corners = grids[0] if len(grids) == 1 else np.unique(np.concatenate(grids), axis=0)
        return at_points(self._function, corners)


def exact_ranges(family: Family) -> dict[sympy.Symbol, Interval]:
    """Variable → (low, high) as fractions."""
    return {v: (fraction(low), fraction(high)) for v, (low, high) in family.variables.items()}


@lru_cache(maxsize=64)
def _enclosing(expression: Any, variables: tuple[sympy.Symbol, ...]) -> Value:
    """The function that encloses an expression over a cell, in the checker's interval arithmetic, with a cache."""
    used = [v for v in variables if expression.has(v)]
    value = verify.parse(to_prefix(expression), [v.name for v in variables], str(expression))[1]

    @cache
    def enclosed(*intervals: Interval) -> Interval:
        return verify.widen(*value({v.name: ends for v, ends in zip(used, intervals, strict=True)}))

    return lambda cell: enclosed(*[cell[v] for v in used])


def cells_of(breaks: Mapping[sympy.Symbol, Sequence[Any]]) -> list[Cell]:
    """The cells of a rectangular grid with these breakpoints."""
    return [dict(zip(breaks, cell, strict=True)) for cell in product(*map(pairwise, breaks.values()))]


def enclose_family(family: Family, breaks: Mapping[sympy.Symbol, Sequence[Fraction]] | None = None) -> Cells:
    """The cells of a grid with these breakpoints, by default those of ``partition``, and the matrices at the vertices.

    A variable of the family without breakpoints is not cut.

    Raises:
        NotEnclosable: with more than twelve parameters that vary.
        codegen.checker.verify.Refused: if interval arithmetic cannot enclose an expression.
    """
    enclosure = Enclosure(family)  # raises NotEnclosable before the partition is sought
    breaks = partition(family) if breaks is None else breaks
    grid = {v: breaks.get(v, ends) for v, ends in exact_ranges(family).items()}
    splits = {v: [*bs] for v, bs in grid.items() if len(bs) > 2}
    return Cells(splits, enclosure.vertices(cells_of(grid)))


def partition(family: Family, most: int = MOST_CELLS) -> dict[sympy.Symbol, list[Fraction]]:
    """Breakpoints, for at most so many cells, whose enclosures are within 0.5 % of the sampled ranges if possible.

    They are found by at most ``ROUNDS`` bisections.

    Raises:
        codegen.checker.verify.Refused: if interval arithmetic cannot enclose an expression.
    """
    varying = tuple(e for e in family.parameters.values() if e.free_symbols)
    allowed = min(most, decay.MAX_TOTAL >> len(family.parameters))
    return _partition(varying, tuple(family.variables.items()), allowed)


@lru_cache(maxsize=16)
def _partition(
    expressions: tuple[Any, ...], ranges: tuple[tuple[sympy.Symbol, tuple[Any, Any]], ...], most: int
) -> dict[sympy.Symbol, list[Fraction]]:
    """Breakpoints of each variable, for at most ``most`` cells; cached by pairs, which can be hashed.

    A cell in which the enclosure of a parameter exceeds its sampled range by more than 0.5 % is bisected at the
    midpoint of its relatively widest side, the sides weighted by ``CURVED``.
    """
    variables = dict(ranges)
    values, sampled = [_enclosing(e, tuple(variables)) for e in expressions], _sampled_ranges(expressions, variables)
    breaks = {v: [*map(fraction, ends)] for v, ends in variables.items()}

    def midpoints() -> set[tuple[sympy.Symbol, Fraction]]:
        """Breakpoints to add: (variable, midpoint of a side)."""
        found = set()
        for value, expression, (low, high) in zip(values, expressions, sampled, strict=True):
            slack = (LOOSE - 1) * max(high - low, abs(high), abs(low))
            weight = {v: CURVED if expression.diff(v).has(v) else 1 for v in expression.free_symbols}
            for cell in cells_of({v: b for v, b in breaks.items() if expression.has(v)}):
                try:
                    lo, hi = value(cell)
                except verify.Refused:
                    lo, hi = Fraction(-(10**30)), Fraction(10**30)
                if float(lo) < low - slack or float(hi) > high + slack:
                    share = {v: (b - a) / (breaks[v][-1] - breaks[v][0]) for v, (a, b) in cell.items()}
                    widest = max(share, key=lambda v: weight[v] * share[v])
                    found |= {(widest, (cell[widest][0] + cell[widest][1]) / 2)}
        return found

    for _ in range(ROUNDS):
        at = midpoints()
        grown = {v: sorted({*b, *(m for (w, m) in at if w == v)}) for v, b in breaks.items()}
        if not at or np.prod([len(b) - 1 for b in grown.values()]) > most:
            break
        breaks = grown
    return breaks


def _sampled_ranges(
    expressions: Sequence[Any], ranges: Mapping[sympy.Symbol, tuple[Any, Any]]
) -> list[tuple[float, float]]:
    """(min, max) of every expression over a grid of the ranges or, if that is too large, over random points of it."""
    variables = list(ranges)
    if not expressions:
        return []
    function = function_of(sympy.Matrix([*expressions]), variables)
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
    """Sample points of a range: even ones, and geometric ones towards zero, near which friction varies fastest."""
    near = geometric(1e-4, 1.0, 60)
    around = np.concatenate([low * near, high * near]) if low < 0 < high else low + (high - low) * near
    return np.unique(np.concatenate([np.linspace(low, high, 65), around]))
