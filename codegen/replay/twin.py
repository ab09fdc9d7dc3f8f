"""The generated Python twin as a module, and conversion of its records from and to rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from codegen.program import Program


def load_twin(source: str, name: str) -> ModuleType:
    """The module of a generated ``__init__.py``, from its text without a file."""
    module = ModuleType(name)
    exec(compile(source, f"<the twin of {name}>", "exec", dont_inherit=True), module.__dict__)
    return module


def inputs_of(twin: ModuleType, program: Program, row: Sequence[float]) -> Any:
    """The twin's Inputs with one number for each input of the program, in order."""
    made = twin.Inputs()
    fill(made, program, dict(zip((field.name for field in program.inputs), row, strict=True)))
    return made


def fill(record: Any, program: Program, values: Mapping[str, float]) -> None:
    """Set named elements of one of the twin's records; numbered ones are in arrays."""
    for name, value in values.items():
        place = program.arrays.get(name)
        if place is None:
            setattr(record, name, value)
        else:
            getattr(record, place.array)[place.at] = value


def values_of(record: Any, program: Program, names: Sequence[str]) -> list[float]:
    """The named elements of one of the twin's records."""
    values = []
    for name in names:
        place = program.arrays.get(name)
        values.append(getattr(record, name) if place is None else getattr(record, place.array)[place.at])
    return values
