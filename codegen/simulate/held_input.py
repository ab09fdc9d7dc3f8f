"""Commands → what acts on the plant in each substep of the sample that follows: held, and late where declared."""

from __future__ import annotations

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.system import System

Array = NDArray[np.float64]


class HeldInput:
    """The input of a System, sample by sample; nothing was commanded before the first.

    A substep in which a delayed command changes gets the exact mean.
    """

    def __init__(self, system: System, period: float, substeps: int) -> None:
        delays = [
            float(system.values[system.input_delay[w]]) / period if w in system.input_delay else 0.0
            for w in system.inputs
        ]
        m, length = len(delays), 1 + max((ceil(d) for d in delays), default=0)
        self._past = np.zeros((length, m))
        self._shares = np.zeros((substeps, length, m))
        for substep in range(substeps):
            for index, delay in enumerate(delays):
                whole = floor(delay)
                older = min(max((delay - whole) * substeps - substep, 0.0), 1.0)
                self._shares[substep, whole, index] = 1 - older
                if older > 0:
                    self._shares[substep, whole + 1, index] = older

    def take(self, command: Array) -> Array:
        """Hold a command (m,) from now on: (substeps, m) effective inputs of this sample."""
        if len(self._past) == 1:
            return np.broadcast_to(command, (len(self._shares), len(command)))
        self._past[1:] = self._past[:-1].copy()
        self._past[0] = command
        return np.asarray(np.sum(self._shares * self._past, axis=1))
