"""Units through pint: values to SI, and the dimension of an expression.

A spec is computed in coherent SI units. A parameter may be given in any unit and is converted; coordinates and
inputs are declared in SI, since generated code takes and returns them as they are.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from functools import cache
from tokenize import TokenError
from typing import Any

import pint
import sympy

from codegen.errors import BadInput, Place, nearest_name
from codegen.spec.expression import Expression

Dimension = Any
"""pint's dimensionality mapping, such as {[length]: 1, [time]: -1}; hashable through its string."""


_MALFORMED = (
    pint.PintError,
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    SyntaxError,
    TypeError,
    ValueError,
    TokenError,
)  # what pint lets through on malformed text

_CALLED = (
    *("m", "kg", "s", "A", "V", "N", "N*m", "N/m", "N*s/m", "N*m*s", "kg*m^2", "m/s", "m/s^2", "1/s", "kg*m"),
    *("N/A", "N*m/A", "N/V", "N*m/V", "N*s^2/m^2", "N*m*s^2", "N/m^3", "ohm", "H", "K", "Pa", "W"),
)
_RUN_TOGETHER = {"Nm": "N*m", "Nms": "N*m*s", "Ns": "N*s", "Nmm": "N*mm", "kNm": "kN*m", "mNm": "mN*m", "Vs": "V*s"}
_RUN_TOGETHER |= {"kgm": "kg*m", "kgm2": "kg*m^2", "gcm2": "g*cm^2", "kgcm2": "kg*cm^2", "m2": "m^2", "s2": "s^2"}


@cache
def registry() -> pint.UnitRegistry[Any]:
    """The one unit registry of the process."""
    return pint.UnitRegistry(autoconvert_offset_to_baseunit=False)


@cache
def _parse(text: str) -> Any:
    if len(text) > 200 or not all(c.isalnum() or c in "*/^_ .()-" for c in text):
        raise ValueError(text)
    return registry().parse_units(text)


def parse_unit(text: str, place: Place) -> Any:
    """A pint unit from its text.

    Raises:
        BadInput: if pint does not know it or it has an offset (degC).
    """
    apart = re.sub(r"[A-Za-z]+\d*", lambda word: _RUN_TOGETHER.get(word[0], word[0]), str(text))
    if apart != text:  # pint takes Nm for a yarn's count, 1000 m/kg
        raise BadInput(place, f"unit `{text}`", "factors joined by *, such as N*m or kg*m^2", apart)
    try:
        unit = _parse(str(text))
        if registry().Quantity(0.0, unit).to_base_units().magnitude != 0:
            raise ValueError(text)  # an offset, as degC has
    except _MALFORMED:
        nearest = nearest_name(str(text), _CALLED)
        raise BadInput(place, f"unit `{text}`", "a unit such as N*m, kg*m^2 or 1", nearest) from None
    return unit


def dimension(unit: Any) -> Dimension:
    """The dimensionality of a pint unit."""
    return registry().Quantity(1, unit).dimensionality


def si_factor(text: str, place: Place) -> sympy.Rational:
    """By how much a value in this unit is multiplied to be in SI base units."""
    quantity = registry().Quantity(1.0, parse_unit(text, place)).to_base_units()
    return sympy.Rational(repr(float(quantity.magnitude)))


def require_coherent(text: str, place: Place) -> None:
    """Refuse a unit that is not a plain product of SI base units (mm, deg, rpm).

    Raises:
        BadInput: with the SI unit that is meant.
    """
    if si_factor(text, place) != 1:
        expected = f"{coherent_name(text, place)}, the SI unit; logs in other units are brought to it by their `scale:`"
        raise BadInput(place, f"unit {text}", expected)


def coherent_name(text: str, place: Place) -> str:
    """The SI unit that a value of this unit is converted to: the text itself where it is coherent already."""
    if si_factor(text, place) == 1:
        return text
    wanted = dimension(parse_unit(text, place))
    if wanted == _none():
        return "rad" if text.strip() in ("deg", "degree", "degrees", "rev", "turn", "arcmin", "arcsec") else "1"
    if wanted == _none() / dimension(parse_unit("s", place)):
        return "rad/s" if any(word in text for word in ("rpm", "deg", "rev", "turn")) else "1/s"
    return describe(wanted)


def _none() -> Dimension:
    return registry().dimensionless.dimensionality


def dimension_of(expression: Expression, dimensions: Mapping[str, Dimension]) -> Dimension | None:
    """The dimension of an expression, or None for a bare number, which may stand for any unit.

    Args:
        expression: the parsed text.
        dimensions: of every name in it.

    Raises:
        BadInput: where terms of different dimension are added, or a function's argument has a dimension.
    """
    if expression.tree is not None and not any(isinstance(n, ast.Name) for n in ast.walk(expression.tree)):
        return None
    return _walk(expression.tree, expression, dimensions)


def describe(d: Dimension | None) -> str:
    """A dimension in SI base units, for a message."""
    if d is None:
        return "a bare number"
    if d == _none():
        return "a pure number (1 or rad)"
    named = _known_units().get(str(d))
    if named:
        return named
    symbol = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[current]": "A", "[temperature]": "K"}
    parts = [symbol.get(k, k) + (f"^{float(p):g}" if p != 1 else "") for k, p in sorted(d.items(), key=str) if p]
    return "*".join(parts)


@cache
def _known_units() -> dict[str, str]:
    """Dimension → the unit by which engineers call it."""
    return {str(dimension(parse_unit(name, Place("")))): name for name in reversed(_CALLED)}


def _walk(node: ast.expr, whole: Expression, dims: Mapping[str, Dimension]) -> Dimension:
    match node:
        case ast.Constant():
            return _none()
        case ast.Name(id=name):
            return dims.get(name, _none())
        case ast.UnaryOp(operand=operand):
            return _walk(operand, whole, dims)
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            inner = _walk(argument, whole, dims)
            if name == "abs":
                return inner
            if name == "sqrt":
                return inner**0.5
            if name == "sgn":
                return _none()
            if inner != _none():
                found = f"{name} of `{whole.source(argument)}`, which is in {describe(inner)}"
                raise BadInput(whole.place, found, "an argument without a unit")
            return _none()
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            power = _number(right, whole)
            base = _walk(left, whole, dims)
            return base**power if power is not None else base
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _walk(left, whole, dims), _walk(right, whole, dims)
            if isinstance(op, ast.Mult):
                return a * b
            if isinstance(op, ast.Div):
                return a / b
            if a != b and not _is_zero(left, whole) and not _is_zero(right, whole):
                found = f"`{whole.source(left)}` in {describe(a)} with `{whole.source(right)}` in {describe(b)}"
                raise BadInput(
                    whole.place, found, "terms of the same unit in a sum; give a number its unit as a parameter"
                )
            return b if _is_zero(left, whole) else a
    return _none()


def _number(node: ast.expr, whole: Expression) -> float | None:
    """The value of a part made of numbers alone, such as -(1/2) or 1 + 1."""
    try:
        return float(Expression(whole.text, node, whole.place).symbolic({}))
    except BadInput:
        return None


def _is_zero(node: ast.expr, whole: Expression) -> bool:
    return _number(node, whole) == 0
