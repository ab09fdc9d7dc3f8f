"""The Python twin behind the same rows of doubles as the compiled observer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from codegen.diagnosis.replay import load_twin

from .interface import Interface, Member


class Twin:
    """``start`` inits it, ``run`` steps it on from where it is."""

    dtype = np.dtype(np.float64)

    def __init__(self, source: str, face: Interface) -> None:
        self._face, self._module = face, load_twin(source, f"twin_of_{face.name}")
        self._parameters: Any = self._module.Parameters()
        if hasattr(self._module, "prepare"):
            self._parameters = self._module.prepare(self._parameters) or self._parameters

    def start(self, row: np.ndarray) -> None:
        self._state = self._module.init(self._parameters, self._inputs(row.tolist()))

    def run(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs and states after each step, a row each."""
        face, step, state = self._face, self._module.step, self._state
        outputs, states = [], []
        for row in rows.tolist():
            found = step(state, self._parameters, self._inputs(row))
            outputs.append(_flat(found, face.outputs))
            states.append(_flat(state, face.state))
        return np.array(outputs, dtype=float), np.array(states, dtype=float)

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
