"""Sampled points of the envelope, for numerical checks of conditions that must hold (almost) everywhere in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy

from codegen.mechanics.casadi_form import at_points, function_of
from codegen.spec.model import Spec, symbol

POINTS = 12
"""Number of sampled points."""
SINGULAR = 1e-9
"""Singular value of a scaled matrix up to which it counts as zero."""


def position_range(spec: Spec, name: str, unit: str) -> tuple[float, float]:
    """A position's range in the envelope; ±1 m, or ±half a turn for an angle, where the envelope has none."""
    default = math.pi if unit == "rad" else 1.0
    low, high = spec.envelope.get(name, (-default, default))
    return float(low), float(high)


def sampled_values(spec: Spec) -> list[dict[sympy.Symbol, Any]]:
    """Random points of the envelope: symbol → value, of parameters and positions; the same at every call."""
    generator = np.random.default_rng(1)
    values = {symbol(p.name): p.value for p in spec.parameters}
    ranges = {symbol(c.name): position_range(spec, c.name, c.unit) for c in spec.coordinates}
    return [values | {s: float(generator.uniform(*r)) for s, r in ranges.items()} for _ in range(POINTS)]


def numeric_matrix(matrix: Any, point: Mapping[sympy.Symbol, Any]) -> Any:
    """The numeric value of a matrix at a point; NaN where it has no real value."""
    numbers = np.zeros((matrix.rows, matrix.cols))
    for place, entry in matrix.todok().items():
        e = complex(entry.subs({s: point[s] for s in entry.free_symbols if s in point}).evalf())
        numbers[place] = e.real if abs(e.imag) <= 1e-12 * max(1.0, abs(e.real)) else math.nan
    return numbers


def numbers_over(
    matrix: Any, values: Mapping[sympy.Symbol, Any], variables: Sequence[sympy.Symbol], points: Any
) -> Any:
    """An n by m matrix over parameters and variables, evaluated by CasADi at many points: (points, n, m).

    Args:
        values: of the parameters.
        points: (points, variables). An entry without a real value at a point is NaN or infinite there.
    """
    return at_points(function_of(matrix, variables, values), points)


def rank(matrix: Any, points: list[dict[sympy.Symbol, Any]]) -> int:
    """The generic rank of a matrix: the largest rank at the points, with rows and columns scaled to unit size first.

    A matrix that has no real value at any point is given full rank; its error is reported elsewhere.
    """
    full, best = min(matrix.rows, matrix.cols), -1
    for point in points:
        numbers = numeric_matrix(matrix, point)
        if np.isfinite(numbers).all():
            best = max(best, _rank(numbers))
        if best == full:
            break
    return full if best < 0 else best


def _rank(numbers: Any) -> int:
    """The rank of a numeric matrix whose columns and rows are scaled to unit length first."""
    for axis in (0, 1):
        size = np.linalg.norm(numbers, axis=axis, keepdims=True)
        numbers = numbers / np.where(size == 0, 1, size)
    return int(np.linalg.matrix_rank(numbers, tol=SINGULAR))
