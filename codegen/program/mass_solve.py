"""Solution of M a = r as blocks: closed form for n = 2, otherwise LDLᵀ over M's sparsity, one division a pivot.

A diagonal M costs one division an entry; for a constant M only stored constants remain in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi

from codegen.program.model import Block


class MassSolve:
    """Builder of the blocks, in order; later entries use the names of earlier ones.

    Args:
        taken: names in use.
        source: equation number.
    """

    def __init__(self, taken: set[str], source: str) -> None:
        self._taken, self._source = taken, source
        self.blocks: list[Block] = []

    def solve(self, mass: Any, right: Any) -> Any:
        """a of M a = r, n by 1, over the elements of ``blocks``; M is symmetric positive definite.

        Structural zeros of M cost nothing.
        """
        n = mass.shape[0]
        matrix = self._named("mass_matrix", "M", casadi.SX(mass), n)
        label = _label(n)
        force = self.named("force_balance", [label("r", i) for i in range(n)], [right[i] for i in range(n)])
        if n == 2 and (1, 0) in matrix:
            return self._closed(matrix, force)
        return self._factored(matrix, force)

    def eliminate(self, matrix: Any, right: Any) -> Any:
        """x of A x = r for an unsymmetric A: Gaussian elimination over A's sparsity, without pivoting.

        Every leading minor of A must differ from zero.
        """
        n = matrix.shape[0]
        label = _label(n)
        a = {(i, j): matrix[i, j] for i in range(n) for j in range(n) if not matrix[i, j].is_zero()}
        r = [right[i] for i in range(n)]
        over: list[Any] = []
        for j in range(n):
            if a[j, j].is_one():
                over.append(casadi.SX(1))
            else:
                over += self.named("pivots", [f"one_over_{label('p', j)}"], [1 / a[j, j]])
            across = [k for k in range(j + 1, n) if (j, k) in a]
            for i in range(j + 1, n):
                if (i, j) not in a:
                    continue
                factor = self.named("factors", [label("f", i, j)], [a[i, j] * over[j]])[0]
                for k in across:
                    entry = a.get((i, k), casadi.SX(0)) - factor * a[j, k]
                    a[i, k] = self.named("factors", [label("A", i, k)], [entry])[0]
                r[i] = self.named("forward", [label("r", i)], [r[i] - factor * r[j]])[0]
        x: list[Any] = [casadi.SX(0)] * n
        for i in reversed(range(n)):
            rest = r[i]
            for k in range(i + 1, n):
                if (i, k) in a:
                    rest = rest - a[i, k] * x[k]
            x[i] = self.named("backward", [label("d", i)], [rest * over[i]])[0]
        return casadi.vertcat(*x)

    def _closed(self, matrix: dict[tuple[int, int], Any], r: list[Any]) -> Any:
        a, b, c = matrix[0, 0], matrix[1, 0], matrix[1, 1]
        over = self.named("determinant", ["one_over_det_M"], [1 / (a * c - b * b)])[0]
        return casadi.vertcat(over * (c * r[0] - b * r[1]), over * (a * r[1] - b * r[0]))

    def _factored(self, matrix: dict[tuple[int, int], Any], r: list[Any]) -> Any:
        n = len(r)
        label = _label(n)
        below: list[set[int]] = [set() for _ in range(n)]
        left: list[list[int]] = [[] for _ in range(n)]
        factor: dict[tuple[int, int], Any] = {}
        scaled: dict[tuple[int, int], Any] = {}
        reciprocal: list[Any] = []
        for i, j in matrix:
            below[j] |= {i} - {j}
        for j in range(n):
            pivot = matrix[j, j]
            for k in left[j]:
                pivot = pivot - scaled[j, k] * factor[j, k]
                below[j] |= {i for i in below[k] if i > j}
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
        for i in range(n):
            for k in left[i]:
                y[i] = y[i] - factor[i, k] * y[k]
            y[i] = self.named("forward", [label("y", i)], [y[i]])[0]
        a: list[Any] = [y[i] * reciprocal[i] for i in range(n)]
        for i in reversed(range(n)):
            for k in sorted(below[i]):
                a[i] = a[i] - factor[k, i] * a[k]
            a[i] = self.named("backward", [label("a", i)], [a[i]])[0]
        return casadi.vertcat(*a)

    def _named(self, block: str, letter: str, matrix: Any, n: int) -> dict[tuple[int, int], Any]:
        """Symbols for the nonzero entries of the lower triangle."""
        label = _label(n)
        rows, columns = matrix.sparsity().get_triplet()
        places = [(i, j) for i, j in zip(rows, columns, strict=True) if i >= j and not matrix[i, j].is_zero()]
        symbols = self.named(block, [label(letter, *p) for p in places], [matrix[i, j] for i, j in places])
        return dict(zip(places, symbols, strict=True))

    def named(self, name: str, wishes: Sequence[str], values: Sequence[Any]) -> list[Any]:
        """Symbols for values under given names, in one block."""
        elements = []
        for wish in wishes:
            free = (wish, f"{wish}_", *(f"{wish}_{k}" for k in range(2, len(self._taken) + 2)))
            elements.append(next(name for name in free if name not in self._taken))
            self._taken.add(elements[-1])
        units = ("",) * len(elements)
        self.blocks.append(Block(name, tuple(elements), casadi.vertcat(*values), units, self._source, inner=True))
        return list(casadi.vertsplit(self.blocks[-1].symbols))


def _label(n: int) -> Callable[..., str]:
    """M21 for n below ten, M10_2 above."""
    return lambda letter, *indices: letter + ("" if n < 10 else "_").join(str(i + 1) for i in indices)
