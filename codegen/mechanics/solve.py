"""Solution of linear systems unrolled into CasADi SX over the sparsity of the matrix: LDLᵀ and Gaussian elimination.

Operations on structural zeros are left out, so that the generated code has no line for them. Simulation and analysis
take the expressions as they are; a program names the intermediate values.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi

Name = Callable[[str, str, tuple[int, ...], Any], Any]
"""Function (block, letter, indices, value) → the symbol of an intermediate value, which is used in its place."""


@dataclass(frozen=True)
class Factors:
    """M = L D Lᵀ of a symmetric positive definite M.

    Attributes:
        lower: row i of L without the diagonal one, i entries; structural zeros are 0.
        pivots: the diagonal of D.
        reciprocals: 1/d_j, which replace divisions by d_j; None for divisions.
        name: as the argument of ``factorised``.
    """

    lower: tuple[tuple[Any, ...], ...]
    pivots: tuple[Any, ...]
    reciprocals: tuple[Any, ...] | None
    name: Name | None

    def solve(self, right: Any) -> Any:
        """The a of M a = r, each n by 1 SX: L y = r, then a₀ = D⁻¹ y, then Lᵀ a = a₀."""
        lower, n, named = self.lower, len(self.pivots), self.name or _unnamed
        y = [right[i] for i in range(n)]
        for i in range(n):  # forward substitution
            for k in range(i):
                if not lower[i][k].is_zero():
                    y[i] = y[i] - lower[i][k] * y[k]
            y[i] = named("forward", "y", (i,), y[i])
        a = [_divided(y[i], i, self.pivots, self.reciprocals) for i in range(n)]
        for i in reversed(range(n)):  # back substitution
            for k in range(i + 1, n):
                if not lower[k][i].is_zero():
                    a[i] = a[i] - lower[k][i] * a[k]
            a[i] = named("backward", "a", (i,), a[i])
        return casadi.vertcat(*a)

    def solve_columns(self, right: Any) -> Any:
        """The A of M A = R, each n by any number of columns."""
        return casadi.horzcat(*[self.solve(right[:, k]) for k in range(right.shape[1])])


def factorised(mass: Any, reciprocals: bool = True, name: Name | None = None) -> Factors:
    """The LDLᵀ factorisation of M, n by n SX, symmetric positive definite.

    Column by column: d_j = m_jj − Σ_k l_jk² d_k, l_ij = (m_ij − Σ_k l_ik l_jk d_k)/d_j, sums over k < j.

    Args:
        mass: of which the lower triangle is used.
        reciprocals: whether a division by a constant pivot becomes a product with its reciprocal, which is faster but
            rounds twice. A pivot that varies is always divided by: CasADi turns a product with 1/d into a quotient.
        name: of intermediate values; without it they are expressions. With it the products l_ij d_j are kept too, which
            saves one multiplication in each term, and each pivot is divided by once.
    """
    n = mass.shape[0]
    lower, scaled = ([[casadi.SX(0)] * i for i in range(n)] for _ in range(2))
    pivots: list[Any] = []
    inverse: list[Any] | None = [] if reciprocals else None
    named = name or _unnamed

    def term(i: int, j: int, k: int) -> Any:
        """l_ik l_jk d_k."""
        return scaled[i][k] * lower[j][k] if name else lower[i][k] * lower[j][k] * pivots[k]

    for j in range(n):
        d = mass[j, j]
        for k in range(j):
            if not lower[j][k].is_zero():
                d = d - term(j, j, k)
        pivots.append(named("pivots", "D", (j,), d))
        if inverse is not None:
            inverse.append(named("pivot reciprocals", "one_over_D", (j,), 1 / pivots[j]))
        for i in range(j + 1, n):
            entry = mass[i, j]
            for k in range(j):
                if not (lower[i][k].is_zero() or lower[j][k].is_zero()):
                    entry = entry - term(i, j, k)
            if not entry.is_zero():
                scaled[i][j] = named("factors", "LD", (i, j), entry)
                lower[i][j] = named("factors", "L", (i, j), _divided(scaled[i][j], j, pivots, inverse))
    return Factors(tuple(map(tuple, lower)), tuple(pivots), None if inverse is None else tuple(inverse), name)


def _divided(value: Any, j: int, pivots: Sequence[Any], reciprocals: Sequence[Any] | None) -> Any:
    """value/d_j, by its reciprocal where that is given."""
    return value / pivots[j] if reciprocals is None else value * reciprocals[j]


def _unnamed(block: str, letter: str, indices: tuple[int, ...], value: Any) -> Any:
    """The value itself in place of a name."""
    return value


def solve_by_elimination(matrix: Any, right: Any, name: Name | None = None) -> Any:
    """The y of A y = r, n by 1 SX, by Gaussian elimination without pivoting: generated code has one fixed order.

    All leading principal minors of A must be nonzero. ``name``: of intermediate values, as for ``factorised``; each
    pivot that is not 1 is then divided by once.
    """
    n, named = matrix.shape[0], name or _unnamed
    rows = [[matrix[i, j] for j in range(n)] for i in range(n)]
    y = [right[i] for i in range(n)]
    pivots: list[Any] = []
    inverse: list[Any] | None = [] if name else None
    for k in range(n):
        pivots.append(rows[k][k])
        if inverse is not None:
            one = casadi.SX(1)
            inverse.append(one if pivots[k].is_one() else named("pivots", "one_over_p", (k,), one / pivots[k]))
        for i in range(k + 1, n):
            if rows[i][k].is_zero():
                continue
            factor = named("factors", "f", (i, k), _divided(rows[i][k], k, pivots, inverse))
            for j in range(k + 1, n):
                if not rows[k][j].is_zero():
                    rows[i][j] = named("factors", "A", (i, j), rows[i][j] - factor * rows[k][j])
            y[i] = named("forward", "r", (i,), y[i] - factor * y[k])
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            if not rows[i][j].is_zero():
                y[i] = y[i] - rows[i][j] * y[j]
        y[i] = named("backward", "d", (i,), _divided(y[i], i, pivots, inverse))
    return casadi.vertcat(*y)
