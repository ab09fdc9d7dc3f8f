"""Sums of absolute responses of a linear error over samples, in whole numbers on a grid, and what P says of the rest.

Standard library only; part of the checker (newtons.py), which hands ``verify`` in.
"""

import math
from fractions import Fraction
from operator import mul
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import verify

GRID, LONGEST, EVERY, ENOUGH = 1 << 120, 20_000, 64, 100_000
Matrix = list[list[Fraction]]


def times(A: Matrix, B: Matrix) -> Matrix:
    return [[sum(map(mul, row, column), Fraction(0)) for column in zip(*B, strict=True)] for row in A]


def solved(A: Matrix, B: Matrix, where: str) -> Matrix:
    """X with A X = B, by elimination on whole numbers (Bareiss, Jordan): every division is exact."""
    n, last = len(A), 1
    rows = verify.integers([a + b for a, b in zip(A, B, strict=True)])[0]
    for k in range(n):
        at = next((i for i in range(k, n) if rows[i][k]), None)
        if at is None:
            raise verify.Refused(f"{where} is singular")
        rows[k], rows[at] = rows[at], rows[k]
        for i in (i for i in range(n) if i != k):
            rows[i] = [(rows[k][k] * x - rows[i][k] * y) // last for x, y in zip(rows[i], rows[k], strict=True)]
        last = rows[k][k]
    return [[Fraction(x, last) for x in row[n:]] for row in rows]


def root(x: Fraction) -> Fraction:
    """The square root, rounded upwards."""
    return Fraction(math.isqrt(math.ceil(x * GRID * GRID)) + 1, GRID)


def identity(m: int) -> Matrix:
    return [[Fraction(i == j) for j in range(m)] for i in range(m)]


class Responses:
    """Responses of the error on a grid, and by the certificate's P what is left: V falls by gamma^2 in a sample."""

    def __init__(self, cert: dict[str, Any], step: Matrix) -> None:
        m, gamma = len(step), root(1 - 2 * cert["decay_rate"] * cert["sample_time"])
        verify.demand(gamma < 1, "the fall is too near to 1")
        inverse = solved(cert["lyapunov_matrix"], identity(m), "lyapunov_matrix")
        self.seen = [root(inverse[i][i]) / (1 - gamma) for i in range(m)]  # sum over k of |e_i| <= seen_i sqrt(V)
        self.P, self.scale = verify.integers(cert["lyapunov_matrix"])
        whole, self.common = verify.integers(step)
        self.rows = [[(j, a) for j, a in enumerate(row) if a] for row in whole]
        # What is rounded to the grid in a sample is one more start of an error, of less than a unit in each entry.
        self.rounding = sum((self.size([int(i == j) for j in range(m)]) for i in range(m)), Fraction(0))

    def size(self, vector: list[int]) -> Fraction:
        """sqrt(V)."""
        return (
            root(
                Fraction(sum(x * sum(map(mul, row, vector)) for x, row in zip(vector, self.P, strict=True)), self.scale)
            )
            / GRID
        )

    def next(self, vector: list[int]) -> list[int]:
        half = self.common // 2
        return [(sum(a * vector[j] for j, a in row) + half) // self.common for row in self.rows]

    def summed(self, columns: list[list[Fraction]]) -> tuple[list[Fraction], int]:
        """A bound on the sum over all samples and columns of |Phi^k b|, by component; and how many were summed."""
        vectors = [[round(x * GRID) for x in column] for column in columns]
        total = [0] * len(self.rows)
        for k in range(1, LONGEST + 1):
            for i, row in enumerate(zip(*vectors, strict=True)):
                total[i] += sum(map(abs, row))
            vectors = [self.next(vector) for vector in vectors]
            if k % EVERY == 0:
                left = sum(map(self.size, vectors), Fraction(0)) + len(columns) * (k + 1) * self.rounding
                rest = [seen * left for seen in self.seen]
                if all(r * GRID * ENOUGH <= t or not t for r, t in zip(rest, total, strict=True)):
                    return [Fraction(t, GRID) + r for t, r in zip(total, rest, strict=True)], k
        raise verify.Refused(f"not decayed after {LONGEST} samples")

    def powers(self, watched: set[int]) -> dict[int, Matrix]:
        """k -> bounds on the entries of |Phi^k|, by columns."""
        verify.demand(max(watched, default=0) <= LONGEST, f"a bound after more than {LONGEST} samples")
        vectors, found = [[GRID * (i == j) for i in range(len(self.rows))] for j in range(len(self.rows))], {}
        for k in range(max(watched, default=-1) + 1):
            if k in watched:
                slack = [s * (k + 1) * self.rounding for s in self.seen]
                found[k] = [[Fraction(abs(x), GRID) + s for x, s in zip(v, slack, strict=True)] for v in vectors]
            vectors = [self.next(vector) for vector in vectors]
        return found
