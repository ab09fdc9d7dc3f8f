"""Quadratic forms on integers: definiteness, and growth of V at a change of signs; and products of matrices.

Standard library only; part of the checker (verify.py), which passes ``enclosure`` and ``kernel`` in.
"""

from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, kernel

MOST_BITS = 1 << 14  # of an entry, times the rows: the entries grow to it. Of the shipped ones it is below 10 000
Rows = list[list[int]]


def require(matrix: Rows, fault: str, definite: bool = False) -> None:
    """Raises Refused if a symmetric matrix is not positive semidefinite (or definite), or its numbers are too long."""
    longest = max((max(map(int.bit_length, row)) for row in matrix), default=0)
    enclosure.demand(longest * len(matrix) <= MOST_BITS, "the numbers are too long for so many errors")
    enclosure.demand(kernel.positive(matrix, definite), fault)


@lru_cache(64)
def turns(P: tuple[tuple[int, ...], ...], flips: tuple[int, ...], growth: Fraction) -> str:
    """Checks that V = e'Pe grows at most by the factor g = ``growth`` when the errors ``flips`` change their signs.

    With J = diag(-1 at flips, else 1) the condition is g P - J'PJ >= 0, positive semidefinite. With P in the blocks K
    (errors that keep their sign), F (those that flip) and C (between them), that matrix is

        [(g - 1) K, (g + 1) C; (g + 1) C', (g - 1) F].

    For g > 1 multiply rows and columns of K by 1/sqrt(g - 1), those of F by sqrt(g - 1)/(g + 1): it is positive
    semidefinite exactly if [K, C; C', (g - 1)^2/(g + 1)^2 F] is. For g = 1 both hold exactly if C = 0, since K > 0.
    With g = a/b the block F is tested times (a - b)^2, C times a + b, K times 1, in integers.

    Args:
        P: symmetric and positive definite, of integers.
        flips: indices of errors, rising.

    Returns:
        "" if the condition holds, else the reason why it is not shown. Cached: a certificate and its proof ask the
        same.
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


def product(A: Any, B: Any, zero: Any) -> Any:
    """AB, for numbers or polynomials; entries that are 0 are left out of the sums."""
    columns = list(zip(*B, strict=True))
    return [[sum((a * b for a, b in zip(row, c, strict=True) if a and b), zero) for c in columns] for row in A]
