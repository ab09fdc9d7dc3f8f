"""M a = r without an inverse: LDLᵀ unrolled over M's own sparsity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi


@dataclass(frozen=True)
class Factors:
    """M = L D Lᵀ of a symmetric positive definite M, unrolled over M's own sparsity.

    Attributes:
        lower: rows of L below its diagonal of ones; structural zeros are zero.
        pivots: D.
        reciprocals: as in ``factorised``.
    """

    lower: tuple[tuple[Any, ...], ...]
    pivots: tuple[Any, ...]
    reciprocals: bool

    def solve(self, right: Any) -> Any:
        """a of M a = r, each n by 1 SX."""
        lower, n = self.lower, len(self.pivots)
        y = [right[i] for i in range(n)]
        for i in range(n):
            for k in range(i):
                if not lower[i][k].is_zero():
                    y[i] = y[i] - lower[i][k] * y[k]
        a = [_over(y[i], pivot, self.reciprocals) for i, pivot in enumerate(self.pivots)]
        for i in reversed(range(n)):
            for k in range(i + 1, n):
                if not lower[k][i].is_zero():
                    a[i] = a[i] - lower[k][i] * a[k]
        return casadi.vertcat(*a)

    def solve_columns(self, right: Any) -> Any:
        """A of M A = R, each n by any number of columns."""
        return casadi.horzcat(*[self.solve(right[:, k]) for k in range(right.shape[1])])


def factorised(mass: Any, reciprocals: bool = True) -> Factors:
    """The LDLᵀ of M, n by n SX, symmetric positive definite; structural zeros cost nothing.

    Args:
        reciprocals: whether a division by a constant pivot is a product with its reciprocal, which rounds twice. Pivots
            that vary are divided by in any case: CasADi writes a product with 1/d as a quotient.
    """
    n = mass.shape[0]
    lower = [[casadi.SX(0)] * i for i in range(n)]
    pivot: list[Any] = []
    for j in range(n):
        d = mass[j, j]
        for k in range(j):
            if not lower[j][k].is_zero():
                d = d - lower[j][k] * lower[j][k] * pivot[k]
        pivot.append(d)
        for i in range(j + 1, n):
            entry = mass[i, j]
            for k in range(j):
                if not (lower[i][k].is_zero() or lower[j][k].is_zero()):
                    entry = entry - lower[i][k] * lower[j][k] * pivot[k]
            if not entry.is_zero():
                lower[i][j] = _over(entry, d, reciprocals)
    return Factors(tuple(tuple(row) for row in lower), tuple(pivot), reciprocals)


def _over(value: Any, pivot: Any, reciprocals: bool) -> Any:
    return value * (1 / pivot) if reciprocals else value / pivot


def solve_symmetric(mass: Any, right: Any) -> Any:
    """a of M a = r, n by 1, for one right side; see ``factorised``."""
    return factorised(mass).solve(right)


def solve_by_elimination(matrix: Any, right: Any) -> Any:
    """y of A y = r, n by 1 SX, by Gauss's elimination in the given order, unrolled over A's own sparsity.

    The leading blocks of A must be regular; structural zeros cost nothing.
    """
    n = matrix.shape[0]
    rows = [[matrix[i, j] for j in range(n)] for i in range(n)]
    y = [right[i] for i in range(n)]
    for k in range(n):
        for i in range(k + 1, n):
            if rows[i][k].is_zero():
                continue
            factor = rows[i][k] / rows[k][k]
            for j in range(k + 1, n):
                if not rows[k][j].is_zero():
                    rows[i][j] = rows[i][j] - factor * rows[k][j]
            y[i] = y[i] - factor * y[k]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            if not rows[i][j].is_zero():
                y[i] = y[i] - rows[i][j] * y[j]
        y[i] = y[i] / rows[i][i]
    return casadi.vertcat(*y)
