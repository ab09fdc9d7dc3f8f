"""The actuator chain between a logged command and the input that acts: delay, gain, dead zone, saturation, lag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.signal import lfilter

from codegen.diagnosis.numpy_form import numpy_function
from codegen.mechanics.actuator import decayed
from codegen.mechanics.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """The stages of one input in the order of effects.md; the defaults change nothing.

    Attributes:
        delay: s. gain: 1. width: of the dead zone, input's unit.
        thresholds: up to which nothing passes, input's unit.
        tau, order: time constant of so many equal lags in series, s.
        limits: (height in the input's unit, rounding) of each saturation.
    """

    delay: float = 0.0
    gain: float = 1.0
    width: float = 0.0
    tau: float = 0.0
    thresholds: tuple[float, ...] = ()
    limits: tuple[tuple[float, float], ...] = ()
    order: int = 1

    def act(self, command: Array, sample_time: float, substeps: int) -> Array:
        """The mean effective input over each substep, (N substeps,), of a command (N,) held from t_k to t_(k+1)."""
        h = sample_time / substeps
        w = np.repeat(command, substeps)
        if self.delay != 0.0:
            w = _late(w, self.delay / h)
        w = self.gain * w
        if self.width != 0.0:
            w = np.sign(w) * np.maximum(np.abs(w) - self.width, 0.0)
        for threshold in self.thresholds:
            w = np.where(np.abs(w) > threshold, w, 0.0)
        for height, rounding in self.limits:
            w = _limited(w, height, rounding)
        return _lagged(w, self.tau / h, self.order) if self.tau > 0.0 else w


class Chains:
    """The actuator chains of all inputs of a system as functions of the parameters of a fit."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        """Args:
        symbols: whose values ``act`` is given, in order.
        """
        actuators = [system.actuator(i) for i in range(len(system.inputs))]
        self._shapes = [(len(a.thresholds), len(a.limits), a.order) for a in actuators]
        self._numbers = numpy_function([e for a in actuators for e in a.numbers], symbols, system.values)
        self._last: tuple[Array, tuple[float, ...], Array] | None = None

    def act(self, commands: Array, numbers: Array, sample_time: float, substeps: int) -> Array:
        """(N substeps, m) mean effective inputs over each substep, of commands (N, m) held from t_k to t_(k+1)."""
        values = (*map(float, self._numbers(*numbers)), sample_time, substeps)
        last = self._last
        if last is not None and last[0] is commands and last[1] == values:  # most steps of a fit move no actuator
            return last[2]
        fields, columns = iter(values), []
        for i, (thresholds, limits, order) in enumerate(self._shapes):
            delay, gain, width, tau = (next(fields) for _ in range(4))
            passed = tuple(next(fields) for _ in range(thresholds))
            pairs = tuple((next(fields), next(fields)) for _ in range(limits))
            chain = Chain(delay, gain, width, tau, passed, pairs, order)
            columns.append(chain.act(commands[:, i], sample_time, substeps))
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


def _lagged(w: Array, steps: float, order: int) -> Array:
    """Equal first-order lags of held values in series, exact (``decayed``), and the last one's mean over each substep.

    With h = T/steps, the mean of the last is w − steps Σ (y_i(h) − y_i(0)), since tau y_i' = y_(i−1) − y_i.

    Args:
        steps: time constant over the substep.
    """
    decay, mean = float(np.exp(-1.0 / steps)), w
    errors: list[Array] = []
    for _ in range(order):
        driven = decayed([*errors, np.zeros_like(w)], 1 / steps, decay)[-1] + (1 - decay) * w
        end, _ = lfilter([1.0], [1.0, -decay], driven, zi=np.array([decay * w[0]]))
        before = np.concatenate([[w[0]], end[:-1]])
        errors.append(before - w)
        mean = mean - steps * (end - before)
    return mean
