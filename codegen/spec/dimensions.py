"""Dimension of an expression, from those of its names; terms of different dimensions are refused."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import Any

from codegen.base.errors import BadInput
from codegen.spec.expression import Algebra, Expression, combine_numbers, evaluate_tree
from codegen.spec.functions import FUNCTIONS
from codegen.spec.si_units import NONE, Dimension
from codegen.spec.units import describe


def dimension_of(expression: Expression, dimensions: Mapping[str, Dimension]) -> Dimension | None:
    """The dimension of an expression; None for a bare number, which may have any unit.

    ``dimensions``: of every name in it. Raises BadInput if terms of different dimensions are added, or a function's
    argument has a dimension.
    """
    algebra = Algebra(dimensions, "a declared name", _of_function, partial(_combined, dimensions))
    found = evaluate_tree(expression.tree, expression, algebra)
    return found if isinstance(found, Dimension) else None


def _of_function(name: str, argument: Any, whole: Expression, node: ast.Call) -> Any:
    """The dimension of the value of the function ``name``, or its value if the argument is a number."""
    if not isinstance(argument, Dimension):
        return FUNCTIONS[name](argument)
    if name == "abs":
        return argument
    if name == "sqrt":
        return argument ** Fraction(1, 2)
    if name != "sgn" and argument != NONE:
        found = f"{name} of `{whole.source(node.args[0])}`, which is in {describe(argument)}"
        raise BadInput(whole.place, found, "an argument without a unit", code="SPEC014")
    return NONE


def _combined(
    dims: Mapping[str, Dimension], op: ast.operator, a: Any, b: Any, whole: Expression, node: ast.BinOp
) -> Any:
    """The dimension of a binary operation of two quantities, or a quantity and a number; a number of two numbers."""
    if not isinstance(a, Dimension) and not isinstance(b, Dimension):
        return combine_numbers(op, a, b, whole, node)
    one, other = (side if isinstance(side, Dimension) else NONE for side in (a, b))
    if isinstance(op, ast.Pow):
        if isinstance(b, Dimension):
            return one
        # An irrational power, such as a root, is rounded to a double.
        return one ** (Fraction(int(b.p), int(b.q)) if b.is_Rational else Fraction(float(b)))
    if isinstance(op, ast.Mult | ast.Div):
        return one * other if isinstance(op, ast.Mult) else one / other
    if a == 0 or b == 0:
        return other if a == 0 else one
    if one != other:
        found = f"`{whole.source(node.left)}` in {describe(one)} with `{whole.source(node.right)}` in {describe(other)}"
        known = {name: dims.get(name, NONE) for name in _factors(node)}
        units = [f"{name} without unit" if d == NONE else f"{name} in {describe(d)}" for name, d in known.items()]
        stated = f" (declared, in SI: {', '.join(units)})" if units else ""
        expected = f"terms of the same unit in a sum{stated}; give a number its unit as a parameter"
        raise BadInput(whole.place, found, expected, code="SPEC014")
    return one


def _factors(node: ast.expr) -> list[str]:
    """Names in an expression in order of first use, each once, without those in arguments of functions."""
    match node:
        case ast.Name(id=name):
            return [name]
        case ast.UnaryOp(operand=operand):
            return _factors(operand)
        case ast.BinOp(left=left, right=right):
            return list(dict.fromkeys([*_factors(left), *_factors(right)]))
    return []
