"""Reproducible numerics: sines, roots, powers and eigenvalues with the same result on every machine.

Mathematical libraries differ in the last bit of a sine, a power or a product of matrices. Numbers that are printed,
above all into generated code, are therefore computed in rationals or integers and rounded to a double once, at the end.
"""

import math
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

DIGITS = 40
"""Number of decimals of sines, cosines and roots."""
RIGHT_ANGLE = Fraction(1, 10**15)
"""Largest magnitude of a sine or cosine that is set to zero: a double nearest to π/2 differs from it by less."""

LARGEST_ORDER = 16
"""Largest order of a matrix whose eigenvalues are computed to thirty digits."""

Exact = NDArray[np.object_]
"""An array of Fractions; NumPy multiplies such arrays by Python's own arithmetic, without BLAS."""


def exact_array(values: Any) -> Exact:
    """Doubles, integers or Fractions as an array of Fractions, doubles as the decimals that they were read from."""
    plain = np.array(values, dtype=object)
    made = np.empty(plain.shape, dtype=object)
    for at, value in np.ndenumerate(plain):
        # repr gives the decimal that a double was read from: 0.1 is 1/10
        made[at] = Fraction(repr(float(value))) if isinstance(value, float) else Fraction(value)
    return made


def sine_cosine(angle: Fraction) -> tuple[Fraction, Fraction]:
    """sin and cos of an angle in rad, to forty digits.

    An angle that is a multiple of a right angle, rounded to sixteen digits, gives exactly 0 and ±1.
    """
    with mpmath.workdps(DIGITS + 20):
        exact = mpmath.mpf(angle.numerator) / angle.denominator
        sine, cosine = _rational(mpmath.sin(exact)), _rational(mpmath.cos(exact))
    if abs(sine) < RIGHT_ANGLE:
        return Fraction(0), Fraction(1 if cosine > 0 else -1)
    if abs(cosine) < RIGHT_ANGLE:
        return Fraction(1 if sine > 0 else -1), Fraction(0)
    return sine, cosine


def square_root(square: Fraction) -> Fraction:
    """The square root of a non-negative rational, to forty digits; exact where it is rational."""
    root = Fraction(math.isqrt(square.numerator), math.isqrt(square.denominator))
    if root * root == square:
        return root
    scale = 10 ** (2 * DIGITS) * 10 ** max(0, 2 * (len(str(square.denominator)) - len(str(square.numerator))))
    return Fraction(math.isqrt(square.numerator * scale // square.denominator), math.isqrt(scale))


@lru_cache(maxsize=4096)  # the same axes of gains and sample times are computed many times
def power_of_ten(exponent: float) -> float:
    """10 to a power, correctly rounded."""
    with mpmath.workdps(DIGITS):
        return float(mpmath.mpf(10) ** mpmath.mpf(exponent))


def _rational(value: Any) -> Fraction:
    """A number of mpmath rounded to ``DIGITS`` decimals."""
    return Fraction(int(mpmath.nint(value * mpmath.mpf(10) ** DIGITS)), 10**DIGITS)


def powers_of_ten(exponents: NDArray[np.float64]) -> NDArray[np.float64]:
    """10 to each power, correctly rounded."""
    return np.array([power_of_ten(float(e)) for e in exponents.ravel()]).reshape(exponents.shape)


def geometric(low: float, high: float, count: int) -> NDArray[np.float64]:
    """A geometric sequence of ``count`` numbers from ``low`` to ``high``, both positive."""
    with mpmath.workdps(DIGITS):
        start, ratio = mpmath.mpf(low), mpmath.mpf(high) / mpmath.mpf(low)
        return np.array([float(start * ratio ** (mpmath.mpf(k) / (count - 1))) for k in range(count)])


def eigenvalues(matrix: NDArray[np.float64]) -> NDArray[np.complex128]:
    """The m eigenvalues of an m by m matrix of doubles, computed to thirty digits and rounded to doubles, unordered.

    For m above 16, where this would take many seconds, they are LAPACK's, rounded to ten digits.
    """
    if len(matrix) > LARGEST_ORDER:
        return np.array([complex(float(f"{z.real:.10g}"), float(f"{z.imag:.10g}")) for z in np.linalg.eigvals(matrix)])
    return np.array(_eigenvalues(tuple(tuple(float(x) for x in row) for row in matrix)))


@lru_cache(maxsize=64)
def _eigenvalues(rows: tuple[tuple[float, ...], ...]) -> tuple[complex, ...]:
    """The eigenvalues of a matrix given by its rows; parts below 10⁻¹⁴ of the largest are zero."""
    if len(rows) == 1:
        return (complex(rows[0][0]),)  # for order 1 mpmath returns another type
    with mpmath.workdps(30):
        found = mpmath.eig(mpmath.matrix([list(row) for row in rows]), left=False, right=False)
        size = max([abs(z) for z in found], default=mpmath.mpf(0))
        zero = size * mpmath.mpf(10) ** -14
        return tuple(complex(*(float(x) if abs(x) > zero else 0.0 for x in (z.real, z.imag))) for z in found)


def first_largest(values: NDArray[np.float64]) -> int:
    """The index of the largest value; of several that are equal to ten digits, the first."""
    largest = float(values.max())
    return int(np.flatnonzero(values >= largest - 1e-10 * abs(largest))[0])
