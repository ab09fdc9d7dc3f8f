"""Clocks that count from a date: time columns in ms, µs or ns since 1970, or in FILETIME, are converted to seconds."""

from __future__ import annotations

from dataclasses import replace

from codegen.logs.binding import Binding
from codegen.logs.description import LogDescription
from codegen.logs.formats.source import Columns
from codegen.spec.model import Spec

_CLOCKS = {
    "100 ns since 1601 (FILETIME)": (1e-7, 11_644_473_600.0),
    "milliseconds since 1970": (1e-3, 0.0),
    "microseconds since 1970": (1e-6, 0.0),
    "nanoseconds since 1970": (1e-9, 0.0),
}
"""Clock → its unit in s, and its time in s at the start of 1970."""
_YEARS_2000_TO_2100 = (946_684_800.0, 4_102_444_800.0)


def since_epoch(binding: Binding, raw: Columns, description: LogDescription, spec: Spec) -> Binding:
    """The binding with the factor of time to seconds, if time is in ms, µs or ns since 1970 or in Windows' FILETIME.

    The clock is recognised by its value at the first sample, which must be a time between 2000 and 2100. A time in
    seconds is never that large. A unit or scale given for ``t`` takes precedence.
    """
    term = binding.terms.get("t")
    if term is None or term.expression is not None or binding.scale["t"] != 1.0 or not len(raw.values):
        return binding
    if {"t"} & {*description.units, *description.scale, *spec.log.scale}:
        return binding
    first = raw.values[0, raw.names.index(term.columns[0])]
    for clock, (step, before) in _CLOCKS.items():
        if _YEARS_2000_TO_2100[0] <= first * step - before <= _YEARS_2000_TO_2100[1]:
            words = f"in {clock}, by its size"
            return replace(
                binding,
                scale={**binding.scale, "t": step},
                notes=(*binding.notes, f"t is {words}: converted to s"),
                inferred_units={**binding.inferred_units, "t": words},
            )
    return binding
