"""Remedies in the preflight's messages: the line of meta.yaml that corrects the sign or the unit of an input."""

from __future__ import annotations

from math import log

from codegen.base.errors import BadInput, Place
from codegen.logs.log import Log
from codegen.spec.model import Spec
from codegen.spec.units import same_dimension, si_factor

PREFIXES = ("", "u", "m", "k", "M")
NEAR = 1.5
"""Ratio of a unit's factor to the one found from which on no unit is proposed: a parameter may be wrong instead."""


def turned(name: str, spec: Spec, read: Log) -> str:
    """The line of meta.yaml that reverses the sign of an input, as a remark in brackets."""
    scale = _scale(name, spec, read)
    return f"(`scale: {{{name}: {-scale:.6g}}}` in meta.yaml beside the log turns {name}.)"


def asked_unit(name: str, factor: float, spec: Spec, read: Log) -> str:
    """A question whether an input is logged in another unit, with the line for meta.yaml; empty if no unit fits.

    The units tried are the spec's own with SI prefixes.

    Args:
        factor: force that the measured motion needs over the force of the input as read; positive.
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
