"""Axes of the gain space: the numbers that a feasibility report varies, and the gains that depend on each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput, Place, refuse_unknown
from codegen.observers import Observer, build_observer
from codegen.spec.expression import exact_number
from codegen.spec.free_gains import GainEntry, at_middle, free_entries, gain_entries, with_gains
from codegen.spec.model import FreeGain, Spec

AROUND = 100.0
"""Factor, up and down, by which a gain with a value in the spec is varied."""
SAMPLE_TIME = "h"
"""Name of the sample time as an axis."""


@dataclass(frozen=True)
class GainAxis:
    """One number t that is varied; each gain symbol s that depends on it is ``weights[s]`` · t.

    Attributes:
        name: of the gain, or of its symbol if only one entry of a matrix is varied.
        unit: of t; "1" for a common factor of gains with different values.
        weights: gain symbol → weight; the sign of a negative gain is in the weight.
        entries: (gain, path) in the spec → weight, likewise.
        low, high: range of t.
        chosen: t in the spec, or None if the gain is free.
        logarithmic: whether the axis is logarithmic; a range that includes zero is linear.
    """

    name: str
    unit: str
    weights: Mapping[sympy.Symbol, float]
    entries: Mapping[tuple[str, tuple[int, ...]], float]
    low: float
    high: float
    chosen: float | None
    logarithmic: bool = True

    @property
    def factor(self) -> bool:
        """Whether t is a common factor of gains with different values."""
        return any(abs(w) != 1 for w in self.weights.values())

    @property
    def negative(self) -> bool:
        """Whether the gain is −t."""
        return not self.factor and all(w < 0 for w in self.weights.values())

    @property
    def label(self) -> str:
        """Label of the axis, without the unit."""
        return f"factor on {self.name}" if self.factor else f"-{self.name}" if self.negative else self.name

    def at(self, share: Any) -> Any:
        """t at a share 0…1 of the range, scalar or array."""
        share = np.asarray(share, dtype=float)
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + (self.high - self.low) * share


def gain_axes(spec: Spec, observer: Observer) -> tuple[GainAxis, ...]:
    """The axes along which the gains of a spec's observer are varied.

    One axis for each free gain of the spec; without free gains, one for each gain as a whole, by a factor of 100 up and
    down. The gain symbols that depend on an entry of the spec are found by building the observer with it doubled.
    ``observer``: of the spec, with its free gains at mid-range. Raises BadInput if the observer cannot be built at
    gains in these ranges, or no gain can be varied.
    """
    nominal = at_middle(spec)
    free = free_entries(spec)
    groups = [(entry,) for entry in free] if free else _by_gain(nominal)
    axes, values = [], gain_numbers(nominal)
    for group in groups:
        numbers = {(entry.gain, entry.path): values[entry.gain, entry.path] for entry in group}
        doubled = build_observer(with_gains(nominal, {at: 2 * value for at, value in numbers.items()}), observer.system)
        dependent = {s: float(v) for s, v in observer.gains.items() if doubled.gains[s] != v}
        if dependent:  # none where the entry is zero
            axes.append(_axis(group, numbers, dependent, observer))
    if not axes:
        raise BadInput(
            spec.place("observer.gains"), "no gain that could be varied", "a gain that is not zero", code="SPEC023"
        )
    return tuple(axes)


def unit_notes(axes: Sequence[GainAxis], observer: Observer) -> tuple[str, ...]:
    """A note for each free gain whose one number is used for entries in different units, with what to write instead.

    The gains that such a number describes depend on the choice of units: their ratio changes from m to mm.
    """
    notes = []
    for axis in axes:
        if axis.chosen is None and len({observer.gain_units[s] for s in axis.weights}) > 1:
            each = ", ".join(f"{s} in {observer.gain_units[s]}" for s in axis.weights)
            low, high = (-axis.high, -axis.low) if axis.negative else (axis.low, axis.high)
            entry = f"{{free: [{low:g}, {high:g}]}}"
            notes.append(
                f"{axis.name} is one number for gains of different units ({each}); to choose each by itself, write a"
                f" list with a range for each: `{axis.name}: [{', '.join([entry] * len(axis.weights))}]`"
            )
    return tuple(notes)


def sample_time_axis(observer: Observer) -> GainAxis:
    """The sample time as an axis of the map, two decades around the spec's."""
    h = float(observer.sample_time)
    return GainAxis(SAMPLE_TIME, "s", {}, {}, h / AROUND, h * AROUND, h)


def chosen_axes(names: Sequence[str], axes: Sequence[GainAxis], observer: Observer, spec: Spec) -> tuple[GainAxis, ...]:
    """The two axes of the map: those named, else the first two gains, or the only gain and the sample time.

    Raises BadInput for a name that is neither a varied gain nor h, or is given twice.
    """
    known = {a.name: a for a in (*axes, sample_time_axis(observer))}
    for name in names:
        expected = f"two of {', '.join(known)}"
        refuse_unknown(name, known, Place(str(spec.path), key="--over"), "unknown gain", expected, code="CALL001")
    picked = list(dict.fromkeys(names))
    if names and len(picked) != 2:
        found, expected = f"`{' '.join(names)}`", f"two different of {', '.join(known)}"
        raise BadInput(Place(str(spec.path), key="--over"), found, expected, code="CALL002")
    pair = picked or list(known)[:2]
    return known[pair[0]], known[pair[1]]


def _by_gain(spec: Spec) -> list[tuple[GainEntry, ...]]:
    """The entries of each gain of the spec together."""
    gains = spec.required_observer.gains
    return [tuple(e for e in gain_entries(gains) if e.gain == name) for name in gains]


def gain_numbers(spec: Spec) -> dict[tuple[str, tuple[int, ...]], Any]:
    """(gain, path) → exact value, of each entry of the spec's gains; none may be free."""
    entries = gain_entries(spec.required_observer.gains)
    return {(e.gain, e.path): exact_number(str(e.value), spec.place(e.key)) for e in entries}


def _axis(
    group: Sequence[GainEntry],
    numbers: Mapping[tuple[str, tuple[int, ...]], Any],
    dependent: Mapping[sympy.Symbol, float],
    observer: Observer,
) -> GainAxis:
    """The axis of a group of entries of the spec that are varied together; ``numbers`` are their values.

    ``dependent``: gain symbol that depends on them → its value.
    """
    name = group[0].gain if len(dependent) > 1 else next(iter(dependent)).name
    unit = " or ".join(dict.fromkeys(observer.gain_units[s] for s in dependent))
    if isinstance(group[0].value, FreeGain):
        low, high = float(group[0].value.low), float(group[0].value.high)
        sign = -1.0 if high <= 0 else 1.0
        low, high = (low, high) if sign > 0 else (-high, -low)
        weights, entries = dict.fromkeys(dependent, sign), dict.fromkeys(numbers, sign)
        return GainAxis(name, unit, weights, entries, low, high, None, low > 0)
    # Equal values (a scalar gain): t is the gain. Different values: t is a common factor, 1 in the spec.
    values = list(dependent.values())
    equal = all(v == values[0] for v in values)
    size = abs(values[0]) if equal else 1.0
    return GainAxis(
        name=name,
        unit=unit if equal else "1",
        weights={s: v / size for s, v in dependent.items()},
        entries={at: float(value) / size for at, value in numbers.items()},
        low=size / AROUND,
        high=size * AROUND,
        chosen=size,
    )
