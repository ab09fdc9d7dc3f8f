"""Proof by interval arithmetic that a matrix keeps its rank in the envelope, or a point at which it falls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from math import comb
from typing import Any

import casadi
import numpy as np
import sympy
from scipy import optimize

from codegen.certify.prefix import rational_text, to_prefix
from codegen.checker import verify
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.compact import compact
from codegen.mechanics.system import Matrix

MOST_MINORS = 40
"""A matrix with more minors of the size of its rank is not proven."""
MOST_BOXES = 4000
"""Boxes that are examined before the proof is given up."""
SINGULAR = 1e-7
"""A singular value below this share of the largest one counts as zero."""
STARTS = 5
"""Local minimisations of the singular value, from the best of the sampled points."""

Box = tuple[tuple[Fraction, Fraction], ...]


@dataclass(frozen=True)
class Regularity:
    """Constancy of a rank over the envelope.

    Attributes:
        proven: the rank is the same everywhere in it.
        falls_at: variable → value where the rank falls; None where no such point was found.
    """

    proven: bool
    falls_at: Mapping[str, float] | None = None


def keeps_rank(
    matrix: Any,
    rank: int,
    values: Mapping[sympy.Symbol, Any],
    variables: tuple[sympy.Symbol, ...],
    ranges: tuple[tuple[float, float], ...],
) -> Regularity:
    """Whether ``matrix`` has ``rank``, its generic one, at every point of the ranges.

    The envelope is bisected until on each box the enclosure of some minor, the determinant of a rank-by-rank submatrix,
    excludes zero.

    Args:
        matrix: n by m over parameters and ``variables``.
        values: of the parameters, exact.
    """
    inside = sympy.Matrix(matrix).subs(dict(values))
    used = tuple(v for v in variables if v in inside.free_symbols)
    if not used or rank == 0:
        return Regularity(True)
    bounds = [ranges[variables.index(v)] for v in used]
    falls = _falls(inside, rank, used, bounds)
    if falls is not None:
        return Regularity(False, falls)
    try:
        return Regularity(_proven(_minors(inside, rank), used, bounds))
    except (TypeError, verify.Refused):
        return Regularity(False)


def _minors(matrix: Any, rank: int) -> list[Any]:
    rows, columns = range(matrix.rows), range(matrix.cols)
    if comb(matrix.rows, rank) * comb(matrix.cols, rank) > MOST_MINORS:
        raise TypeError("too many minors")
    found = [
        compact(matrix.extract(list(i), list(j)).det(method="berkowitz"))
        for i in combinations(rows, rank)
        for j in combinations(columns, rank)
    ]
    return [m for m in found if m != 0]


def _proven(minors: list[Any], variables: tuple[sympy.Symbol, ...], bounds: list[tuple[float, float]]) -> bool:
    known = [v.name for v in variables]
    values = [verify.parse(to_prefix(m), known, "minor")[1] for m in minors]
    ends = [tuple(Fraction(rational_text(sympy.Rational(b))) for b in pair) for pair in bounds]
    boxes: list[Box] = [tuple((low, high) for low, high in ends)]
    for _ in range(MOST_BOXES):
        if not boxes:
            return True
        box = boxes.pop()
        if not any(_away_from_zero(value, dict(zip(known, box, strict=True))) for value in values):
            boxes += _halves(box, ends)
    return False


def _away_from_zero(value: Any, box: dict[str, tuple[Fraction, Fraction]]) -> bool:
    try:
        low, high = value(box)
    except verify.Refused:
        return False
    return bool(low > 0 or high < 0)


def _halves(box: Box, ends: list[Any]) -> list[Box]:
    widths = [(high - low) / (end[1] - end[0]) for (low, high), end in zip(box, ends, strict=True)]
    k = widths.index(max(widths))
    low, high = box[k]
    middle = (low + high) / 2
    return [(*box[:k], part, *box[k + 1 :]) for part in ((low, middle), (middle, high))]


def _falls(
    matrix: Any, rank: int, variables: tuple[sympy.Symbol, ...], bounds: list[tuple[float, float]]
) -> dict[str, float] | None:
    """A point at which the last of the ``rank`` singular values nearly vanishes, searched for from several starts."""
    at = casadi.SX.sym("at", len(variables))
    names = {s: at[k] for k, s in enumerate(variables)}
    function = casadi.Function("matrix", [at], [casadi.densify(to_casadi(Matrix(matrix), names))])

    def singular_values(points: Any) -> Any:
        flat = np.asarray(function.map(len(points))(points.T)).reshape(matrix.rows, len(points), matrix.cols)
        return np.linalg.svd(np.nan_to_num(flat.transpose(1, 0, 2)), compute_uv=False)

    box = np.array(bounds)
    spread = np.random.default_rng(2).uniform(box[:, 0], box[:, 1], (400, len(box)))
    ends = np.array(np.meshgrid(*[(low, (low + high) / 2, high) for low, high in box[:6]])).reshape(len(box[:6]), -1).T
    tried = np.vstack([spread, np.hstack([ends, np.tile(box[6:].mean(axis=1), (len(ends), 1))])])
    singular = singular_values(tried)
    size = float(singular[:, 0].max())

    def smallest(point: Any) -> float:
        return float(singular_values(point[None, :])[0, rank - 1])

    for start in tried[np.argsort(singular[:, rank - 1])[:STARTS]]:
        found = optimize.minimize(smallest, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-12})
        if found.fun <= SINGULAR * size:
            return {v.name: float(p) for v, p in zip(variables, found.x, strict=True)}
    return None
