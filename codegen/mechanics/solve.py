"""Solution of M a = r by LDLᵀ factorisation, unrolled into CasADi SX over the sparsity of M.

Operations on structural zeros are left out, so that the generated code has no line for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi


@dataclass(frozen=True)
class Factors:
    """M = L D Lᵀ of a symmetric positive definite M.

    Attributes:
        lower: row i of L without the diagonal one, i entries; structural zeros are 0.
        pivots: the diagonal of D.
        reciprocals: as the argument of ``factorised``.
    """

    lower: tuple[tuple[Any, ...], ...]
    pivots: tuple[Any, ...]
    reciprocals: bool

    def solve(self, right: Any) -> Any:
        """The a of M a = r, each n by 1 SX: L y = r, then a₀ = D⁻¹ y, then Lᵀ a = a₀."""
        lower, n = self.lower, len(self.pivots)
        y = [right[i] for i in range(n)]
        for i in range(n):  # forward substitution
            for k in range(i):
                if not lower[i][k].is_zero():
                    y[i] = y[i] - lower[i][k] * y[k]
        a = [_divided(y[i], pivot, self.reciprocals) for i, pivot in enumerate(self.pivots)]
        for i in reversed(range(n)):  # back substitution
            for k in range(i + 1, n):
                if not lower[k][i].is_zero():
                    a[i] = a[i] - lower[k][i] * a[k]
        return casadi.vertcat(*a)

    def solve_columns(self, right: Any) -> Any:
        """The A of M A = R, each n by any number of columns."""
        return casadi.horzcat(*[self.solve(right[:, k]) for k in range(right.shape[1])])


def factorised(mass: Any, reciprocals: bool = True) -> Factors:
    """The LDLᵀ factorisation of M, n by n SX, symmetric positive definite.

    Column by column: d_j = m_jj − Σ_k l_jk² d_k, l_ij = (m_ij − Σ_k l_ik l_jk d_k)/d_j, sums over k < j.

    Args:
        reciprocals: whether a division by a constant pivot becomes a product with its reciprocal, which is faster but
            rounds twice. A pivot that varies is always divided by: CasADi turns a product with 1/d into a quotient.
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
                lower[i][j] = _divided(entry, d, reciprocals)
    return Factors(tuple(tuple(row) for row in lower), tuple(pivot), reciprocals)


def _divided(value: Any, pivot: Any, reciprocals: bool) -> Any:
    """value/pivot, with ``reciprocals`` as value · (1/pivot)."""
    return value * (1 / pivot) if reciprocals else value / pivot


def solve_by_elimination(matrix: Any, right: Any) -> Any:
    """The y of A y = r, n by 1 SX, by Gaussian elimination without pivoting: generated code has one fixed order.

    All leading principal minors of A must be nonzero.
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
