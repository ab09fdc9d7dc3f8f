"""Quadratic forms with rational coefficients, on whole numbers: whether one is positive, and how far it may be off.

Standard library only; part of the checker (verify.py), which hands ``enclosure`` and ``kernel`` in. Steps are matrices
by columns.
"""

from fractions import Fraction
from functools import lru_cache
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, kernel

MOST_BITS = 1 << 14  # of an entry, times the rows: the entries grow to it. Of the shipped ones it is below 10 000
Matrix = list[list[Any]]
Rows = list[list[int]]


def require(matrix: Rows, fault: str, definite: bool = False) -> None:
    """Refused if the symmetric matrix is not positive semidefinite, or definite; or its numbers are too long."""
    longest = max((max(map(int.bit_length, row)) for row in matrix), default=0)
    enclosure.demand(longest * len(matrix) <= MOST_BITS, "the numbers are too long for so many errors")
    enclosure.demand(kernel.positive(matrix, definite), fault)


@lru_cache(64)
def turns(P: tuple[tuple[int, ...], ...], flips: tuple[int, ...], growth: Fraction) -> str:
    """Why V = e'Pe, P > 0, may grow by more than g where these errors change sign; "" where g V(e) - V(Je) >= 0.

    The matrix of the latter is P times g + 1 between errors of which one turns and one does not, else g - 1. If g > 1,
    it is not negative just if P is not, with (g - 1)^2/(g + 1)^2 times the block of those that turn: errors are divided
    by what is positive. If g = 1, just if nothing is between the two kinds: the same. A certificate and its proof ask
    the same.
    """
    a, b = growth.as_integer_ratio()
    if growth < 1:
        return "below 1"
    order = sorted(range(len(P)), key=lambda i: i in flips)  # what turns is eliminated last, and alone has long numbers
    by = {0: 1, 1: a + b, 2: (a - b) ** 2}
    rise = [[P[i][j] * by[(i in flips) + (j in flips)] for j in order] for i in order]
    try:
        require(rise, "not positive semidefinite")
    except enclosure.Refused as why:
        return str(why)
    return ""


def added(*matrices: Matrix) -> Matrix:
    return [[sum(entries) for entries in zip(*rows, strict=True)] for rows in zip(*matrices, strict=True)]


def scaled(a: Any, X: Matrix) -> Matrix:
    return [[a * x for x in row] for row in X]


def sizes(*matrices: Matrix) -> Matrix:
    """The largest |entry| at each place."""
    return [[max(map(abs, entries)) for entries in zip(*rows, strict=True)] for rows in zip(*matrices, strict=True)]


def times(P: Rows, X: Rows) -> Rows:
    """PX, with P symmetric."""
    return [[sum(map(mul, row, column)) for row in P] for column in X]


def inner(X: Rows, Y: Rows) -> Rows:
    """X'Y."""
    return [[sum(map(mul, x, y)) for y in Y] for x in X]


def diagonal(R: Rows, P: Rows) -> list[int]:
    """D with x'Dx >= |x|'(R + R')|x|, R >= 0: 2|x_i x_j| <= w_j/w_i x_i^2 + w_i/w_j x_j^2 with w near P_ii^-1/2."""
    R = added(R, [[*column] for column in zip(*R, strict=True)])
    halves = [row[i].bit_length() // 2 for i, row in enumerate(P)]  # w_i = 2^-halves[i]
    top = max(halves)
    sums = [sum(r << top - k for r, k in zip(row, halves, strict=True)) for row in R]
    return [(x >> top - k) + 1 for x, k in zip(sums, halves, strict=True)]
