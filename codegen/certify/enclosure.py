"""Interval enclosures of a family's parameters over cells of the envelope, by the checker's own arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.exact_numbers import geometric
from codegen.certify.family import PI, Family, NotEnclosable
from codegen.certify.prefix import rational_text, to_prefix
from codegen.checker import verify
from codegen.mechanics.casadi_form import to_casadi

MOST_PARAMETERS = 12
"""So that a cell has at most as many vertices as the checker takes."""
ROUNDS = 14
MOST_CELLS, MOST_CORNERS = 4096, 2**20
LOOSE = 1.03
MOST_SAMPLES = 40_000

Interval = tuple[Fraction, Fraction]


@dataclass(frozen=True, eq=False)
class Cells:
    """What the enclosure gives.

    Attributes:
        splits: variable → breakpoints, exact.
        matrices: A at the vertices of every cell, each once.
    """

    splits: Mapping[sympy.Symbol, list[Any]]
    matrices: list[NDArray[np.float64]]


class Enclosure:
    """The parameters of a family over boxes of its variables, and A at the corners of what they can be there.

    Raises:
        NotEnclosable: with more than twelve parameters that vary.
    """

    def __init__(self, family: Family) -> None:
        count_varying = sum(not e.is_Rational for e in family.parameters.values())
        if count_varying > MOST_PARAMETERS:
            varying = [str(family.bounded.get(v, v)) for v in family.variables if v != PI]
            count = f"the error dynamics depend on {', '.join(varying)} through {count_varying} expressions"
            raise NotEnclosable(f"{count}, and this version encloses up to {MOST_PARAMETERS}")
        known = [v.name for v in family.variables]
        self.nodes = [verify.parse(to_prefix(e), known, s.name) for s, e in family.parameters.items()]
        theta = casadi.SX.sym("theta", max(1, len(self.nodes)))
        names = {s: theta[k] for k, s in enumerate(family.parameters)}
        self._function = casadi.Function("matrix", [theta], [casadi.densify(to_casadi(family.matrix, names))])

    def ranges(self, cell: Mapping[sympy.Symbol, Interval]) -> tuple[Interval, ...]:
        """What the parameters can be in a cell of the variables, by the checker's arithmetic."""
        box = {v.name: interval for v, interval in cell.items()}
        return tuple(_enclose(node, box) for node in self.nodes)

    def vertices(self, boxes: set[tuple[Interval, ...]]) -> list[NDArray[np.float64]]:
        """A at the corners of boxes of the parameters, each once."""
        if not self.nodes:
            return [np.asarray(self._function(0.0).full())]
        corners = sorted(
            {corner for box in _outer(boxes) for corner in product(*[sorted({float(lo), float(hi)}) for lo, hi in box])}
        )
        rows, columns = self._function.size_out(0)
        flat = np.asarray(self._function.map(len(corners))(np.array(corners).T))
        return [*np.ascontiguousarray(flat.reshape(rows, len(corners), columns).transpose(1, 0, 2))]


def exact_ranges(family: Family) -> dict[sympy.Symbol, Interval]:
    """The ranges of the variables."""
    return {v: (Fraction(rational_text(lo)), Fraction(rational_text(hi))) for v, (lo, hi) in family.variables.items()}


def enclose_family(family: Family, finer: int = 0) -> Cells:
    """Split the envelope until the enclosures are within 3 % of the sampled ranges, or fourteen times.

    Args:
        finer: how often every interval is then halved again, so that boxes hug the curve of the parameters.

    Raises:
        NotEnclosable: with more than twelve parameters.
        codegen.checker.verify.Refused: where the arithmetic cannot enclose an expression.
    """
    enclosure = Enclosure(family)
    parameters = list(family.parameters)
    breaks = {v: list(ends) for v, ends in exact_ranges(family).items()}
    used = [[v for v in family.variables if family.parameters[s].has(v)] for s in parameters]
    sampled = _sampled_ranges(family, parameters)
    most = min(MOST_CELLS, MOST_CORNERS >> len(parameters))
    for _ in range(ROUNDS):
        loose = _loose_intervals(enclosure.nodes, used, breaks, sampled)
        grown = {v: sorted({*b, *(m for (w, m) in loose if w == v)}) for v, b in breaks.items()}
        if not loose or np.prod([len(b) - 1 for b in grown.values()]) > most:
            break
        breaks = grown
    for _ in range(finer):
        halved = {
            v: sorted({*b, *((p + q) / 2 for p, q in pairwise(b))}) if v.name != "pi_" else b for v, b in breaks.items()
        }
        if np.prod([len(b) - 1 for b in halved.values()]) > most:
            break
        breaks = halved
    splits = {
        v: [sympy.Rational(b.numerator, b.denominator) for b in points]
        for v, points in breaks.items()
        if len(points) > 2
    }
    return Cells(splits, enclosure.vertices({enclosure.ranges(cell) for cell in _cells(breaks)}))


