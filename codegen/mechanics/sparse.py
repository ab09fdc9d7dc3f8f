"""Sparse construction of SymPy matrices: the work grows with the nonzero entries, not with rows times columns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import sympy

from codegen.mechanics.system import Matrix


def diagonal(entries: Iterable[Any]) -> Matrix:
    """diag(entries)."""
    values = list(entries)
    return sparse(len(values), len(values), {(i, i): value for i, value in enumerate(values)})


def jacobian(
    expressions: Sequence[Any], variables: Sequence[sympy.Symbol], at: Mapping[sympy.Symbol, Any] | None = None
) -> Matrix:
    """The Jacobian ∂expressions/∂variables, expressions by variables.

    Args:
        at: variable → value at which it is evaluated; by default the Jacobian is a function of the variables.
    """
    column, gradients = {x: j for j, x in enumerate(variables)}, _Gradients(frozenset(variables), at or {})
    entries = {
        (i, column[x]): slope
        for i, expression in enumerate(expressions)
        for x, slope in gradients.of(sympy.sympify(expression)).items()
    }
    return sparse(len(expressions), len(variables), entries)


class _Gradients:
    """Gradients of expressions at a point, by the chain rule from the symbols up.

    Only the derivatives that are not zero are computed, and only the parts of an expression in which a variable occurs
    are visited; equal parts once. The values of the other factors are inserted first, which keeps products short.

    Args:
        variables: those with respect to which is differentiated.
        at: variable → its value at the point, if it has one.
    """

    def __init__(self, variables: frozenset[sympy.Symbol], at: Mapping[sympy.Symbol, Any]) -> None:
        self._variables, self._at = variables, at
        self._known: dict[Any, dict[sympy.Symbol, Any]] = {}

    def of(self, expression: Any) -> dict[sympy.Symbol, Any]:
        """Variable → ∂expression/∂variable at the point."""
        if expression not in self._known:
            self._known[expression] = self._computed(expression)
        return self._known[expression]

    def _value(self, expression: Any) -> Any:
        return expression.xreplace(self._at) if self._at else expression

    def _computed(self, expression: Any) -> dict[sympy.Symbol, Any]:
        if expression in self._variables:
            return {expression: sympy.S.One}
        if not expression.args or self._variables.isdisjoint(expression.free_symbols):
            return {}
        if expression.is_Add:
            return _total(self.of(term) for term in expression.args)
        if expression.is_Mul:
            factors = expression.args
            return _total(
                {
                    x: sympy.Mul(*(self._value(f) for f in (*factors[:k], *factors[k + 1 :])), slope)
                    for x, slope in found
                }
                for k, factor in enumerate(factors)
                if (found := self.of(factor).items())
            )
        if isinstance(expression, sympy.Function) and len(expression.args) == 1:
            outer = self._value(expression.fdiff(1))
            return {x: outer * slope for x, slope in self.of(expression.args[0]).items()} if outer != 0 else {}
        occurring = self._variables & expression.free_symbols
        return {x: self._value(sympy.diff(expression, x)) for x in occurring}


def _total(gradients: Iterable[dict[sympy.Symbol, Any]]) -> dict[sympy.Symbol, Any]:
    """The sum of gradients."""
    terms: dict[sympy.Symbol, list[Any]] = {}
    for gradient in gradients:
        for x, slope in gradient.items():
            terms.setdefault(x, []).append(slope)
    return {x: sympy.Add(*slopes) for x, slopes in terms.items()}


def sparse(rows: int, columns: int, entries: dict[tuple[int, int], Any]) -> Matrix:
    """The matrix with these entries and zeros elsewhere."""
    return Matrix(sympy.SparseMatrix(rows, columns, entries))


def each(matrix: Matrix, function: Callable[[Any], Any]) -> Matrix:
    """The matrix with ``function`` applied to each nonzero entry; the function of zero must be zero."""
    return sparse(matrix.rows, matrix.cols, {place: function(entry) for place, entry in matrix.todok().items()})


def scaled(rows: Sequence[Any], matrix: Matrix, columns: Sequence[Any]) -> Matrix:
    """diag(rows) · matrix · diag(columns)."""
    entries = matrix.todok().items()
    return sparse(matrix.rows, matrix.cols, {(i, j): rows[i] * entry * columns[j] for (i, j), entry in entries})
