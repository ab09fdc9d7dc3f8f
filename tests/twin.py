"""The generated Python twin, loaded and run: what the compiled C is compared with, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from types import ModuleType
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.program import Program
from codegen.replay.engine import Faults


class TwinEngine:
    """The generated Python module, with the methods of ``codegen.replay.engine.Engine``."""

    def __init__(self, program: Program, files: Mapping[str, str]) -> None:
        self.holds = program.holds
        self.inputs = tuple(field.name for field in program.inputs)
        self.outputs = tuple(name for name, _, _ in program.outputs)
        self._twin, self._program = load_twin(files["__init__.py"], program.name), program
        self._parameters: Any = self._twin.Parameters()
        self._state: Any = None
        self._held: tuple[Any, ...] = ()

    def start(self, row: Array) -> None:
        self._state = self._twin.init(self._parameters, inputs_of(self._twin, self._program, row.tolist()))
        self._held = (self._twin.Outputs(),) if self.holds else ()

    def run(self, rows: Array) -> tuple[Array, Faults]:
        estimates, faults = np.empty((len(rows), len(self.outputs))), np.zeros(len(rows), dtype=np.intc)
        for k, row in enumerate(rows.tolist()):
            inputs = inputs_of(self._twin, self._program, row)
            made = self._twin.step(self._state, self._parameters, inputs, *self._held)
            estimates[k] = values_of(made, self._program, self.outputs)
            if self.holds:
                faults[k] = made.fault
        return estimates, faults

    def trial_step(self, row: Array) -> Array:
        before, held = self._state, self._held
        self._state, self._held = deepcopy(before), deepcopy(held)
        estimates: Array = self.run(row)[0][0]
        self._state, self._held = before, held
        return estimates


def load_twin(source: str, name: str) -> ModuleType:
    """A generated ``__init__.py``, loaded as a module from its text."""
    module = ModuleType(name)
    exec(compile(source, f"<the twin of {name}>", "exec", dont_inherit=True), module.__dict__)
    return module


def inputs_of(twin: ModuleType, program: Program, row: Sequence[float]) -> Any:
    """The twin's ``Inputs`` with the numbers of a row, in the Program's order."""
    made = twin.Inputs()
    fill(made, program, dict(zip((field.name for field in program.inputs), row, strict=True)))
    return made


def fill(record: Any, program: Program, values: Mapping[str, float]) -> None:
    """Set quantities of one of the twin's records by their names in the Program; some are array elements."""
    for name, value in values.items():
        place = program.arrays.get(name)
        if place is None:
            setattr(record, name, value)
        else:
            getattr(record, place.array)[place.at] = value


def values_of(record: Any, program: Program, names: Sequence[str]) -> list[float]:
    """Quantities of one of the twin's records by their names in the Program."""
    values = []
    for name in names:
        place = program.arrays.get(name)
        values.append(getattr(record, name) if place is None else getattr(record, place.array)[place.at])
    return values
