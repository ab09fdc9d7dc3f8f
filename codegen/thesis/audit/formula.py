"""Evaluation of the thesis' formulas in SymPy, with names that may be matrices.

The parser of specs (``codegen.spec.expression``) parses the text and evaluates nothing; here its tree gets values. In
addition to the syntax of specs, products of matrices and symbols as exponents are allowed, and ``sgn`` and ``abs`` of a
vector are taken element by element, as in sgn(U'v).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import Algebra, Expression, evaluate_tree, parse_expression
from codegen.spec.functions import FUNCTIONS

Formula = str | int | Sequence["Formula"]
_RELATION = re.compile(r"(<=|>=|<|>)")


class Misfit(BadInput):
    """A formula that can be read, but whose matrices have shapes that cannot be added or multiplied."""


def evaluate(formula: Any, names: Mapping[str, Any], place: Place) -> Any:
    """The value of a formula; rows of formulas are blocks of one matrix.

    Args:
        formula: text, a list (a column) or a list of lists (rows).
        names: name → expression or matrix.

    Raises:
        BadInput: for text that is no expression, an unknown name, or matrices whose shapes do not match.
    """
    if isinstance(formula, list):
        rows = [row if isinstance(row, list) else [row] for row in formula]
        blocks = [[as_matrix(evaluate(cell, names, place)) for cell in row] for row in rows]
        try:
            return sympy.Matrix.vstack(*[sympy.Matrix.hstack(*row) for row in blocks])
        except sympy.matrices.exceptions.ShapeError as error:
            raise Misfit(place, f"blocks that do not fit ({error})", "blocks of one matrix") from None
    parsed = parse_expression(str(formula), place)
    try:
        return evaluate_tree(parsed.tree, parsed, Algebra(names, "a name of this derivation's", _call, _combine))
    except sympy.matrices.exceptions.ShapeError as error:
        raise Misfit(place, f"`{formula}`: {error}", "matrices of fitting shapes") from None


def inequalities(text: str, names: Mapping[str, Any], place: Place) -> list[tuple[Any, bool]]:
    """``a < b < c`` as [(b − a, strict), (c − b, strict)]: expressions that must be positive, or not negative."""
    parts = _RELATION.split(text)
    if len(parts) < 3:
        raise BadInput(place, f"`{text}`", "an inequality such as `k_v > 0`", code="SPEC010")
    sides = [evaluate(part, names, place) for part in parts[::2]]
    result = []
    for left, relation, right in zip(sides, parts[1::2], sides[1:], strict=False):
        result.append((right - left if "<" in relation else left - right, "=" not in relation))
    return result


def as_text(formula: Any) -> str:
    """A formula as one line; rows in brackets."""
    if isinstance(formula, list):
        return "[" + "; ".join(", ".join(map(str, r)) if isinstance(r, list) else str(r) for r in formula) + "]"
    return str(formula)


def as_matrix(value: Any) -> Any:
    """A scalar as a 1 by 1 matrix; a matrix unchanged."""
    return value if isinstance(value, sympy.MatrixBase) else sympy.Matrix([[value]])


def _call(name: str, value: Any, *_: object) -> Any:
    return value.applyfunc(FUNCTIONS[name]) if isinstance(value, sympy.MatrixBase) else FUNCTIONS[name](value)


def _combine(op: ast.operator, a: Any, b: Any, whole: Expression, _: ast.expr) -> Any:
    matrices = isinstance(a, sympy.MatrixBase), isinstance(b, sympy.MatrixBase)
    match op:
        case ast.Mult():
            return a * b
        case ast.Div() if not matrices[1]:
            return a / b
        case ast.Pow() if not any(matrices):
            return a**b
        case ast.Add() | ast.Sub() if matrices[0] == matrices[1]:
            return a + b if isinstance(op, ast.Add) else a - b
    raise Misfit(whole.place, f"`{whole.text}`", "sums of equal shapes, and no division by a matrix")
