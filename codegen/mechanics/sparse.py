"""Matrices made from the entries that are not zero: the work grows with these, not with rows times columns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import sympy

from codegen.mechanics.system import Matrix


def diagonal(entries: Iterable[Any]) -> Matrix:
    """diag(entries)."""
    values = list(entries)
    return sparse(len(values), len(values), {(i, i): value for i, value in enumerate(values)})


def jacobian(expressions: Sequence[Any], variables: Sequence[sympy.Symbol]) -> Matrix:
    """∂expressions/∂variables, expressions by variables."""
    column = {x: j for j, x in enumerate(variables)}
    entries = {
        (i, column[x]): sympy.diff(e, x)
        for i, e in enumerate(expressions)
        for x in sympy.sympify(e).free_symbols
        if x in column
    }
    return sparse(len(expressions), len(variables), entries)


def sparse(rows: int, columns: int, entries: dict[tuple[int, int], Any]) -> Matrix:
    """The matrix with these entries and zeros elsewhere."""
    return Matrix(sympy.SparseMatrix(rows, columns, entries))


def each(matrix: Matrix, function: Callable[[Any], Any]) -> Matrix:
    """The function of every entry that is not zero; of zero it must be zero."""
    return sparse(matrix.rows, matrix.cols, {place: function(entry) for place, entry in matrix.todok().items()})


def scaled(rows: Sequence[Any], matrix: Matrix, columns: Sequence[Any]) -> Matrix:
    """diag(rows) · matrix · diag(columns)."""
    entries = matrix.todok().items()
    return sparse(matrix.rows, matrix.cols, {(i, j): rows[i] * entry * columns[j] for (i, j), entry in entries})
