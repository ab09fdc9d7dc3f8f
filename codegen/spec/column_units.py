"""Units in the names of a log's columns: ``x [mm]``, ``x (mm)``, ``x/mm``, ``x in mm``, ``x, mm`` or ``x_mm``."""

import re

from codegen.base.errors import BadInput, Place
from codegen.spec.model import Spec
from codegen.spec.units import base_units, has_two_meanings, is_unit, parse_unit, same_dimension, si_factor

LONGEST_UNIT = 24
"""Most letters of a unit."""
LONGEST_NAME = 1000
"""Most letters of a column's name in which a unit is sought, since the search takes their square."""
_IN_SQUARE = re.compile(r"(.*\S)\s*\[([^\[\]]*)\]\s*")
_IN_ROUND = re.compile(r"(.*\S)\s*\(([^()]*)\)\s*")
_BELOW_LINE = re.compile(r"(.+?)\s+/\s+(\S.*?)\s*|([^/\s]+)/(\S+)\s*")
"""A unit after a slash, which without blanks around it must be the only one, since paths have several."""
_BEHIND_WORD = re.compile(r"(.*\S)(?:\s+in|,)\s+(\S+)\s*")
"""``Drehmoment in Nm``, as DIN 461 labels axes, and ``Torque, Nm``."""
_BEFORE_LABEL = re.compile(r"([^()\[\]]*\S)\s+(?:\[([^()\[\]]*)\]|\(([^()\[\]]*)\))\s+(\S[^()\[\]]*)")
"""A unit before the label of a run or channel, ``Angle (deg) Run #1``."""
_BEHIND_NAME = re.compile(
    r"(.+)_(ms|us|ns|mm|cm|um|degrees?|deg|mrad|turns?|revs|rpm|rps|mA|mV|mN|kN|mNm|cNm|Ncm"
    r"|(?:degrees?|deg|mm|cm|um|turns?|revs?)(?:_per_|_)(?:s|sec|min))"
)
"""Unambiguous units at the end of a name, also of a speed: ``x_mm_s``, ``q_deg_per_s``."""
_MULTIPLE = re.compile(r"x?\s*(\d*\.?\d+(?:[eE][+-]?\d+)?)\s*([^\d\s.].*)")
"""A number with a unit, ``0.01 A``, which may be the size of a count or the range of a sensor."""
_IN_CAMEL_CASE = re.compile(r".*[a-z0-9_](Deg|Degrees|RPM|Rpm)")
"""Those that end a name such as ``motorRPM``."""
AMBIGUOUS = ("grad",)
"""Degrees in German, gons elsewhere, and with a capital G a billion radians."""
_WORDS = frozenset(
    ["act", "acc", "chain", "dot", "dt", "fb", "hand", "link", "mass", "mid", "pin", "point", "pole", "rod", "tau"]
)
"""Words for parts and signals of a machine that are also rare units: ``x (link)`` is not in links of a chain."""
ALSO_WORDS = frozenset(["dyn", "foot", "feet"])
"""Units that as words in brackets may be meant otherwise: a force may be the dynamic one, a position that of a foot."""
_LETTERS = "msghAVNKWJHT"
"""Single letters that are units of machines: ``q (a)`` is not in years."""
_WHOLE_NAME = re.compile(r"(mm|deg|rpm|RPM|mA|mV|kN|mNm)")
"""Those that are names of columns by themselves, as a logger prints ``rpm``."""
_TIME_IN = re.compile(r"(.+)_(s|sec|seconds|ms|msec|us|usec|ns)|(.+[a-z])(Ms|Us|Ns)")
_CLOCKS = {"millis": "ms", "micros": "us"}
"""Columns called after the function that reads a microcontroller's clock → the unit of its result."""


