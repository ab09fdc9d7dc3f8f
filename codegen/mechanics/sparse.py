"""Sparse construction of SymPy matrices: the work grows with the nonzero entries, not with rows times columns."""

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
    """The Jacobian J_ij = ∂expression_i/∂variable_j; with ``at`` (variable → value) evaluated there."""
    column, gradients = {x: j for j, x in enumerate(variables)}, _Gradients(frozenset(variables), at or {})
    entries = {
        (i, column[x]): slope
        for i, expression in enumerate(expressions)
        for x, slope in gradients.of(sympy.sympify(expression)).items()
    }
    return sparse(len(expressions), len(variables), entries)


class _Gradients:
    """Gradients of expressions at a point, by the chain rule.

    Subexpressions in which no variable occurs are not visited, and equal subexpressions are differentiated once. In the
    product rule, the point is inserted into the factors that are not differentiated, which keeps the products short.
    """

    def __init__(self, variables: frozenset[sympy.Symbol], at: Mapping[sympy.Symbol, Any]) -> None:
        self._variables, self._at = variables, at
        self._known: dict[Any, dict[sympy.Symbol, Any]] = {}

    def of(self, expression: Any) -> dict[sympy.Symbol, Any]:
        """Variable → ∂expression/∂variable at the point; derivatives that are zero are left out."""
        if expression not in self._known:
            self._known[expression] = self._computed(expression)
        return self._known[expression]

    def _value(self, expression: Any) -> Any:
        """The expression at the point."""
        return expression.xreplace(self._at) if self._at else expression

    def _computed(self, expression: Any) -> dict[sympy.Symbol, Any]:
        if expression in self._variables:
            return {expression: sympy.S.One}
        if not expression.args or self._variables.isdisjoint(expression.free_symbols):
            return {}
        if expression.is_Add:
            return _total(self.of(term) for term in expression.args)
        if expression.is_Mul:
            return _total(self._of_factor(expression.args, k) for k in range(len(expression.args)))
        if isinstance(expression, sympy.Function) and len(expression.args) == 1:
            outer = self._value(expression.fdiff(1))
            return {x: outer * slope for x, slope in self.of(expression.args[0]).items()} if outer != 0 else {}
        occurring = self._variables & expression.free_symbols
        return {x: self._value(sympy.diff(expression, x)) for x in occurring}

    def _of_factor(self, factors: Sequence[Any], k: int) -> dict[sympy.Symbol, Any]:
        """The term of the product rule in which factor k is differentiated."""
        slopes = self.of(factors[k])
        if not slopes:
            return {}
        others = [self._value(factor) for factor in (*factors[:k], *factors[k + 1 :])]
        return {x: sympy.Mul(*others, slope) for x, slope in slopes.items()}


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
