"""The unit that the name of a log's column states: ``x [mm]``, ``x (mm)``, ``x / mm``, ``x_mm``."""

from __future__ import annotations

import re

from codegen.base.errors import Place
from codegen.spec.model import Spec
from codegen.spec.units import base_units, is_unit, same_dimension, si_factor

_IN_SQUARE = re.compile(r"(.*\S)\s*\[([^\[\]]*)\]\s*")
_IN_ROUND = re.compile(r"(.*\S)\s*\(([^()]*)\)\s*")
_BELOW_LINE = re.compile(r"(.+?)\s+/\s+(\S.*?)\s*")
_BEHIND_NAME = re.compile(r"(.+)_(ms|us|ns|mm|um|deg|rpm|mA|mV|kN|mNm)")
"""Units that the end of a name can mean and that are nothing else."""
AMBIGUOUS = ("grad",)
"""Degrees in German, gons elsewhere, and with a capital G a billion radians."""
_TIME_IN = re.compile(r"(.+)_(s|sec|seconds|ms|msec|us|usec|ns)")


def stated_unit(name: str) -> tuple[str, str]:
    """A column's name without the unit in it, and that unit: ``x [mm]``, ``x (mm)``, ``x / mm``; empty for none.

    Text in square brackets is always taken as a unit; text after the other signs only if it is a known unit.
    """
    square = _IN_SQUARE.fullmatch(name)
    if square is not None:
        return square[1], square[2].strip()
    found = _IN_ROUND.fullmatch(name) or _BELOW_LINE.fullmatch(name)
    if found is not None and is_unit(found[2].strip()):
        return found[1], found[2].strip()
    return name, ""


def unit_behind(symbol: str, name: str) -> str:
    """The unit at the end of a column's name, such as ``t_ms`` or ``x_mm``; empty for none."""
    found = (_TIME_IN if symbol == "t" else _BEHIND_NAME).fullmatch(stated_unit(name)[0].replace(" ", "_"))
    return found[2] if found else ""


def factor_in_name(symbol: str, name: str, spec: Spec) -> float:
    """From a column of this name to SI, by the unit that the name states; 1 for none."""
    unit, own = stated_unit(name)[1] or unit_behind(symbol, name), unit_of(symbol, spec)
    stated = unit not in ("", "-", "1", own) and is_brought(unit, own)
    return float(si_factor(unit, Place(""))) if stated else 1.0


def is_brought(unit: str, own: str) -> bool:
    """Whether a column in ``unit`` can be brought to ``own``; counts are no angle, and hertz no angular speed."""
    place = Place("")
    if unit.lower() in AMBIGUOUS or not is_unit(unit) or not same_dimension(unit, own, place):
        return False
    return "rad" not in own or unit in ("1/s", "s^-1") or base_units(unit, place) == base_units(own, place)


def unit_of(symbol: str, spec: Spec) -> str:
    """The SI unit of ``t``, a position, a velocity or an input."""
    units = {"t": "s"} | {c.name: c.unit for c in spec.coordinates} | {i.name: i.unit for i in spec.inputs}
    units |= {c.velocity: f"{c.unit}/s" for c in spec.coordinates}
    return units[symbol]
