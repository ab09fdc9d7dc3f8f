"""Commands → what acts on the plant in each part of the sample that follows: held, and through the actuators."""

from __future__ import annotations

from math import ceil, floor
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.actuator import decayed
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.system import System

Array = NDArray[np.float64]


class HeldInput:
    """The input of a System, sample by sample; nothing was commanded before the first.

    A part in which a delayed command changes gets the exact mean, and so does every one behind a lag, except that the
    lag takes the part of such a change with its mean.
    """

    def __init__(self, system: System, period: float, edges: Array) -> None:
        """Work out which command acts when.

        Args:
            edges: (parts + 1,) where the parts of a sample begin and end, from 0 to 1.
        """
        chains = [system.actuator(k) for k in range(len(system.inputs))]
        delays = _delays(system, period)
        self._past = np.zeros((1 + max((ceil(d) for d in delays), default=0), len(delays)))
        self._shares = np.zeros((len(edges) - 1, *self._past.shape))
        for index, delay in enumerate(delays):
            whole = floor(delay)
            older = np.clip((delay - whole - edges[:-1]) / np.diff(edges), 0.0, 1.0)
            self._shares[:, whole, index] = 1 - older
            if delay > whole:
                self._shares[:, whole + 1, index] = older
        self._static = _Static(system) if system.actuators else None
        lags = [0.0 if chain.lag is None else float(chain.lag.subs(system.values)) for chain in chains]
        self._steps = np.array(lags) / (period * np.diff(edges)[:, None])
        with np.errstate(divide="ignore"):
            self._decay = np.exp(-1 / self._steps)
        self._orders = [chain.order for chain in chains]
        self._lagged = np.zeros((max(self._orders, default=1), len(chains)))

    def take(self, command: Array) -> Array:
        """Hold a command (m,) from now on: (parts, m) effective inputs of this sample."""
        if self._static is not None:
            command = self._static(command)
        if len(self._past) == 1:
            driven = np.broadcast_to(command, (len(self._shares), len(command)))
        else:
            self._past[1:] = self._past[:-1].copy()
            self._past[0] = command
            driven = np.asarray(np.sum(self._shares * self._past, axis=1))
        return driven if not self._steps.any() else self._behind_lag(driven)

    def _behind_lag(self, driven: Array) -> Array:
        means = np.array(driven)
        for i, order in enumerate(self._orders):
            own = self._lagged[:order, i]
            for k, w in enumerate(driven[:, i]):
                if self._steps[k, i] == 0:
                    continue
                after = w + np.array(decayed(own - w, 1 / self._steps[k, i], self._decay[k, i]))
                means[k, i] = w - self._steps[k, i] * float(np.sum(after - own))
                own[:] = after
        return means


class _Static:
    """Gain, dead zone and saturation of all inputs, which commute with a delay; called in place, once a sample."""

    def __init__(self, system: System) -> None:
        w = casadi.SX.sym("w", len(system.inputs))
        names = symbol_values(system.values, (system.inputs, w))
        chains = [to_casadi(system.actuator(k).static(s), names) for k, s in enumerate(system.inputs)]
        function = casadi.Function("static", [w], [casadi.densify(casadi.vertcat(*chains))])
        self._given, self._acting = np.zeros(len(chains)), np.zeros(len(chains))
        buffer: Any
        buffer, self._trigger = function.buffer()
        given: Any = self._given
        acting: Any = self._acting
        buffer.set_arg(0, memoryview(given))
        buffer.set_res(0, memoryview(acting))
        self._buffer = buffer

    def __call__(self, command: Array) -> Array:
        """(m,) what acts behind the static parts of (m,) commands."""
        self._given[:] = command
        self._trigger()
        return self._acting.copy()


def edges_at_changes(system: System, period: float) -> Array:
    """The parts of a sample between which an input changes."""
    return np.array(sorted({0.0, 1.0} | {d - floor(d) for d in _delays(system, period)}))


def _delays(system: System, period: float) -> list[float]:
    """In samples, for each input."""
    return [float(system.actuator(k).delay.subs(system.values)) / period for k in range(len(system.inputs))]
