"""Units: reading of a unit's text, its factor to SI and its dimension. pint reads units unknown to ``si_units``.

All computations are in coherent SI units. A parameter may have any unit and is converted; coordinates and inputs are
declared in SI, since generated code does not convert them. Functions of a unit's text raise BadInput as ``parse_unit``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

import sympy

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.spec.si_units import NONE, Dimension, SiUnit, si_unit
from codegen.spec.unit_text import Unreadable, spelled, with_plain_signs

if TYPE_CHECKING:
    import pint

_PRINTABLE = re.compile(r"(?!.*(/\*|\*/|//))[A-Za-z0-9µμΩ\u2126Å\u212bℓΔ⁰¹²³⁴-⁹*/^_ .()-]*")
"""Characters of a unit, which generated files print in comments."""
_USUAL = (
    *("m", "kg", "s", "A", "V", "N", "N*m", "N/m", "N*s/m", "N*m*s", "kg*m^2", "m/s", "m/s^2", "1/s", "kg*m", "N/A"),
    *("N*m/A", "N/V", "N*m/V", "N*s^2/m^2", "N*m*s^2", "N/m^3", "ohm", "H", "K", "Pa", "W"),
)
"""The usual units: messages suggest them, and call a dimension by the first that has it."""
_SYMBOLS = (
    *("m", "mm", "cm", "um", "km", "inch", "ft", "rad", "mrad", "deg", "rev", "rpm", "s", "ms", "us", "min", "hour"),
    *("Hz", "kHz", "g", "kg", "N", "mN", "kN", "lbf", "J", "W", "kW", "A", "mA", "V", "mV", "ohm", "H", "mH", "K"),
    *("Pa", "kPa", "MPa", "bar", "newton", "meter", "second", "kilogram", "radian", "degree", "amp", "volt"),
    *("watt", "hertz"),
)
"""Symbols that a misspelt factor of a unit is compared with, for the suggestion in the message."""
_DEFINED = (
    *("@alias turn = rev", "@alias revolutions_per_minute = RPM", "@alias pound = lbm", "@alias kilogram_force = kp"),
    *("@alias force_pound = lb_f", "@alias force_ounce = oz_f"),
)
"""Further names of units, in pint's notation."""
_NO_FORCE = r"(?!\s*(?:\^|\*\*|/\s*\(?s\b))"
"""Neither an inertia (kg*cm^2) nor a force (kg*cm/s^2) may follow."""
_TWO_MEANINGS = (
    (r"\bmil\b", "a length or an angle", "thou"),
    (r"\b[Gg]rad\b", "a degree, a gon or a billion radians", "deg"),
    (r"\bMrad\b", "a million radians or a thousandth of one", "mrad"),
    (r"\bU\b", "a revolution or an enzyme's unit", "rev"),
    (r"\bPS\b", "a horsepower or petasiemens", "metric_horsepower"),
    (r"\bton\b", "one of three masses", "tonne"),
    (r"^\(?1/\(?min\)?\)?$|^min\s*\^\s*\(?-1\)?$", "revolutions or radians in a minute", "rpm"),
    (r"/\s*(\(\s*1\s*/\s*min\s*\)|\(?\s*min\s*\^\s*\(?-1\)?\)?)", "revolutions or radians in a minute", "/rpm"),
    (r"\boz\*in\b(?!\s*\^)|\bin\*oz\b", "a torque or a mass times a length", "ozf*in"),
    (r"\blb\*in\b(?!\s*\^)|\bin\*lb\b", "a torque or a mass times a length", "lbf*in"),
    (r"\b(lb\*ft|ft\*lb)\b(?!\s*\^)", "a torque or a mass times a length", "lbf*ft"),
    (r"\bft\*oz\b(?!\s*\^)", "a torque or a mass times a length", "ozf*ft"),
    (rf"\bkg\*cm\b{_NO_FORCE}|\bcm\*kg\b", "a torque or a mass times a length", "kgf*cm"),
    (rf"\bg\*cm\b{_NO_FORCE}|\bcm\*g\b", "a torque or a mass times a length", "gf*cm"),
    (rf"\bkg-m\b{_NO_FORCE}|\bm-kg\b", "a torque or a mass times a length", "kgf*m"),
)
"""Units that data sheets use in another sense than pint: pattern, the two meanings, a name that has only one.

Hyphens have become * before, except in kg-m: data sheets write a torque so, and formulas a first moment kg*m.
"""
_HIGHEST_POWER = 20
"""Highest power of a unit."""


