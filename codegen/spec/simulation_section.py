"""Reading of the section ``simulation``: signals over t, and numbers by name."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import sympy

from codegen.base.errors import BadInput, Place, PlaceOf, refuse_unknown
from codegen.spec.expression import exact_number, parse_expression
from codegen.spec.model import NO_INPUTS, Coordinate, Input, Simulation, symbol
from codegen.spec.quantity import read_quantity
from codegen.spec.schema import SimulationSection

MOST_SAMPLES = 1e7
"""Most samples of a simulation."""


def read_simulation(
    section: SimulationSection | None, coordinates: Iterable[Coordinate], inputs: Iterable[Input], place: PlaceOf
) -> Simulation | None:
    """The simulation section of a spec; None without one."""
    return None if section is None else _Reader(section, tuple(coordinates), tuple(inputs), place).simulation()


@dataclass(frozen=True)
class _Reader:
    """Reader of one section, whose entries are by the names of coordinates, velocities and inputs."""

    section: SimulationSection
    coordinates: tuple[Coordinate, ...]
    inputs: tuple[Input, ...]
    place: PlaceOf

    def simulation(self) -> Simulation:
        """The whole section, in the order in which its faults are reported."""
        duration, period = self._times()
        inputs = {i.name: i.unit for i in self.inputs}
        positions = {c.name: c.unit for c in self.coordinates}
        velocities = {c.velocity: f"{c.unit}/s" for c in self.coordinates}
        return Simulation(
            duration,
            period,
            inputs=self._functions("inputs", inputs),
            reference=self._functions("reference", inputs | positions),
            position_gain=self._numbers("position_gain", dict.fromkeys(inputs, "")),
            velocity_gain=self._numbers("velocity_gain", dict.fromkeys(inputs, "")),
            input_limit=self._magnitudes("input_limit", inputs, zero=False),
            encoder_step=self._magnitudes("encoder_step", positions),
            position_noise=self._magnitudes("position_noise", positions),
            seed=self.section.seed,
            integral_gain=self._numbers("integral_gain", dict.fromkeys(inputs, "")),
            velocity_noise=self._magnitudes("velocity_noise", velocities),
            observer=self.section.observer,
            cancel=_cancelled(self.section, self.place),
            cancel_delay=self.section.cancel_delay,
        )

    def _times(self) -> tuple[float, float]:
        """Duration and sample time, s."""
        duration = self._number(self.section.duration, "duration", "s")
        period = self._number(self.section.sample_time, "sample_time", "s")
        for key, value in (("duration", duration), ("sample_time", period)):
            if value <= 0:
                raise BadInput(self._at(key), f"{value:g} s", "a positive time in s", code="SPEC007")
        if not period < duration or duration / period > MOST_SAMPLES:
            found = f"{duration} s in steps of {period} s"
            raise BadInput(self._at("duration"), found, "2 to 10^7 samples", code="SPEC024")
        return duration, period

    def _functions(self, key: str, names: Collection[str]) -> dict[str, sympy.Expr]:
        """Name → expression over the time."""
        time = {"t": symbol("t")}
        entries = self._entries(key, names)
        return {k: parse_expression(v, self._at(f"{key}.{k}")).symbolic(time) for k, v in entries.items()}

    def _numbers(self, key: str, units: Mapping[str, str]) -> dict[str, float]:
        """Name → number in its unit of ``units``; "" for a number without a unit."""
        return {k: self._number(v, f"{key}.{k}", units[k]) for k, v in self._entries(key, units).items()}

    def _magnitudes(self, key: str, units: Mapping[str, str], zero: bool = True) -> dict[str, float]:
        """Name → number that is not negative, nor zero unless ``zero`` allows it."""
        values = self._numbers(key, units)
        for k, value in values.items():
            if value < 0 or (value == 0 and not zero):
                what = "zero or a positive number" if zero else "a positive number; no entry means no limit"
                raise BadInput(self._at(f"{key}.{k}"), f"{key} {value:g}", what, code="SPEC007")
        return values

    def _entries(self, key: str, names: Collection[str]) -> Mapping[str, str]:
        """Name → text of the entries of a key, all of which are in ``names``."""
        entries: Mapping[str, str] = getattr(self.section, key)
        for entry in entries:
            if not names:  # only inputs can be missing; a spec has a coordinate
                found = f"the input `{entry}`, but {NO_INPUTS}"
                raise BadInput(self._at(f"{key}.{entry}"), found, "`inputs:` with it", code="SPEC008")
            refuse_unknown(entry, sorted(names), self._at(f"{key}.{entry}"), "unknown name", code="SPEC008")
        return entries

    def _number(self, text: str, key: str, unit: str) -> float:
        return float(read_quantity(text, unit, self._at(key)) if unit else exact_number(text, self._at(key)))

    def _at(self, key: str) -> Place:
        """File and line of a key of the section."""
        return self.place(f"simulation.{key}")


def _cancelled(section: SimulationSection, place: PlaceOf) -> float | None:
    """The share of the friction estimate that the input cancels; None for none."""
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
