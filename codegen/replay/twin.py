"""A generated Python twin: imported from its source, its records filled from rows and read into rows."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from codegen.program import Program


def load_twin(source: str, name: str) -> ModuleType:
    """The module that a generated ``__init__.py`` is."""
    with tempfile.TemporaryDirectory(prefix="stiction-") as folder:
        path = Path(folder) / f"{name}.py"
        path.write_text(source, encoding="utf-8")
        found = importlib.util.spec_from_file_location(name, path)
        if found is None or found.loader is None:
            raise ImportError(f"the twin {name} cannot be loaded")
        module = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
    return module


def inputs_of(twin: ModuleType, program: Program, row: Sequence[float]) -> Any:
    """The twin's Inputs with one number for each input of the program, in order."""
    made = twin.Inputs()
    fill(made, program, dict(zip((field.name for field in program.inputs), row, strict=True)))
    return made


def fill(record: Any, program: Program, values: Mapping[str, float]) -> None:
    """Set named elements of one of the twin's records; numbered ones lie in arrays."""
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