@cache
def registry() -> pint.UnitRegistry[Any]:
    """The unit registry of pint, whose factors are exact fractions, with pi to fifty digits."""
    import pint  # imported here, since it takes most of a second and few specs need it

    made: pint.UnitRegistry[Any] = pint.UnitRegistry(non_int_type=Fraction, autoconvert_offset_to_baseunit=False)
    for definition in _DEFINED:
        made.define(definition)
    return made


def is_printable(text: str) -> bool:
    """Whether a unit consists of characters that generated files can print in a comment; it may still be unknown."""
    return len(text) <= 200 and _PRINTABLE.fullmatch(text) is not None


@cache
def _parse(text: str) -> Any:
    """A pint unit from a text in the normalised form of ``spelled``.

    Raises:
        ValueError: for an unknown name, a high power, or an offset, as degC has.
    """
    from tokenize import TokenError

    from pint import PintError

    malformed = (ArithmeticError, AssertionError, AttributeError, LookupError, SyntaxError, TypeError, TokenError)
    try:
        unit = registry().parse_units(text)
        high = any(abs(power) > _HIGHEST_POWER for _, power in registry().Quantity(1, unit).unit_items())
        if high or registry().Quantity(0, unit).to_base_units().magnitude != 0:
            raise ValueError(text)
    except (PintError, *malformed) as error:  # exceptions that pint lets through for malformed text
        raise ValueError(text) from error
    return unit


def parse_unit(text: str, place: Place) -> SiUnit | Any:
    """A unit from its text: an SiUnit, or pint's.

    Raises BadInput for a text that is no unit, an ambiguous unit, or one with an offset (degC).
    """
    try:
        return _unit(str(text))
    except BadInput as error:
        raise error.at(place) from None


@lru_cache(maxsize=1024)
def _unit(text: str) -> SiUnit | Any:
    """As ``parse_unit``, without a place; cached, since a spec uses few units, each many times."""

    def refused(found: str, expected: str, nearest: str | None) -> BadInput:
        return BadInput("", f"unit `{text}`{found}", expected, nearest, code="SPEC013")

    try:
        plain = spelled(text)
    except Unreadable as error:
        raise refused("", error.expected, error.meant or nearest_name(text, _USUAL)) from None
    signs = with_plain_signs(text)
    for pattern, meanings, unambiguous in _TWO_MEANINGS:
        if re.search(pattern, plain) or re.search(pattern, signs):
            inertia = inertia_for(unambiguous)
            torque_or_inertia = f": {unambiguous} for a torque, {inertia} for an inertia" if inertia else ""
            corrected = re.sub(pattern, unambiguous, plain if re.search(pattern, plain) else signs)
            proposed = corrected if _is_unit(corrected) else unambiguous
            raise refused(f", {meanings}", f"an unambiguous unit{torque_or_inertia}", proposed)
    try:
        return si_unit(plain) or _parse(plain)
    except ValueError:
        nearest = _nearest_unit(plain) or nearest_name(text, _USUAL)
        raise refused("", "a unit such as N*m, kg*m^2 or 1", nearest) from None


def _nearest_unit(plain: str) -> str | None:
    """The unit with each unknown factor replaced by the symbol most like it: ``N/mm`` for ``N/mmm``; None if none is.

    ``plain``: in the normalised form of ``spelled``.
    """

    def corrected(factor: re.Match[str]) -> str:
        return factor[0] if _is_unit(factor[0]) else nearest_name(factor[0], _SYMBOLS) or factor[0]

    meant = re.sub(r"[A-Za-z_]\w*", corrected, plain)
    return meant if meant != plain and _is_unit(meant) else None


def _is_unit(plain: str) -> bool:
    """Whether a text in the normalised form of ``spelled`` is a unit."""
    try:
        return si_unit(plain) is not None or _parse(plain) is not None
    except ValueError:
        return False


def inertia_for(torque: str | None) -> str | None:
    """The unit of inertia that resembles a unit of torque: ``kg*cm^2`` for ``kgf*cm``; None for other units."""
    found = re.fullmatch(r"(kg|g|oz|lb)f\*(\w+)", torque or "")
    return f"{found[1]}*{found[2]}^2" if found else None


def unit_name(text: str, place: Place) -> str:
    """The unit in normalised form, as generated code prints it: ``kg*m^2`` for ``kg·m²``."""
    parse_unit(text, place)
    return spelled(str(text))


