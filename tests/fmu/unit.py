"""An FMU under FMPy, the same for both versions of FMI: set, get, step, and what it logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

__all__ = ["FMICallException", "Unit"]


class Unit:
    """An instance; ``said`` are the messages that it logged."""

    def __init__(self, folder: Path, instance: str = "one") -> None:
        self.description = fmpy.read_model_description(str(folder))
        self.two = self.description.fmiVersion == "2.0"
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.said: list[str] = []
        self.unit = (FMU2Slave if self.two else FMU3Slave)(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=instance,
        )
        if self.two:
            callbacks = fmi2CallbackFunctions()
            self._keep = fmi2CallbackLoggerTYPE(lambda env, name, status, category, text: self._hear(text))
            callbacks.logger = self._keep
            self.unit.instantiate(callbacks=callbacks)
        else:
            self.unit.instantiate(logMessage=lambda env, status, category, text: self._hear(text))

    def _hear(self, text: bytes) -> None:
        self.said.append(text.decode())

    def begin(self, inputs: Mapping[str, float], parameters: Mapping[str, float] | None = None) -> None:
        for name, value in (parameters or {}).items():
            self.set(name, value)
        if self.two:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        for name, value in inputs.items():
            self.set(name, value)
        self.unit.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        (self.unit.setReal if self.two else self.unit.setFloat64)([self.references[name]], [value])

    def get(self, names: Sequence[str]) -> list[float]:
        references = [self.references[name] for name in names]
        return list((self.unit.getReal if self.two else self.unit.getFloat64)(references))

    def get_integer(self, name: str) -> int:
        read = self.unit.getInteger if self.two else self.unit.getInt32
        return int(read([self.references[name]])[0])

    def step(self, at: float, size: float) -> None:
        self.unit.doStep(currentCommunicationPoint=at, communicationStepSize=size)

    def run(self, rows: np.ndarray, inputs: Sequence[str], outputs: Sequence[str], size: float) -> np.ndarray:
        """(N, outputs) after each step; the unit has begun."""
        made = np.empty((len(rows), len(outputs)))
        for k, row in enumerate(rows.tolist()):
            for name, value in zip(inputs, row, strict=True):
                self.set(name, value)
            self.step(k * size, size)
            made[k] = self.get(outputs)
        return made

    def end(self) -> None:
        self.unit.terminate()
        self.unit.freeInstance()
