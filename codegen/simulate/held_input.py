"""Commands → what acts on the plant in each substep of the sample that follows: held, and through the actuators."""

from __future__ import annotations

from math import ceil, floor

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import System

Array = NDArray[np.float64]


class HeldInput:
    """The input of a System, sample by sample; nothing was commanded before the first.

    A substep in which a delayed command changes gets the exact mean, and so does every one behind a lag, except that
    the lag takes the substep of such a change with its mean.
    """

    def __init__(self, system: System, period: float, substeps: int) -> None:
        chains = [system.actuator(k) for k in range(len(system.inputs))]
        delays = [float(chain.delay.subs(system.values)) / period for chain in chains]
        m, length = len(chains), 1 + max((ceil(d) for d in delays), default=0)
        self._past = np.zeros((length, m))
        self._shares = np.zeros((substeps, length, m))
        for substep in range(substeps):
            for index, delay in enumerate(delays):
                whole = floor(delay)
                older = min(max((delay - whole) * substeps - substep, 0.0), 1.0)
                self._shares[substep, whole, index] = 1 - older
                if older > 0:
                    self._shares[substep, whole + 1, index] = older
        self._static = _static(system) if system.actuators else None
        lags = [0.0 if chain.lag is None else float(chain.lag.subs(system.values)) for chain in chains]
        self._steps = np.array([lag * substeps / period for lag in lags])
        with np.errstate(divide="ignore"):
            self._decay = np.exp(-1 / self._steps)
        self._lagged = np.zeros(m)

    def take(self, command: Array) -> Array:
        """Hold a command (m,) from now on: (substeps, m) effective inputs of this sample."""
        if self._static is not None:
            command = np.asarray(self._static(command), dtype=float).ravel()
        if len(self._past) == 1:
            driven = np.broadcast_to(command, (len(self._shares), len(command)))
        else:
            self._past[1:] = self._past[:-1].copy()
            self._past[0] = command
            driven = np.asarray(np.sum(self._shares * self._past, axis=1))
        return driven if not self._steps.any() else self._behind_lag(driven)

    def _behind_lag(self, driven: Array) -> Array:
        means = np.empty(driven.shape)
        for k, w in enumerate(driven):
            means[k] = w + (self._lagged - w) * self._steps * (1 - self._decay)
            self._lagged = w + (self._lagged - w) * self._decay
        return means


def _static(system: System) -> casadi.Function:
    """Gain, dead zone and saturation of all inputs, m by 1; they commute with a delay."""
    w = casadi.SX.sym("w", len(system.inputs))
    names = {s: casadi.SX(float(v)) for s, v in system.values.items()}
    names |= {s: w[k] for k, s in enumerate(system.inputs)}
    chains = [to_casadi(system.actuator(k).static(s), names) for k, s in enumerate(system.inputs)]
    return casadi.Function("static", [w], [casadi.vertcat(*chains)])
