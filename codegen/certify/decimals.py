"""Short exact decimals near floats, and exact numbers as a certificate writes them."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, Context, Decimal
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.certify.prefix import rational_text


def rounded(value: float, digits: int) -> Any:
    """A short exact decimal near a float."""
    return sympy.Rational(f"{value:.{digits}g}")


def rounded_matrix(matrix: NDArray[np.float64], digits: int, size: NDArray[np.float64]) -> list[list[Any]]:
    """A symmetric matrix with entry i, j to so many digits of size[i] size[j]: keeps a positive definite one so."""
    result: list[list[Any]] = [[sympy.Integer(0)] * len(matrix) for _ in matrix]
    for i in range(len(matrix)):
        for j in range(i + 1):
            quantum = 10.0 ** (math.floor(math.log10(size[i] * size[j])) + 1 - digits)
            entry = sympy.Rational(str(round(float(matrix[i, j]) / quantum))) * sympy.Rational(f"{quantum:.0e}")
            result[i][j] = result[j][i] = entry
    return result


def texts(rows: list[list[Any]]) -> list[list[str]]:
    """Exact numbers as the format writes them."""
    return [[rational_text(e) for e in row] for row in rows]


def upwards(value: float, digits: int) -> Any:
    """A short exact decimal that is no less."""
    return sympy.Rational(str(Context(prec=digits, rounding=ROUND_CEILING).plus(Decimal(float(value)))))
