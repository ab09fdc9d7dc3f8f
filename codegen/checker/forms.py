"""Quadratic forms on integers: definiteness, inverse, and growth of V at a change of signs; products of matrices.

Standard library only; part of the checker (verify.py), which passes ``enclosure`` and ``kernel`` in.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, kernel

# Most bits of an entry times the number of rows, which bounds the numbers of the elimination. Below 10 000 in the
# shipped certificates.
MOST_BITS = 1 << 14
Rows = Sequence[Sequence[int]]


def require(matrix: Rows, fault: str, definite: bool = False) -> None:
    """Raises Refused if a symmetric matrix is not positive semidefinite (or definite), or its numbers are too long."""
    longest = max((max(map(int.bit_length, row)) for row in matrix), default=0)
    enclosure.demand(longest * len(matrix) <= MOST_BITS, "the numbers are too long for so many errors")
    enclosure.demand(kernel.positive(tuple(map(tuple, matrix)), definite), fault)


@lru_cache(4)
def inverse(P: tuple[tuple[int, ...], ...]) -> tuple[list[list[int]], int]:
    """(X, d) with X/d the inverse of P, symmetric and positive definite, of integers; d > 0. Else enclosure.Refused.

    The sweep operator: with the pivot p = P_kk, all other entries become P_ij - P_ik P_kj/p, those of row and column k
    become P_ik/p, and p becomes -1/p. It keeps the symmetry, and all sweeps together give minus the inverse. Times p
    and over the last p, entries that are whole stay whole (Bareiss), as in the kernel's lemma 2.
    """
    require(P, "P is not positive definite", definite=True)
    rest, last = [[*row[i:]] for i, row in enumerate(P)], 1  # the upper half of the matrix is all
    for k in range(len(P)):
        r = [*(row[k - i] for i, row in enumerate(rest[:k])), *rest[k]]
        p = r[k]
        kernel.demand(True, "")  # refuses where the time limit has passed
        for i, a in enumerate(r):
            if i != k and a:
                rest[i] = [(p * x - a * b) // last for x, b in zip(rest[i], r[i:], strict=True)]
            elif i != k:
                rest[i] = [p * x // last for x in rest[i]]
        for i in range(k):
            rest[i][k - i] = r[i]
        rest[k], last = [-last, *r[k + 1 :]], p
    size = range(len(P))
    return [[-rest[min(i, j)][abs(i - j)] for j in size] for i in size], last


@lru_cache(64)
def turns(P: tuple[tuple[int, ...], ...], flips: tuple[int, ...], growth: Fraction) -> str:
    """Checks that V = e'Pe grows at most by the factor g = ``growth`` when the errors ``flips`` change their signs.

    With J = diag(-1 at flips, else 1) the condition is g P - J'PJ >= 0, positive semidefinite. With P in the blocks K
    (errors that keep their sign), F (those that flip) and C (between them), that matrix is

        [(g - 1) K, (g + 1) C; (g + 1) C', (g - 1) F].

    Let X be the block of the inverse of P at flips: X^-1 = F - C'K^-1 C. For g > 1 the matrix is positive semidefinite
    exactly if (g - 1)^2 F >= (g + 1)^2 C'K^-1 C, which is (g + 1)^2 X^-1 >= 4g F; and so for g = 1, where both hold
    exactly if C = 0. Equivalent is F^-1 >= 4g/(g + 1)^2 X, and, from both sides times F, (g + 1)^2 F >= 4g F X F.

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
    try:
        whole, d = inverse(P)
        F, X = ([[A[i][j] for j in flips] for i in flips] for A in (P, whole))
        FXF = product(product(F, X, 0), F, 0)
        rise = [[(a + b) ** 2 * d * x - 4 * a * b * y for x, y in zip(*rows, strict=True)]
                for rows in zip(F, FXF, strict=True)]  # fmt: skip
        require(rise, "not positive semidefinite")
    except enclosure.Refused as why:
        return str(why)
    return ""


def product(A: Any, B: Any, zero: Any) -> Any:
    """AB, for numbers or polynomials; entries that are 0 are left out of the sums."""
    columns, rows = [*zip(*B, strict=True)], [[(j, a) for j, a in enumerate(row) if a] for row in A]
    kernel.demand(all(len(row) == len(c) for c in columns[:1] for row in A), "matrices whose sizes do not fit")
    return [[sum((a * c[j] for j, a in row if c[j]), zero) for c in columns] for row in rows]  # not all at once
