"""The Python twin behind the same rows as the compiled observer."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from tests.twin import load_twin

from .interface import Interface, Member


class Twin:
    """``start`` inits it, ``run`` steps it on from where it is."""

    def __init__(self, source: str, face: Interface) -> None:
        self._face, self._module = face, load_twin(source, f"twin_of_{face.name}")
        self._parameters: Any = self._module.Parameters()
        self._holds = "outputs" in inspect.signature(self._module.step).parameters
        self.dtype = np.dtype("f8" if face.real == "double" else "f4")

    def start(self, row: np.ndarray) -> None:
        self._held = (self._module.Outputs(),) if self._holds else ()
        self._state = self._module.init(self._parameters, self._inputs(row.tolist()))

    def run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs and states after each step, a row each."""
        face, step, state = self._face, self._module.step, self._state
        outputs, states = [], []
        for row in rows.tolist():
            found = step(state, self._parameters, self._inputs(row), *self._held)
            outputs.append(_flat(found, face.outputs))
            states.append(_flat(state, face.state))
        return np.array(outputs, self.dtype), np.array(states, self.dtype)

    def _inputs(self, row: Sequence[float]) -> Any:
        values, at = [], 0
        for member in self._face.inputs:
            values.append(row[at : at + member.count] if member.count else row[at])
            at += member.count or 1
        return self._module.Inputs(*values)


def _flat(struct: Any, members: tuple[Member, ...]) -> list[float]:
    row: list[float] = []
    for member in members:
        value = getattr(struct, member.name)
        row += [float(v) for v in value] if member.count else [float(value)]
    return row