def stated_unit(name: str) -> tuple[str, str]:
    """A column's name without the unit in it, and that unit: ``x [mm]``, ``x (mm)``, ``x/mm``; empty for none.

    Text in square brackets at the end is always taken as a unit; other text only if it is a known unit, or in round
    brackets a number with one, which nothing converts: ``Current (0.01 A)`` is to be asked about. A single letter
    before a label without a number, ``Motor (A) left``, may name a part of the machine, and is no unit.
    """
    if len(name) > LONGEST_NAME:
        return name, ""
    square = _IN_SQUARE.fullmatch(name)
    if square is not None:
        return square[1], in_usual_case(square[2].strip())
    for form in (_BELOW_LINE, _IN_ROUND, _BEHIND_WORD):
        found = form.fullmatch(name)
        bare, unit = (text.strip() for text in found.groups() if text) if found else ("", "")
        if bare and may_be_unit(unit := in_usual_case(unit)):
            return bare, unit
    multiple = _IN_ROUND.fullmatch(name)
    if multiple is not None and (parts := _MULTIPLE.fullmatch(multiple[2].strip())) and may_be_unit(parts[2]):
        return multiple[1], multiple[2].strip()
    found = _BEFORE_LABEL.fullmatch(name)
    if found is not None:
        unit, label = in_usual_case((found[2] or found[3] or "").strip()), found[4].strip()
        if may_be_unit(unit) and (not unit.isalpha() or len(unit) > 1 or re.search(r"\d", label)):
            return f"{found[1]} {label}", unit
    return name, ""


def may_be_unit(text: str) -> bool:
    """Whether a text is a unit, per cent, or a unit that is refused since it has several meanings, ``1/min``."""
    if text.lower() in ("%", *AMBIGUOUS):
        return True
    name = text.lower() in _WORDS or (text.isalpha() and len(text) == 1 and text not in _LETTERS)
    return not name and (is_unit(text) or has_two_meanings(text))


def in_usual_case(unit: str) -> str:
    """A unit whose letters are those of a title, ``Degrees`` or ``DEG``, in lower case; other texts unchanged."""
    word = unit.lower()
    unread = 2 < len(word) <= LONGEST_UNIT and not is_unit(unit) and not has_two_meanings(unit)
    return word if unread and is_unit(word) else unit


def meant_unit(unit: str, own: str) -> str:
    """The unit in ``own``'s dimension that one of several meanings probably means, ``1/min`` rpm; empty for none."""
    if not has_two_meanings(unit):
        return ""
    try:
        parse_unit(unit, Place(""))
    except BadInput as error:
        return error.nearest if error.nearest and is_convertible(error.nearest, own) else ""
    return ""


def unit_behind(symbol: str, name: str) -> str:
    """The unit at the end of a column's name, such as ``t_ms`` or ``x_mm``, or that is its name; empty for none."""
    bare = stated_unit(name)[0]
    if symbol == "t" and bare in _CLOCKS:
        return _CLOCKS[bare]
    if symbol != "t" and _WHOLE_NAME.fullmatch(bare):
        return bare
    if symbol == "t":
        found = _TIME_IN.fullmatch(bare.replace(" ", "_"))
        return (found[2] or found[4].lower()) if found else ""
    found = _BEHIND_NAME.fullmatch(bare.replace(" ", "_"))
    camel = None if found else _IN_CAMEL_CASE.fullmatch(bare)
    return re.sub("_per_|_", "/", found[2]) if found else camel[1].lower() if camel else ""


def size_of_count(unit: str, own: str) -> str:
    """A number with a unit of ``own``'s dimension, ``0.01 A``, as ``scale:`` takes it; empty for another text."""
    parts = _MULTIPLE.fullmatch(unit)
    return f"{parts[1]} {parts[2]}" if parts and is_convertible(parts[2], own) else ""


def factor_in_name(symbol: str, name: str, spec: Spec) -> float:
    """The factor from a column of this name to SI, by the unit that the name states; 1 for none."""
    unit, own = stated_unit(name)[1] or unit_behind(symbol, name), spec.units[symbol]
    stated = unit not in ("", "-", "1", own) and is_convertible(unit, own)
    return float(si_factor(unit, Place(""))) if stated else 1.0


def is_convertible(unit: str, own: str) -> bool:
    """Whether values in ``unit`` can be converted to ``own``; counts are no angle, and hertz no angular speed."""
    place = Place("")
    if unit.lower() in AMBIGUOUS or not is_unit(unit) or not same_dimension(unit, own, place):
        return False
    return "rad" not in own or unit in ("1/s", "s^-1") or base_units(unit, place) == base_units(own, place)
