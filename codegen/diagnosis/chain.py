"""The actuator chain between a logged command and the input that acts: delay, gain, dead zone, saturation, lag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.signal import lfilter

from codegen.diagnosis.numpy_form import numpy_function
from codegen.mechanics.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """The stages of one input in the order of effects.md; the defaults change nothing.

    Attributes:
        delay: s. gain: 1. width: of the dead zone, input's unit. tau: s.
        limits: (height in the input's unit, rounding) of each saturation.
    """

    delay: float = 0.0
    gain: float = 1.0
    width: float = 0.0
    tau: float = 0.0
    limits: tuple[tuple[float, float], ...] = ()

    def act(self, command: Array, sample_time: float, substeps: int) -> Array:
        """The mean effective input over each substep, (N substeps,), of a command (N,) held from t_k to t_(k+1)."""
        h = sample_time / substeps
        w = np.repeat(command, substeps)
        if self.delay != 0.0:
            w = _late(w, self.delay / h)
        w = self.gain * w
        if self.width != 0.0:
            w = np.sign(w) * np.maximum(np.abs(w) - self.width, 0.0)
        for height, rounding in self.limits:
            w = _limited(w, height, rounding)
        return _lagged(w, self.tau / h) if self.tau > 0.0 else w


class Chains:
    """The actuator chains of all inputs of a system as functions of the parameters of a fit."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        """Args:
        symbols: whose values ``act`` is given, in order.
        """
        actuators = [system.actuator(i) for i in range(len(system.inputs))]
        self._limits = [len(a.limits) for a in actuators]
        self._numbers = numpy_function([e for a in actuators for e in a.numbers], symbols, system.values)
        self._last: tuple[Array, tuple[float, ...], Array] | None = None

    def act(self, commands: Array, numbers: Array, sample_time: float, substeps: int) -> Array:
        """(N substeps, m) mean effective inputs over each substep, of commands (N, m) held from t_k to t_(k+1)."""
        values = (*map(float, self._numbers(*numbers)), sample_time, substeps)
        last = self._last
        if last is not None and last[0] is commands and last[1] == values:  # most steps of a fit move no actuator
            return last[2]
        fields, columns = iter(values), []
        for i, limits in enumerate(self._limits):
            delay, gain, width, tau = (next(fields) for _ in range(4))
            pairs = tuple((next(fields), next(fields)) for _ in range(limits))
            columns.append(Chain(delay, gain, width, tau, pairs).act(commands[:, i], sample_time, substeps))
        inputs = np.ascontiguousarray(np.column_stack(columns))
        self._last = commands, values, inputs
        return inputs


def _limited(w: Array, height: float, rounding: float) -> Array:
    """Saturated input; equation in effects/saturation.py."""
    if rounding == 0.0:
        return np.clip(w, -height, height)
    steep = np.sqrt(1 - rounding**2)
    corner, width = height * steep, height * rounding
    return np.asarray((np.hypot(w + corner, width) - np.hypot(w - corner, width)) / (2 * steep))


def _late(w: Array, steps: float) -> Array:
    """Held values delayed by a number of substeps, which may be fractional; before the log the first value is held."""
    steps = float(np.clip(steps, -len(w), len(w)))
    whole = int(np.floor(steps))
    share = steps - whole
    padded = np.concatenate([np.full(max(whole, 0) + 1, w[0]), w, np.full(max(-whole, 0), w[-1])])
    first = 1 + max(whole, 0) - whole
    return np.asarray((1 - share) * padded[first : first + len(w)] + share * padded[first - 1 : first - 1 + len(w)])


def _lagged(w: Array, steps: float) -> Array:
    """First-order lag of held values, exact, and its mean over each substep."""
    decay = float(np.exp(-1.0 / steps))
    end, _ = lfilter([1 - decay], [1.0, -decay], w, zi=np.array([decay * w[0]]))
    before = np.concatenate([[w[0]], end[:-1]])
    return np.asarray(w + (before - w) * steps * (1 - decay))