def dimension(unit: Any) -> Dimension:
    """The dimension of a unit that ``parse_unit`` gave."""
    if isinstance(unit, SiUnit):
        return unit.dimension
    return Dimension({name: Fraction(power) for name, power in registry().Quantity(1, unit).dimensionality.items()})


def same_dimension(one: str, other: str, place: Place) -> bool:
    """Whether two units are of one dimension."""
    return dimension(parse_unit(one, place)) == dimension(parse_unit(other, place))


@lru_cache(maxsize=1 << 15)
def is_unit(text: str) -> bool:
    """Whether a text is a unit that can be read; cached, since every word in a log's column names is asked."""
    try:
        return _is_unit(spelled(text)) and not has_two_meanings(text)
    except Unreadable:
        return False


def is_rare_word(text: str) -> bool:
    """Whether a text, if a unit, is a single word and a rare one: cal, or das, which pint reads as decaattosecond."""
    return text.isalpha() and text not in _USUAL and text not in _SYMBOLS


def has_two_meanings(text: str) -> bool:
    """Whether a text is refused as a unit since data sheets use it in two senses."""
    signs = with_plain_signs(text)
    try:
        plain = spelled(text)
    except Unreadable:
        return False
    return any(re.search(pattern, plain) or re.search(pattern, signs) for pattern, _, _ in _TWO_MEANINGS)


def si_factor(text: str, place: Place) -> sympy.Rational:
    """The factor from this unit to SI base units.

    Exact, or for a unit with pi or a root (deg, rpm, cm^0.5) a fraction that agrees to about fifty digits.
    """
    unit = parse_unit(text, place)
    if isinstance(unit, SiUnit):
        return sympy.Rational(unit.factor.numerator, unit.factor.denominator)
    factor = sympy.S.One
    for name, power in registry().Quantity(1, unit).unit_items():
        one = registry().Quantity(1, name).to_base_units().magnitude
        factor *= sympy.Rational(one) ** sympy.Rational(power)  # pint takes roots in floating point
    return factor if factor.is_Rational else sympy.Rational(str(factor.evalf(50)))


def require_coherent(text: str, place: Place, remedy: str) -> None:
    """Raise BadInput, with the SI unit to use, for a unit that is not a product of SI base units (mm, deg, rpm).

    ``remedy``: where other units are allowed, for the message.
    """
    if si_factor(text, place) != 1:
        expected = f"{coherent_name(text, place)}, the SI unit; {remedy}"
        raise BadInput(place, f"unit {text}", expected, code="SPEC014")


def coherent_name(text: str, place: Place) -> str:
    """The coherent SI unit of the same dimension, with the radian where the unit has an angle (``m/rad`` for mm/rev).

    It is the unit itself if that is coherent.
    """
    if si_factor(text, place) == 1:
        return unit_name(text, place)
    unit = parse_unit(text, place)
    wanted = dimension(unit)
    name = "1" if wanted == NONE else describe(wanted)
    turns = base_units(text, place).get("radian", 0) if "rad" in text or not isinstance(unit, SiUnit) else 0
    if turns and name == "N*m/A":
        name = "V*s"  # a back-EMF constant, in V*s/rad
    if turns == 1:
        return "rad" + name[1:] if name.split("/")[0] == "1" else f"rad*{name}"
    return name + {0: "", -1: "/rad"}.get(turns, f"*rad^{turns}")


def base_units(text: str, place: Place) -> Mapping[str, Any]:
    """Base unit, by pint's name → exponent, including the radian, which has no dimension."""
    parse_unit(text, place)
    return dict(registry().Quantity(1, _parse(spelled(text))).to_base_units().unit_items())


def describe(d: Dimension | None) -> str:
    """A dimension in SI base units, for a message."""
    if d is None:
        return "a bare number"
    if d == NONE:
        return "a pure number (1 or rad)"
    named = _known_units().get(d)
    if named:
        return named
    symbol = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[current]": "A", "[temperature]": "K"}
    parts = [symbol.get(k, k) + (f"^{float(p):g}" if p != 1 else "") for k, p in sorted(d.powers, key=str)]
    return "*".join(parts)


@cache
def _known_units() -> dict[Dimension, str]:
    """Dimension → its usual unit, the first of ``_USUAL``."""
    return {dimension(parse_unit(name, Place(""))): name for name in reversed(_USUAL)}
