"""Sampled points of the envelope, for numerical checks of conditions that must hold (almost) everywhere in it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
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


def numbers_over(
    matrix: Any, values: Mapping[sympy.Symbol, Any], variables: Sequence[sympy.Symbol], points: Any
) -> Any:
    """An n by m matrix over variables at (points, variables): (points, n, m); NaN or infinite where not real."""
    return at_points(function_of(matrix, variables, values), points)


def at_samples(matrix: Any, points: Sequence[Mapping[sympy.Symbol, Any]]) -> Array:
    """A matrix at points that give every symbol in it a value, (points, n, m); not finite as ``numbers_over``."""
    symbols = sorted(matrix.free_symbols, key=str)
    rows = np.array([[float(point[s]) for s in symbols] for point in points]).reshape(len(points), len(symbols))
    return np.asarray(numbers_over(matrix, {}, symbols, rows))


def rank(matrix: Any, points: Sequence[Mapping[sympy.Symbol, Any]]) -> int:
    """The generic rank of a matrix: the largest rank at the points, with columns and rows scaled to unit size first.

    A matrix that has no real value at any point is given full rank; its error is reported elsewhere.
    """
    full = int(min(matrix.rows, matrix.cols))
    numbers = at_samples(matrix, points) if full else np.zeros((0, 0, 0))
    numbers = numbers[np.isfinite(numbers).all(axis=(1, 2))]
    if not len(numbers):
        return full
    for axis in (1, 2):
        size = np.linalg.norm(numbers, axis=axis, keepdims=True)
        numbers = numbers / np.where(size == 0, 1, size)
    return int(np.max(np.linalg.matrix_rank(numbers, tol=SINGULAR)))
