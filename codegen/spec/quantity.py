"""A number of a spec with its unit: ``1 ms`` where 0.001 s would do."""

from __future__ import annotations

import re

import sympy

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import exact_number
from codegen.spec.printed import printed
from codegen.spec.units import describe, dimension, parse_unit, si_factor

_WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*|1/.*)")


def split_quantity(text: str) -> tuple[str, str] | None:
    """The number and the unit of ``1 ms``, or None for a text of another form."""
    try:
        float(text)
    except ValueError:
        found = _WITH_UNIT.fullmatch(text)
        return (found[1], found[2].strip()) if found else None
    return None


def read_quantity(text: str, unit: str, place: Place) -> sympy.Rational:
    """An exact number in a unit of SI.

    Args:
        text: a number, which is in ``unit``, or a number with any unit of the same dimension.
        unit: a product of SI base units, such as s or m/s.

    Raises:
        BadInput: for text that is neither, or a unit of another dimension.
    """
    parts = split_quantity(text)
    if parts is None:
        return exact_number(text, place)
    number, given = parts
    found, wanted = dimension(parse_unit(given, place)), dimension(parse_unit(unit, place))
    if found != wanted:
        raise BadInput(
            place,
            f"`{text}`, in {describe(found)}",
            f"a number in {unit}, or one with another unit of it",
            code="SPEC014",
        )
    return printed(exact_number(number, place) * si_factor(given, place), place, f"{text} in {unit}")
