"""Free gains, ``K_F: {free: [1, 1000]}`` in a spec: reading, refusal where a number is needed, replacement."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from codegen.base.errors import BadInput, PlaceOf
from codegen.spec.expression import exact_number
from codegen.spec.model import FreeGain, Spec
from codegen.spec.schema import FreeSection


@dataclass(frozen=True)
class GainEntry:
    """An entry of ``observer.gains``.

    Attributes:
        gain: name of the gain.
        path: () for a scalar, (i,) in a list, (i, j) in rows.
        value: the number as written, or a FreeGain.
    """

    gain: str
    path: tuple[int, ...]
    value: Any

    @property
    def key(self) -> str:
        """Its key in the spec."""
        return f"observer.gains.{self.gain}" + "".join(f"[{k}]" for k in self.path)


def read_free_gains(raw: Any, key: str, place: PlaceOf) -> Any:
    """A gain of the schema with its free entries as FreeGain."""
    if isinstance(raw, list):
        return [read_free_gains(entry, f"{key}[{k}]", place) for k, entry in enumerate(raw)]
    if not isinstance(raw, FreeSection):
        return raw
    where = place(f"{key}.free")
    low, high = (exact_number(bound, where) for bound in raw.free)
    if not low < high:
        found = f"free: [{raw.free[0]}, {raw.free[1]}]"
        raise BadInput(where, found, "a range [low, high] with low < high", code="SPEC007")
    if low < 0 < high and "][" not in key:
        expected = "a range of one sign, as every stable gain has one sign"
        raise BadInput(where, f"free: [{raw.free[0]}, {raw.free[1]}], of both signs", expected, code="SPEC007")
    return FreeGain(low, high)


def gain_entries(gains: Mapping[str, Any]) -> tuple[GainEntry, ...]:
    """All entries of the gains, in the order of the spec."""
    return tuple(entry for name, raw in gains.items() for entry in _entries(name, (), raw))


def free_entries(spec: Spec) -> tuple[GainEntry, ...]:
    """The free entries of a spec's gains."""
    if spec.observer is None:
        return ()
    return tuple(e for e in gain_entries(spec.observer.gains) if isinstance(e.value, FreeGain))


def refuse_free_gains(spec: Spec) -> None:
    """Raise BadInput for a free gain, with the verb that suggests a number."""
    for entry in free_entries(spec):
        expected = f"a number; `stiction gains {spec.path}` shows which are stable and suggests one"
        raise BadInput(spec.place(entry.key), _is_free(entry), expected, code="SPEC023")


def free_gains_in_words(spec: Spec) -> str:
    """The free gains in words; empty if there are none."""
    return ", ".join(map(_is_free, free_entries(spec)))


def _is_free(entry: GainEntry) -> str:
    name = entry.key.removeprefix("observer.gains.")
    return f"the gain `{name}` is free ({float(entry.value.low):g} to {float(entry.value.high):g})"


def with_gains(spec: Spec, numbers: Mapping[tuple[str, tuple[int, ...]], float]) -> Spec:
    """The spec with new numbers at (gain, path); its text is unchanged."""
    choice = spec.required_observer
    gains = {name: _filled(name, (), raw, numbers) for name, raw in choice.gains.items()}
    return replace(spec, observer=replace(choice, gains=gains))


def middle(free: FreeGain) -> float:
    """A number in the range: the geometric mean if both ends have one sign; else the middle, or the upper end for 0."""
    low, high = float(free.low), float(free.high)
    if low * high > 0:
        return float(f"{math.copysign(math.sqrt(low * high), low):.6g}")
    return (low + high) / 2 or high


def at_middle(spec: Spec) -> Spec:
    """The spec with every free gain at the middle of its range, for results that do not depend on the number."""
    free = free_entries(spec)
    return with_gains(spec, {(e.gain, e.path): middle(e.value) for e in free}) if free else spec


def _entries(name: str, path: tuple[int, ...], raw: Any) -> list[GainEntry]:
    if isinstance(raw, list):
        return [entry for k, inner in enumerate(raw) for entry in _entries(name, (*path, k), inner)]
    return [GainEntry(name, path, raw)]


def _filled(name: str, path: tuple[int, ...], raw: Any, numbers: Mapping[tuple[str, tuple[int, ...]], float]) -> Any:
    if isinstance(raw, list):
        return [_filled(name, (*path, k), inner, numbers) for k, inner in enumerate(raw)]
    return repr(float(numbers[name, path])) if (name, path) in numbers else raw
