"""A number of a spec with its unit, ``1 ms`` where 0.001 s would do, or as a share: 1%, 20 % or 0.2."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, Place
from codegen.base.user_text import shown
from codegen.spec.expression import exact_number, parse_expression, printed
from codegen.spec.units import describe, dimension, parse_unit, same_dimension, si_factor

_WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*|1/.*)")

Numbers = dict[str, Any]
LARGEST_SHARE = 10


def split_quantity(text: str) -> tuple[str, str] | None:
    """The number and the unit of ``1 ms``, or None for a text of another form."""
    try:
        float(text)
    except ValueError:
        found = _WITH_UNIT.fullmatch(text)
        return (found[1], found[2].strip()) if found else None
    return None


def with_any_unit(text: str, place: Place) -> tuple[sympy.Rational, str]:
    """An exact number in SI and the unit that it was written with, "" where it has none.

    For a place where the unit that it must have is known later only.

    Raises:
        BadInput: for text that is no number, or an unknown unit.
    """
    parts = split_quantity(text)
    if parts is None:
        return exact_number(text, place), ""
    number, unit = parts
    return printed(exact_number(number, place) * si_factor(unit, place), place, f"{text} in SI units"), unit


def read_numbers(given: Mapping[str, Any], key: str, place: Callable[[str], Place]) -> tuple[Numbers, dict[str, str]]:
    """Numbers in SI by name, and the unit of each that was written with one.

    For the parameters of a law, whose own units are known once the law is.

    Args:
        key: of their section.

    Raises:
        BadInput: as ``with_any_unit``; ``others`` holds the further faults.
    """
    values, units, faults = {}, {}, Faults()
    for name, value in given.items():
        where = place(f"{key}.{name}")
        with faults.noting():
            if isinstance(value, bool) or not isinstance(value, (str, int, float)):
                raise BadInput(where, f"`{value}`", "a number", code="SPEC006")
            values[name], units[name] = with_any_unit(str(value), where)
    faults.raise_noted()
    return values, {name: unit for name, unit in units.items() if unit}


def refuse_other_unit(given: str, unit: str, found: str, place: Place, nearest: str | None = None) -> None:
    """Raise BadInput where ``given``, if any, has another dimension than ``unit``.

    Args:
        found, nearest: for the message; what was given, and what may be meant.
    """
    if given and not same_dimension(given, unit, place):
        found = f"{found}, in {describe(dimension(parse_unit(given, place)))}"
        expected = f"a number in {unit}, or a number with another unit of the same quantity"
        raise BadInput(place, found, expected, nearest, code="SPEC014")


_INVERSE = {"s": ("ms", 1000), "1/s": ("Hz", 1)}
"""Unit whose inverse is as usual → the unit of the same quantity to write it in, and how many of these it has."""


def _inverted(number: str, given: str, unit: str, place: Place) -> str | None:
    """The period of a rate, or the rate of a period, where the other one is asked for: ``0.5 ms`` for ``2 kHz``."""
    if unit not in _INVERSE or not same_dimension(given, "1/s" if unit == "s" else "s", place):
        return None
    size, (name, each) = exact_number(number, place) * si_factor(given, place), _INVERSE[unit]
    return f"{float(each / size):.6g} {name}" if size > 0 else None


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
    refuse_other_unit(given, unit, f"`{text}`", place, _inverted(number, given, unit, place))
    return printed(exact_number(number, place) * si_factor(given, place), place, f"{text} in {unit}")


LARGEST_FACTOR = 1e30


def read_factor(value: object, place: Place) -> tuple[float, str]:
    """A factor other than zero, as ``scale:`` of a spec and of a log's description takes it, and its unit, "" for none.

    Args:
        value: a number, a number with its unit, which is brought to SI, or an expression of numbers: 1 ms, 2*pi/4096.

    Raises:
        BadInput: for what is none of these, zero, or beyond ``LARGEST_FACTOR`` or its inverse.
    """
    expected = "a number other than zero, one with its unit such as 1 ms, or an expression of numbers such as 2*pi/4096"
    factor, unit = 0.0, ""
    if isinstance(value, (str, int, float)) and not isinstance(value, bool):
        text = str(value)
        if split_quantity(text) is not None:
            exact, unit = with_any_unit(text, place)
            factor = float(exact)
        else:
            try:
                factor = float(parse_expression(text, place).symbolic({}))
            except (BadInput, OverflowError):
                raise BadInput(place, f"`{shown(text)}`", expected, code="SPEC006") from None
    if not 1 / LARGEST_FACTOR <= abs(factor) <= LARGEST_FACTOR:
        raise BadInput(place, f"`{shown(str(value))}`", expected, code="SPEC006")
    return factor, unit


def read_share(text: str, place: Place) -> float:
    """Read a relative tolerance.

    Raises:
        BadInput: for what is no number, is below zero or above 1000 %, or is a plain number from 1 on, which may be
            meant in percent.
    """
    number = _share(text, place)
    if 1 <= number <= 100 and not text.strip().endswith("%"):
        expected = f"`{text.strip()}%`, or `{100 * number:g}%` if that is meant"
        raise BadInput(place, f"tolerance {text}", expected, code="SPEC007")
    if not 0 <= number <= LARGEST_SHARE:
        raise BadInput(place, f"tolerance {text}", "a share such as 1% or 0.01, at most 1000%", code="SPEC007")
    return number


def read_part(text: str, place: Place) -> float:
    """Read a share of a whole.

    Raises:
        BadInput: for what is no number, or not above zero and below 100 %.
    """
    try:
        number = _share(text, place)
    except BadInput:
        number = 0.0
    if not 0 < number < 1:
        raise BadInput(place, f"`{text}`", "a share above 0 and below 100 %, such as 2% or 0.02", code="SPEC007")
    return number


def _share(text: str, place: Place) -> float:
    plain = text.strip()
    return float(exact_number(plain.removesuffix("%").strip(), place)) / (100 if plain.endswith("%") else 1)
