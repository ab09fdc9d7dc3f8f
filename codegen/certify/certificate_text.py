"""Conversion of SymPy expressions and numbers to the text of a certificate (docs/certificate_format.md)."""

import math
from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.spec.functions import Magnitude

_CALLS = {sympy.sin: "sin", sympy.cos: "cos", sympy.exp: "exp", sympy.Abs: "abs", Magnitude: "abs"}
"""SymPy function → its operator in a prefix expression."""


def rational_text(value: Any) -> str:
    """An exact rational as ``p`` or ``p/q``."""
    return str(sympy.Rational(value))


def to_prefix(e: Any) -> Any:
    """A SymPy expression as a prefix expression: a string, or a list of an operator and prefix expressions.

    Raises:
        TypeError: for a function or power that certificates do not have.
    """
    if e.is_Rational:
        return rational_text(e)
    if e.is_Symbol:
        return e.name
    if e.is_Add:
        return ["+", *[to_prefix(a) for a in e.args]]
    if e.is_Mul:
        above = [f for f in e.args if not (f.is_Pow and f.exp.is_number and f.exp.is_negative)]
        below = [f.base ** (-f.exp) for f in e.args if f.is_Pow and f.exp.is_number and f.exp.is_negative]
        top = to_prefix(above[0]) if len(above) == 1 else ["*", *[to_prefix(a) for a in above]] if above else "1"
        for divisor in below:
            top = ["/", top, to_prefix(divisor)]
        return top
    if e.is_Pow and e.exp == sympy.Rational(1, 2):
        return ["sqrt", to_prefix(e.base)]
    if e.is_Pow and e.exp.is_Integer:
        return ["^", to_prefix(e.base), str(e.exp)] if e.exp > 0 else ["/", "1", to_prefix(1 / e)]
    if e.func is sympy.tan:
        return ["/", ["sin", to_prefix(e.args[0])], ["cos", to_prefix(e.args[0])]]
    if e.func not in _CALLS:
        raise TypeError(f"the power {e.exp}" if e.is_Pow else str(e.func))
    return [_CALLS[e.func], to_prefix(e.args[0])]


def rounded(value: float, digits: int) -> Any:
    """The nearest decimal with so many significant digits, as an exact rational."""
    return sympy.Rational(f"{value:.{digits}g}")


def rounded_matrix(matrix: NDArray[np.float64], digits: int, size: NDArray[np.float64]) -> list[list[Any]]:
    """A symmetric matrix in exact numbers, entry (i, j) rounded relative to size[i] size[j].

    With size = √diag, rounding does not depend on the scales of the coordinates; with enough digits a positive definite
    matrix stays so.

    Args:
        matrix: m by m.
        digits: number of significant digits of size[i] size[j].
        size: length m, positive.
    """
    result: list[list[Any]] = [[sympy.Integer(0)] * len(matrix) for _ in matrix]
    for i in range(len(matrix)):
        for j in range(i + 1):
            quantum = 10.0 ** (math.floor(math.log10(size[i] * size[j])) + 1 - digits)
            entry = sympy.Rational(str(round(float(matrix[i, j]) / quantum))) * sympy.Rational(f"{quantum:.0e}")
            result[i][j] = result[j][i] = entry
    return result


def texts(rows: list[list[Any]]) -> list[list[str]]:
    """A matrix of exact numbers as text, ``p`` or ``p/q``."""
    return [[rational_text(e) for e in row] for row in rows]


def rational_above(value: Any) -> Fraction:
    """An upper bound of a SymPy number: the number if it is rational, else a decimal of 12 digits."""
    return fraction(value) if value.is_Rational else upwards(float(value) * (1 + 1e-12), 12)


def fraction(value: Any) -> Fraction:
    """A SymPy rational, integer or text ``p/q`` as a Fraction."""
    exact = sympy.Rational(value)
    return Fraction(int(exact.p), int(exact.q))


def upwards(value: float, digits: int) -> Fraction:
    """The value rounded up to so many significant digits, exact."""
    return Fraction(Context(prec=digits, rounding=ROUND_CEILING).plus(Decimal(float(value))))