def _enclose(node: Any, box: Mapping[str, Interval]) -> Interval:
    """The checker's own enclosure of a parsed expression on a box."""
    _, value = node
    return verify.widen(*value(box))


def _cells(breaks: Mapping[sympy.Symbol, list[Fraction]]) -> list[dict[sympy.Symbol, Interval]]:
    intervals = [[(v, (b[k], b[k + 1])) for k in range(len(b) - 1)] for v, b in breaks.items()]
    return [dict(combination) for combination in product(*intervals)]


def _loose_intervals(
    nodes: list[Any],
    used: list[list[sympy.Symbol]],
    breaks: Mapping[sympy.Symbol, list[Fraction]],
    sampled: list[tuple[float, float]],
) -> set[tuple[sympy.Symbol, Fraction]]:
    """Midpoints of the intervals on which a parameter's enclosure leaves its sampled range by more than 3 %."""
    found = set()
    for node, variables, (low, high) in zip(nodes, used, sampled, strict=True):
        if not variables:  # a constant that is not rational: nothing to split
            continue
        slack = (LOOSE - 1) * max(high - low, abs(high), abs(low))
        for cell in _cells({v: breaks[v] for v in variables}):
            try:
                lo, hi = _enclose(node, {v.name: i for v, i in cell.items()})
            except verify.Refused:
                lo, hi = Fraction(-(10**30)), Fraction(10**30)
            if float(lo) < low - slack or float(hi) > high + slack:
                widest = max(cell, key=lambda v: float(cell[v][1] - cell[v][0]) / float(breaks[v][-1] - breaks[v][0]))
                found |= {(widest, (cell[widest][0] + cell[widest][1]) / 2)}
    return found


def _sampled_ranges(family: Family, parameters: list[sympy.Symbol]) -> list[tuple[float, float]]:
    variables = list(family.variables)
    if not parameters:
        return []
    point = casadi.SX.sym("p", len(variables))
    names = {v: point[k] for k, v in enumerate(variables)}
    column = sympy.Matrix([family.parameters[s] for s in parameters])
    function = casadi.Function("parameters", [point], [casadi.densify(to_casadi(column, names))])
    lines = [_samples(float(lo), float(hi)) for lo, hi in family.variables.values()]
    if not variables:
        points = np.zeros((0, 1))
    elif np.prod([len(line) for line in lines]) <= MOST_SAMPLES:
        points = np.array(np.meshgrid(*lines)).reshape(len(variables), -1)
    else:
        generator = np.random.default_rng(2)
        points = np.array([generator.choice(line, MOST_SAMPLES) for line in lines])
    values = np.asarray(function.map(points.shape[1])(points))
    return [(float(row.min()), float(row.max())) for row in values.reshape(len(parameters), -1)]


def _samples(low: float, high: float) -> NDArray[np.float64]:
    """Even points of a range, and points that crowd towards zero, where friction changes fastest."""
    near = geometric(1e-4, 1.0, 60)
    around = np.concatenate([low * near, high * near]) if low < 0 < high else low + (high - low) * near
    return np.unique(np.concatenate([np.linspace(low, high, 65), around]))


def _outer(boxes: set[tuple[Interval, ...]]) -> list[tuple[Interval, ...]]:
    """The boxes that no other box contains: the rest are proved with them."""
    return [
        b
        for b in boxes
        if not any(o != b and all(p[0] <= q[0] and q[1] <= p[1] for p, q in zip(o, b, strict=True)) for o in boxes)
    ]
