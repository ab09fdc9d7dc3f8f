"""Solution of small positive definite systems as a list of named observer equations."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.mechanics.system import Matrix
from codegen.observers.equations import Equation
from codegen.spec.model import symbol

PREFIX = "cancel"


class Steps:
    """Ordered collection of equations; each method returns the symbols for later equations.

    Args:
        source: origin of the equations, for comments in the code.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self.equations: list[Equation] = []

    def named(self, title: str, names: list[str], values: list[Any]) -> list[Any]:
        """A block of elements cancel_NAME; zeros and ones stay numbers."""
        kept = [k for k, value in enumerate(values) if value not in (0, 1)]
        symbols = [symbol(f"{PREFIX}_{names[k]}") for k in kept]
        if kept:
            column = Matrix([values[k] for k in kept])
            self.equations.append(Equation(title, Matrix(symbols), column, ("",) * len(kept), self._source))
        result = list(values)
        for k, s in zip(kept, symbols, strict=True):
            result[k] = s
        return result

    def accelerations(self, title: str, names: list[str], force: Any) -> list[Any]:
        """a of M a = force, n by 1."""
        symbols = [symbol(f"{PREFIX}_{name}") for name in names]
        if all(e == 0 for e in force):
            return [sympy.S.Zero] * len(names)
        units = ("",) * len(names)
        self.equations.append(Equation(title, Matrix(symbols), Matrix(force), units, self._source, form="mass_solve"))
        return symbols

    def solve(self, letter: str, matrix: Any, right: list[Any]) -> list[Any]:
        """y of G y = r for symmetric positive definite G: closed form up to two rows, LDL' with named entries above.

        Args:
            letter: prefix of the names.
            matrix: G, k by k; zeros cost nothing.
            right: r, k entries.
        """
        k = matrix.rows
        if k == 1:
            return [right[0] / matrix[0, 0]]
        if k == 2 and matrix[0, 1] != 0:
            a, b, c = matrix[0, 0], matrix[0, 1], matrix[1, 1]
            over = self.named(f"{PREFIX}_determinant", [f"{letter}_one_over_det"], [1 / (a * c - b * b)])[0]
            return [over * (c * right[0] - b * right[1]), over * (a * right[1] - b * right[0])]
        return self._factored(letter, matrix, right)

    def _factored(self, letter: str, matrix: Any, right: list[Any]) -> list[Any]:
        k = matrix.rows
        factor = sympy.eye(k)
        pivot: list[Any] = []
        for j in range(k):
            d = matrix[j, j] - sum(factor[j, p] ** 2 * pivot[p] for p in range(j))
            pivot += self.named(f"{PREFIX}_pivot", [f"{letter}_D{j + 1}"], [d])
            below = range(j + 1, k)
            entries = [
                (matrix[i, j] - sum(factor[i, p] * factor[j, p] * pivot[p] for p in range(j))) / pivot[j] for i in below
            ]
            names = [f"{letter}_L{i + 1}_{j + 1}" for i in below]
            for i, entry in zip(below, self.named(f"{PREFIX}_factors", names, entries), strict=True):
                factor[i, j] = entry
        y = list(right)
        for i in range(k):
            value = y[i] - sum(factor[i, p] * y[p] for p in range(i))
            y[i] = self.named(f"{PREFIX}_forward", [f"{letter}_y{i + 1}"], [value])[0]
        a = [y[i] / pivot[i] for i in range(k)]
        for i in reversed(range(k)):
            value = a[i] - sum(factor[p, i] * a[p] for p in range(i + 1, k))
            a[i] = self.named(f"{PREFIX}_backward", [f"{letter}_a{i + 1}"], [value])[0]
        return a
