"""Declared fields of a struct in the generated code: scalars, and arrays for numbered quantities such as x1 to x16."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from codegen.program import Program


@dataclass(frozen=True)
class Entry:
    """A declared field.

    Attributes:
        name: of the field; ``count`` is 0 for a scalar, the length of an array otherwise.
        unit, meaning: for the comment; the meaning of an array lists the names of the spec that are its elements.
        values: one for each element.
    """

    name: str
    count: int
    unit: str
    meaning: str
    values: tuple[float, ...]

    @property
    def declared(self) -> str:
        return f"{self.name}[{self.count}]" if self.count else self.name


Row = tuple[str, str, str, float]


def entries(program: Program, rows: Iterable[Row]) -> tuple[Entry, ...]:
    """The entries of rows of (name, unit, meaning, value); neighbouring rows of one array become one entry."""
    groups: list[list[Row]] = []
    for row in rows:
        place = program.arrays.get(row[0])
        before = program.arrays.get(groups[-1][-1][0]) if groups else None
        if place is not None and before is not None and before.array == place.array:
            groups[-1].append(row)
        else:
            groups.append([row])
    return tuple(_entry(program, group) for group in groups)


def inputs_of(program: Program) -> tuple[Entry, ...]:
    return entries(program, ((f.name, f.unit, f.meaning, 0.0) for f in program.inputs))


def states_of(program: Program) -> tuple[Entry, ...]:
    return entries(program, ((f.name, f.unit, f.meaning, 0.0) for f in program.states))


def outputs_of(program: Program) -> tuple[Entry, ...]:
    return entries(program, ((name, unit, meaning, 0.0) for name, unit, meaning in program.outputs))


def parameters_of(program: Program) -> tuple[Entry, ...]:
    return entries(program, ((f.name, f.unit, f.meaning, f.value or 0.0) for f in program.parameters))


def _entry(program: Program, group: Sequence[Row]) -> Entry:
    name, unit, meaning, _ = group[0]
    values = tuple(value for _, _, _, value in group)
    place = program.arrays.get(name)
    if place is None:
        return Entry(name, 0, unit, meaning, values)
    units = "; ".join(dict.fromkeys(row[1] for row in group))
    return Entry(place.array, len(group), units, f"{name} to {group[-1][0]}, {meaning}", values)
