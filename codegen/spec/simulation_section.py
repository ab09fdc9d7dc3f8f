"""Reading of the section ``simulation``: signals over t, and numbers by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import sympy

from codegen.base.errors import BadInput, Place, refuse_unknown
from codegen.spec.expression import exact_number, parse_expression
from codegen.spec.model import NO_INPUTS, Coordinate, Input, Simulation, symbol
from codegen.spec.quantity import read_quantity
from codegen.spec.schema import SimulationSection

MOST_SAMPLES = 1e7
"""Most samples of a simulation."""


def read_simulation(
    section: SimulationSection | None,
    coordinates: Iterable[Coordinate],
    inputs: Iterable[Input],
    place: Callable[[str], Place],
) -> Simulation | None:
    """The simulation section of a spec; None without one.

    Args:
        place: key → its file and line.

    Raises:
        BadInput: for an unknown name, an invalid number or expression, a duration of less than two or more than 10⁷
            samples, a negative step, noise or limit, or a cancellation that is not a share or has no observer.
    """
    if section is None:
        return None
    coordinates = tuple(coordinates)
    inputs, positions = tuple(inputs), {c.name for c in coordinates}
    entries = {i.name for i in inputs}
    time = {"t": symbol("t")}

    def number(text: str, key: str, unit: str) -> float:
        return float(read_quantity(text, unit, place(key)) if unit else exact_number(text, place(key)))

    def known(name: str, names: set[str]) -> Mapping[str, str]:
        key = f"simulation.{name}"
        values: Mapping[str, str] = getattr(section, name)
        for entry in values:
            if not names:  # only inputs can be missing; a spec has a coordinate
                found = f"the input `{entry}`, but {NO_INPUTS}"
                raise BadInput(place(f"{key}.{entry}"), found, "`inputs:` with it", code="SPEC008")
            refuse_unknown(entry, sorted(names), place(f"{key}.{entry}"), "unknown name", code="SPEC008")
        return values

    def numbers(name: str, names: set[str], units: Mapping[str, str] | None = None) -> dict[str, float]:
        own = units or {}
        return {k: number(v, f"simulation.{name}.{k}", own.get(k, "")) for k, v in known(name, names).items()}

    def magnitudes(name: str, units: Mapping[str, str], zero: bool = True) -> dict[str, float]:
        values = numbers(name, set(units), units)
        for k, value in values.items():
            if value < 0 or (value == 0 and not zero):
                what = "zero or a positive number" if zero else "a positive number; no entry means no limit"
                raise BadInput(place(f"simulation.{name}.{k}"), f"{name} {value:g}", what, code="SPEC007")
        return values

    def functions(name: str, names: set[str]) -> dict[str, sympy.Expr]:
        return {
            k: parse_expression(v, place(f"simulation.{name}.{k}")).symbolic(time)
            for k, v in known(name, names).items()
        }

    duration = number(section.duration, "simulation.duration", "s")
    period = number(section.sample_time, "simulation.sample_time", "s")
    for key, value in (("duration", duration), ("sample_time", period)):
        if value <= 0:
            raise BadInput(place(f"simulation.{key}"), f"{value:g} s", "a positive time in s", code="SPEC007")
    if not period < duration or duration / period > MOST_SAMPLES:
        found = f"{duration} s in steps of {period} s"
        raise BadInput(place("simulation.duration"), found, "2 to 10^7 samples", code="SPEC024")
    return Simulation(
        duration,
        period,
        functions("inputs", entries),
        functions("reference", entries | positions),
        numbers("position_gain", entries),
        numbers("velocity_gain", entries),
        magnitudes("input_limit", {i.name: i.unit for i in inputs}, zero=False),
        magnitudes("encoder_step", {c.name: c.unit for c in coordinates}),
        magnitudes("position_noise", {c.name: c.unit for c in coordinates}),
        section.seed,
        numbers("integral_gain", entries),
        magnitudes("velocity_noise", {c.velocity: f"{c.unit}/s" for c in coordinates}),
        section.observer,
        _cancelled(section, place),
        section.cancel_delay,
    )


def _cancelled(section: SimulationSection, place: Callable[[str], Place]) -> float | None:
    for key in ("cancel", "cancel_delay"):
        if key in section.model_fields_set and not section.observer:
            found = f"`{key}` without an observer in the loop"
            raise BadInput(place(f"simulation.{key}"), found, "`observer: true` too", code="SPEC024")
    if section.cancel is None:
        if "cancel_delay" in section.model_fields_set:
            words = "`cancel_delay` without `cancel`"
            raise BadInput(place("simulation.cancel_delay"), words, "`cancel: 1` too, or no delay", code="SPEC024")
        return None
    share = float(exact_number(section.cancel, place("simulation.cancel")))
    if not 0 < share <= 1:
        expected = "the share of the estimate to cancel, above 0 up to 1"
        raise BadInput(place("simulation.cancel"), f"{share:g}", expected, code="SPEC007")
    return share
