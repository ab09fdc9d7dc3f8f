"""Solution of M a = r as blocks: Cramer's rule for n = 2, otherwise LDLᵀ over M's sparsity, with one division a pivot.

For a diagonal M this is one division an entry; for a constant M a step uses stored constants only. Intermediate values
are named (``D1``, ``L21``, …), so that the generated code reads like a factorisation by hand.
"""

from collections.abc import Sequence
from typing import Any

import casadi

from codegen.mechanics.solve import Name, factorised, solve_by_elimination
from codegen.program.model import Block


class MassSolve:
    """Linear solver that adds its intermediate values to ``blocks``, in the order of computation.

    Args:
        taken: names in use, to which those of the blocks are added, each with ``prefix``.
        source: equation number, for the blocks.
    """

    def __init__(self, taken: set[str], source: str, prefix: str = "") -> None:
        self._taken, self._source, self._prefix = taken, source, prefix
        self.blocks: list[Block] = []

    def solve(self, mass: Any, right: Any) -> Any:
        """SX of the a of M a = r, n by 1, over the elements of ``blocks``; M is symmetric positive definite.

        Structural zeros of M cost no operations.
        """
        mass, n = casadi.SX(mass), mass.shape[0]
        triplets = zip(*mass.sparsity().get_triplet(), strict=True)
        places = [(i, j) for i, j in triplets if i >= j and not mass[i, j].is_zero()]
        lower = casadi.SX(n, n)
        symbols = self.named("mass_matrix", [_label(n, "M", *p) for p in places], [mass[p] for p in places])
        for place, symbol in zip(places, symbols, strict=True):
            lower[place] = symbol
        r = self.named("force_balance", [_label(n, "r", i) for i in range(n)], [right[i] for i in range(n)])
        if n == 2 and (1, 0) in places:
            return self._by_cramers_rule(lower, r)
        return factorised(lower, name=self._name(n)).solve(r)

    def eliminate(self, matrix: Any, right: Any) -> Any:
        """SX of the x of A x = r for an unsymmetric A, n by 1; see ``solve_by_elimination``."""
        return solve_by_elimination(matrix, right, self._name(matrix.shape[0]))

    def _by_cramers_rule(self, mass: Any, r: Sequence[Any]) -> Any:
        """The a of M a = r for n = 2, M by its lower triangle: one division."""
        a, b, c = mass[0, 0], mass[1, 0], mass[1, 1]
        reciprocal = self.named("determinant", ["one_over_det_M"], [1 / (a * c - b * b)])[0]
        return casadi.vertcat(reciprocal * (c * r[0] - b * r[1]), reciprocal * (a * r[1] - b * r[0]))

    def _name(self, n: int) -> Name:
        """A function that gives each intermediate value of a system of n equations a name and a block of its own."""
        return lambda block, letter, indices, value: self.named(block, [_label(n, letter, *indices)], [value])[0]

    def named(self, name: str, wishes: Sequence[str], values: Sequence[Any]) -> list[Any]:
        """Add a block of values, and return their symbols.

        ``wishes``: a name for each, to which ``_`` or a number is added if it is in use.
        """
        elements = []
        for wish in (f"{self._prefix}{each}" for each in wishes):
            possible = (wish, f"{wish}_", *(f"{wish}_{k}" for k in range(2, len(self._taken) + 2)))
            elements.append(next(element for element in possible if element not in self._taken))
            self._taken.add(elements[-1])
        units = ("",) * len(elements)
        self.blocks.append(Block(name, tuple(elements), casadi.vertcat(*values), units, self._source, inner=True))
        return list(casadi.vertsplit(self.blocks[-1].symbols))


def _label(n: int, letter: str, *indices: int) -> str:
    """The name of an entry of a vector or matrix of n rows: M21 for n below ten, else M10_2."""
    return letter + ("" if n < 10 else "_").join(str(i + 1) for i in indices)
