"""Reading of numbers with a unit, such as ``1 ms``, and of shares: 1%, 20 % or 0.2; BadInput for other text."""

import re
from collections.abc import Mapping
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, Place, PlaceOf
from codegen.base.user_text import brief
from codegen.spec.expression import exact_number, parse_expression, printed
from codegen.spec.units import describe, dimension, parse_unit, same_dimension, si_factor

_WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![dD][-+]?\d+\s*$)([^\W\d_].*|1/.*)")
"""A number and a unit; ``d-6`` is none, but the exponent of a Fortran program."""

Numbers = dict[str, Any]
RATE = re.compile(r"\w*Hz|1/[munµ]?s|[munµ]?s(\^|\*\*)-1")
"""Units of a rate of samples; rpm and rad/s, of the same dimension, are none."""
LARGEST_SHARE = 10
"""Largest tolerance relative to its value."""


def split_quantity(text: str) -> tuple[str, str] | None:
    """(number, unit) of a text such as ``1 ms``; None for a text of another form."""
    try:
        float(text)
    except ValueError:
        found = _WITH_UNIT.fullmatch(text)
        return (found[1], found[2].strip()) if found else None
    return None


def with_any_unit(text: str, place: Place) -> tuple[sympy.Rational, str]:
    """An exact number in SI and the unit with which it is written, "" for none.

    For a quantity whose required unit is not known yet.
    """
    parts = split_quantity(text)
    if parts is None:
        return exact_number(text, place), ""
    number, unit = parts
    return printed(exact_number(number, place) * si_factor(unit, place), place, f"{text} in SI units"), unit


def read_numbers(given: Mapping[str, Any], key: str, place: PlaceOf) -> tuple[Numbers, dict[str, str]]:
    """Name → number in SI, and name → unit with which it is written, if any.

    For the parameters of a law, whose units are known only with the law. ``key``: of their section.
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


def refuse_other_unit(given: str, unit: str, found: str, place: Place) -> None:
    """Raise BadInput if ``given`` is a unit of another dimension than ``unit``.

    ``found``: what is in the spec, for the message.
    """
    if given and not same_dimension(given, unit, place):
        found = f"{found}, in {describe(dimension(parse_unit(given, place)))}"
        expected = f"a number in {unit}, or a number with another unit of the same quantity"
        raise BadInput(place, found, expected, code="SPEC014")


def read_quantity(text: str, unit: str, place: Place) -> sympy.Rational:
    """An exact number in a unit of SI.

    Args:
        text: a number, which is in ``unit``, or a number with any unit of the same dimension.
        unit: a product of SI base units, such as s or m/s.
    """
    parts = split_quantity(text)
    if parts is None:
        return exact_number(text, place)
    number, given = parts
    try:
        refuse_other_unit(given, unit, f"`{text}`", place)
    except BadInput as fault:
        rate = exact_number(number, place) if unit == "s" and RATE.fullmatch(given) else 0
        if rate <= 0:
            raise
        period = f"{float(1000 / (rate * si_factor(given, place))):.6g} ms"  # of a sample time, its rate
        raise BadInput(place, fault.found, fault.expected, period, code=fault.code) from None
    return printed(exact_number(number, place) * si_factor(given, place), place, f"{text} in {unit}")


LARGEST_FACTOR = 1e30
"""Largest magnitude of a scale; the smallest is its inverse."""


def read_factor(value: object, place: Place) -> tuple[float, str]:
    """A nonzero factor of ``scale:`` in a spec or the description of a log, and its unit, "" for none.

    ``value``: a number, a number with a unit, which is converted to SI, or an expression of numbers: 1 ms, 2*pi/4096.
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
                raise BadInput(place, f"`{brief(text)}`", expected, code="SPEC006") from None
    if not 1 / LARGEST_FACTOR <= abs(factor) <= LARGEST_FACTOR:
        raise BadInput(place, f"`{brief(str(value))}`", expected, code="SPEC006")
    return factor, unit


def read_share(text: str, place: Place) -> float:
    """A relative tolerance.

    Raises BadInput for a text that is no number, a number below zero or above 1000 %, or one from 1 to 100 without a
    per cent sign, which may be meant in percent.
    """
    if split_quantity(text) is not None:
        expected = "a share such as 1% or 0.01, without a unit, since it holds for several values"
        raise BadInput(place, f"tolerance {brief(text)}", expected, code="SPEC007")
    number = _share(text, place)
    if 1 <= number <= 100 and not text.strip().endswith("%"):
        expected = f"`{text.strip()}%`, or `{100 * number:g}%` if that is meant"
        raise BadInput(place, f"tolerance {text}", expected, code="SPEC007")
    if not 0 <= number <= LARGEST_SHARE:
        raise BadInput(place, f"tolerance {text}", "a share such as 1% or 0.01, at most 1000%", code="SPEC007")
    return number


def read_deviation(text: str, unit: str, place: Place) -> float | None:
    """A tolerance with a unit, such as 0.2 deg, in SI; None for a text without a unit, which is a share.

    ``unit``: of the value that it is of.
    """
    if split_quantity(text) is None:
        return None
    deviation, given = with_any_unit(text, place)
    refuse_other_unit(given, unit, f"tolerance {brief(text)}", place)
    if deviation < 0:
        raise BadInput(place, f"tolerance {brief(text)}", f"a tolerance of at least 0 {given}", code="SPEC007")
    return float(deviation)


def read_part(text: str, place: Place) -> float:
    """A share of a whole."""
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
