"""The line of meta.yaml that mends an input's sign or unit, for the preflight's messages."""

from __future__ import annotations

from math import log

from codegen.base.errors import BadInput, Place
from codegen.logs.log import Log
from codegen.spec.model import Spec
from codegen.spec.units import same_dimension, si_factor

PREFIXES = ("", "u", "m", "k", "M")
NEAR = 1.5
"""Largest ratio of a factor to that of a unit for which the unit is asked for: the rest is an error of a parameter."""


def turned(name: str, spec: Spec, read: Log) -> str:
    """How meta.yaml turns the sign of an input."""
    scale = _scale(name, spec, read)
    return f"(`scale: {{{name}: {-scale:.6g}}}` in meta.yaml beside the log turns {name}.)"


def asked_unit(name: str, factor: float, spec: Spec, read: Log) -> str:
    """The unit that an input may be in, as a question with the line for meta.yaml; empty where none fits.

    Tried are the spec's unit with the prefixes of a power of 1000.

    Args:
        factor: of the force that the motion takes over that of the input as it was read; positive.
    """
    own = next(i.unit for i in spec.inputs if i.name == name)
    if name in read.intake.brought or own in ("", "1"):
        return ""
    here = Place("")
    taken = read.description.units.get(name, own)
    wanted = factor * float(si_factor(taken, here))
    for prefix in PREFIXES:
        unit = prefix + own
        try:
            fits = unit != taken and same_dimension(unit, own, here)
            apart = abs(log(float(si_factor(unit, here)) / wanted)) if fits else log(NEAR)
        except BadInput:  # a prefix that the unit does not take
            continue
        if apart < log(NEAR):
            return f"Is {name} in {unit}? (`units: {{{name}: {unit}}}` in meta.yaml beside the log)"
    return ""


def _scale(name: str, spec: Spec, read: Log) -> float:
    return float(read.description.scale.get(name, spec.log.scale.get(name, 1.0)))
