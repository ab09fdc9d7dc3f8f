"""Solution of M a = r as blocks: Cramer's rule for n = 2, otherwise LDLᵀ over M's sparsity, with one division a pivot.

For a diagonal M this is one division an entry; for a constant M a step uses stored constants only. Intermediate values
are named (``D1``, ``L21``, …), so that the generated code reads like a factorisation by hand. ``mechanics.solve`` does
the same without names, for simulation and analysis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi

from codegen.program.model import Block


class MassSolve:
    """Linear solver that adds its intermediate values to ``blocks``, in the order of computation.

    Args:
        taken: names in use, to which those of the blocks are added.
        source: equation number, for the blocks.
        prefix: of the names.
    """

    def __init__(self, taken: set[str], source: str, prefix: str = "") -> None:
        self._taken, self._source, self._prefix = taken, source, prefix
        self.blocks: list[Block] = []

    def solve(self, mass: Any, right: Any) -> Any:
        """SX of the a of M a = r, n by 1, over the elements of ``blocks``; M is symmetric positive definite.

        Structural zeros of M cost no operations.
        """
        n = mass.shape[0]
        matrix = self._named("mass_matrix", "M", casadi.SX(mass), n)
        label = _label(n)
        force = self.named("force_balance", [label("r", i) for i in range(n)], [right[i] for i in range(n)])
        if n == 2 and (1, 0) in matrix:
            return self._by_cramers_rule(matrix, force)
        return self._by_factorisation(matrix, force)

    def eliminate(self, matrix: Any, right: Any) -> Any:
        """SX of the x of A x = r for an unsymmetric A: Gaussian elimination over A's sparsity, without pivoting.

        Every leading principal minor of A must differ from zero.
        """
        n = matrix.shape[0]
        label = _label(n)
        a = {(i, j): matrix[i, j] for i in range(n) for j in range(n) if not matrix[i, j].is_zero()}
        r = [right[i] for i in range(n)]
        reciprocal: list[Any] = []
        for j in range(n):
            if a[j, j].is_one():
                reciprocal.append(casadi.SX(1))
            else:
                reciprocal += self.named("pivots", [f"one_over_{label('p', j)}"], [1 / a[j, j]])
            right_of_pivot = [k for k in range(j + 1, n) if (j, k) in a]
            for i in range(j + 1, n):
                if (i, j) not in a:
                    continue
                factor = self.named("factors", [label("f", i, j)], [a[i, j] * reciprocal[j]])[0]
                for k in right_of_pivot:
                    entry = a.get((i, k), casadi.SX(0)) - factor * a[j, k]
                    a[i, k] = self.named("factors", [label("A", i, k)], [entry])[0]
                r[i] = self.named("forward", [label("r", i)], [r[i] - factor * r[j]])[0]
        x: list[Any] = [casadi.SX(0)] * n
        for i in reversed(range(n)):
            rest = r[i]
            for k in range(i + 1, n):
                if (i, k) in a:
                    rest = rest - a[i, k] * x[k]
            x[i] = self.named("backward", [label("d", i)], [rest * reciprocal[i]])[0]
        return casadi.vertcat(*x)

    def _by_cramers_rule(self, matrix: dict[tuple[int, int], Any], r: list[Any]) -> Any:
        """The a of M a = r for n = 2, M by its lower triangle: one division."""
        a, b, c = matrix[0, 0], matrix[1, 0], matrix[1, 1]
        reciprocal = self.named("determinant", ["one_over_det_M"], [1 / (a * c - b * b)])[0]
        return casadi.vertcat(reciprocal * (c * r[0] - b * r[1]), reciprocal * (a * r[1] - b * r[0]))

    def _by_factorisation(self, matrix: dict[tuple[int, int], Any], r: list[Any]) -> Any:
        """The a of M a = r by M = L D Lᵀ, M by its lower triangle, as in ``mechanics.solve.factorised``.

        l_ij d_j = m_ij − Σ_k (l_ik d_k) l_jk: the products l_ij d_j are kept too (``scaled``), which saves one
        multiplication in each term.
        """
        n = len(r)
        label = _label(n)
        below: list[set[int]] = [set() for _ in range(n)]  # of column j, the rows i > j with l_ij ≠ 0
        left: list[list[int]] = [[] for _ in range(n)]  # of row i, the columns j < i with l_ij ≠ 0
        factor: dict[tuple[int, int], Any] = {}
        scaled: dict[tuple[int, int], Any] = {}
        reciprocal: list[Any] = []
        for i, j in matrix:
            below[j] |= {i} - {j}
        for j in range(n):
            pivot = matrix[j, j]
            for k in left[j]:
                pivot = pivot - scaled[j, k] * factor[j, k]
                below[j] |= {i for i in below[k] if i > j}  # fill-in
            pivot = self.named("pivots", [label("D", j)], [pivot])[0]
            reciprocal += self.named("pivot reciprocals", [f"one_over_{label('D', j)}"], [1 / pivot])
            for i in sorted(below[j]):
                entry = matrix.get((i, j), casadi.SX(0))
                for k in left[j]:
                    if (i, k) in factor:
                        entry = entry - scaled[i, k] * factor[j, k]
                scaled[i, j] = self.named("factors", [label("LD", i, j)], [entry])[0]
                factor[i, j] = self.named("factors", [label("L", i, j)], [scaled[i, j] * reciprocal[j]])[0]
                left[i].append(j)
        y = list(r)
        for i in range(n):  # L y = r
            for k in left[i]:
                y[i] = y[i] - factor[i, k] * y[k]
            y[i] = self.named("forward", [label("y", i)], [y[i]])[0]
        a: list[Any] = [y[i] * reciprocal[i] for i in range(n)]
        for i in reversed(range(n)):  # Lᵀ a = D⁻¹ y
            for k in sorted(below[i]):
                a[i] = a[i] - factor[k, i] * a[k]
            a[i] = self.named("backward", [label("a", i)], [a[i]])[0]
        return casadi.vertcat(*a)

    def _named(self, block: str, letter: str, matrix: Any, n: int) -> dict[tuple[int, int], Any]:
        """(row, column) → symbol of each nonzero entry of the lower triangle."""
        label = _label(n)
        rows, columns = matrix.sparsity().get_triplet()
        places = [(i, j) for i, j in zip(rows, columns, strict=True) if i >= j and not matrix[i, j].is_zero()]
        symbols = self.named(block, [label(letter, *p) for p in places], [matrix[i, j] for i, j in places])
        return dict(zip(places, symbols, strict=True))

    def named(self, name: str, wishes: Sequence[str], values: Sequence[Any]) -> list[Any]:
        """Add a block of values, and return their symbols.

        Args:
            name: of the block.
            wishes: names of the symbols; one in use gets ``_`` or a number at its end.
        """
        elements = []
        for wish in (f"{self._prefix}{each}" for each in wishes):
            possible = (wish, f"{wish}_", *(f"{wish}_{k}" for k in range(2, len(self._taken) + 2)))
            elements.append(next(element for element in possible if element not in self._taken))
            self._taken.add(elements[-1])
        units = ("",) * len(elements)
        self.blocks.append(Block(name, tuple(elements), casadi.vertcat(*values), units, self._source, inner=True))
        return list(casadi.vertsplit(self.blocks[-1].symbols))


def _label(n: int) -> Callable[..., str]:
    """Function that names an entry of a matrix of n rows: M21 for n below ten, else M10_2."""
    return lambda letter, *indices: letter + ("" if n < 10 else "_").join(str(i + 1) for i in indices)
