"""What drives a plant over a log: time, step length and the effective input of every substep."""

from __future__ import annotations

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.mechanics.actuator import decayed
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.system import System

Array = NDArray[np.float64]
NEAR_LIMIT = 1 - 1e-9
"""Share of a limit up to which a rounded saturation is inverted; at the limit the input would be infinite."""


def drive_columns(system: System, time: Array, inputs: Array, substeps: int) -> Array:
    """One row per sample: (t from the start, h, w of substep 1, …, w of the last substep).

    Commands are held from t_k to t_(k+1) and reach the plant through the input's actuator; behind a delay or a lag a
    substep gets the exact mean. Before the log the first command is taken to have been held.

    Args:
        system: for its ``actuators``.
        time: (N,) seconds, increasing.
        inputs: (N, m) commands in SI.
        substeps: steps in one sample.

    Returns:
        (N, 2 + m substeps); the last row is as long as the one before it.

    Raises:
        ValueError: if the shapes do not fit or time does not increase.
    """
    m = len(system.inputs)
    if inputs.shape != (len(time), m):
        raise ValueError(f"inputs of shape {inputs.shape}; expected {(len(time), m)}")
    lengths = np.diff(time, append=2 * time[-1] - time[-2]) if len(time) > 1 else np.ones(1)
    if not np.all(lengths > 0):
        raise ValueError("time does not increase everywhere")
    steps = lengths / substeps
    effective = np.empty((len(time), substeps, m))
    starts = (time[:, None] + steps[:, None] * np.arange(substeps)).ravel()
    for index in range(m):
        signal = _Effective(system, index, time, inputs[:, index])
        if signal.has_memory:
            ends = starts + np.repeat(steps, substeps)
            mean = (signal.integral(ends) - signal.integral(starts)) / np.repeat(steps, substeps)
            effective[:, :, index] = mean.reshape(-1, substeps)
        else:
            effective[:, :, index] = signal.held[:, None]
    return np.hstack([(time - time[0])[:, None], steps[:, None], effective.reshape(len(time), -1)])


def mean_about_samples(system: System, index: int, time: Array, commands: Array) -> Array:
    """What acts about each t_k, (N,): the mean over a sample before and a sample after it.

    Of the effective input where it lags or has a threshold; else the command that gain, dead zone and saturation turn
    into that mean. A command that steps through a dead zone has a mean that says nothing about the mean effective
    input.
    """
    signal = _Effective(system, index, time, commands)
    reach = np.gradient(time)
    mean = (signal.integral(time + reach) - signal.integral(time - reach)) / (2 * reach)
    chain = system.actuator(index)
    if not chain.has_inverse:
        return np.asarray(mean)
    gain, width = (float(e.subs(system.values)) for e in (chain.gain, chain.dead_zone))
    for limit in reversed(chain.limits):
        mean = _before_limit(mean, *(float(e.subs(system.values)) for e in (limit.height, limit.rounding)))
    return np.asarray((mean + np.sign(mean) * width) / gain) if gain != 0 else commands


class _Effective:
    """One input's effective value over a log: static(command) held, then the lag, then the delay, which commute."""

    def __init__(self, system: System, index: int, time: Array, commands: Array) -> None:
        chain = system.actuator(index)
        w = system.inputs[index]
        self.held = _static(system, chain.static(w), w, commands)
        self.has_memory = chain.has_memory
        self._time, self._delay = time, float(chain.delay.subs(system.values))
        self._lag = None if chain.lag is None else float(chain.lag.subs(system.values))
        steps = np.diff(time)
        area = self.held[:-1] * steps
        if self._lag is not None:
            self._errors = _errors(self.held, steps / self._lag, chain.order)
            area = area + self._behind(np.arange(len(steps)), steps)
        self._area = np.concatenate([[0.0], np.cumsum(area)])

    def integral(self, at: Array) -> Array:
        """∫ from time[0] to ``at``; the first value before the log, the last command after it."""
        late = at - self._delay
        k = np.clip(np.searchsorted(self._time, late, side="right") - 1, 0, None)
        since = late - self._time[k]
        total = self._area[k] + self.held[k] * since
        if self._lag is not None:
            total = total + self._behind(k, np.maximum(since, 0.0))
        return np.asarray(total)

    def _behind(self, k: NDArray[np.intp], since: Array) -> Array:
        """∫ of the last lag's distance from the held command, over these times since sample k.

        tau y_i' = y_(i−1) − y_i gives it as −tau Σ (e_i(t) − e_i(0)).
        """
        assert self._lag is not None
        begun = [e[k] for e in self._errors]
        ratio = since / self._lag
        ended = decayed(begun, ratio, np.exp(-ratio))
        return np.asarray(-self._lag * sum(after - before for after, before in zip(ended, begun, strict=True)))


def _static(system: System, expression: sympy.Expr, w: sympy.Symbol, commands: Array) -> Array:
    if expression == w:
        return commands
    at = casadi.SX.sym("w")
    function = casadi.Function("static", [at], [to_casadi(expression, symbol_values(system.values) | {w: at})])
    return np.asarray(function(commands[None, :]).full().ravel(), dtype=float)


def _before_limit(w: Array, height: float, rounding: float) -> Array:
    """The input that a rounded saturation turns into ``w``: w √((L² − (1 − r²) w²)/(L² − w²)).

    A sharp corner leaves what is within the limit as it is.
    """
    if rounding == 0.0:
        return w
    within = np.clip(w, -NEAR_LIMIT * height, NEAR_LIMIT * height)
    return np.asarray(within * np.sqrt((height**2 - (1 - rounding**2) * within**2) / (height**2 - within**2)))


def _errors(held: Array, ratios: Array, order: int) -> list[Array]:
    """Each lag's distance from the command held from each sample on, settled at the first.

    Args:
        ratios: sample lengths over the time constant.
    """
    errors = np.zeros((len(held), order))
    jumps, decays = np.diff(held), np.exp(-ratios)
    for k, (ratio, decay) in enumerate(zip(ratios, decays, strict=True)):
        errors[k + 1] = np.array(decayed(errors[k], ratio, decay)) - jumps[k]
    return list(errors.T)
