"""Matrices made from the entries that are not zero: the work grows with these, not with rows times columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
