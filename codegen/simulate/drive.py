"""Actuator models: effective inputs from commands, averaged over each step of a plant; by log or by sample."""

from math import ceil, floor

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.mechanics.actuator import Actuator, decayed
from codegen.mechanics.casadi_form import function_of, in_place
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import System

NEAR_LIMIT = 1 - 1e-9
"""Share of a limit up to which a rounded saturation is inverted; at the limit its inverse is infinite."""


class Chains:
    """The actuators of all inputs of a system, as functions of parameters, such as those of a fit."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        """Numeric functions of the actuators' parameters.

        ``symbols``: parameters whose values are an argument of ``act``, in order.
        """
        chains = [system.actuator(i) for i in range(len(system.inputs))]
        self._chains = [_Chain(a, w, symbols, system) for a, w in zip(chains, system.inputs, strict=True)]
        self._numbers = numpy_function([e for a in chains for e in a.numbers], symbols, system.values)
        self._last: tuple[Array, tuple[float, ...], Array] | None = None

    def act(self, commands: Array, numbers: Array, sample_time: float, substeps: int) -> Array:
        """Mean effective inputs over each substep, (N substeps, m), of commands (N, m) held from t_k to t_(k+1).

        Before the log the command is assumed to equal the first one.
        """
        values = (*map(float, self._numbers(*numbers)), sample_time, substeps)
        last = self._last
        if last is not None and last[0] is commands and last[1] == values:  # most steps of a fit change no actuator
            return last[2]
        inputs = np.empty((len(commands) * substeps, len(self._chains)))  # no column of a machine that swings freely
        for i, chain in enumerate(self._chains):
            inputs[:, i] = chain.act(commands[:, i], numbers, sample_time, substeps)
        self._last = commands, values, inputs
        return inputs


class _Chain:
    """One actuator: its static part (gain, dead zone, saturation), then delay and lag, on a held command."""

    def __init__(self, chain: Actuator, w: sympy.Symbol, symbols: tuple[sympy.Symbol, ...], system: System) -> None:
        static = chain.static(w)
        self._static = None if static == w else numpy_function([static], (w, *symbols), system.values)
        self._memory = numpy_function([chain.delay, chain.lag or sympy.S.Zero], symbols, system.values)
        self._order = chain.order

    def act(self, command: Array, numbers: Array, sample_time: float, substeps: int) -> Array:
        h = sample_time / substeps
        if self._static is not None:
            with np.errstate(divide="ignore", invalid="ignore"):  # a fit may try a rounding of 1
                command = np.broadcast_to(self._static(command, *numbers)[0], command.shape)
        w = np.repeat(command, substeps)
        delay, tau = map(float, self._memory(*numbers))
        if delay != 0.0:
            w = _delayed(w, delay / h)
        return _lagged(w, tau / h, self._order) if tau > 0.0 else w


class MeanInput:
    """One effective input averaged over the samples before and after each t_k, as a function of parameters.

    If the static part of the actuator has an inverse, the result is the command that gives this mean. The mean of the
    command itself would be wrong: it is not the mean effective input where the command steps through a dead zone.
    """

    def __init__(self, system: System, index: int, symbols: tuple[sympy.Symbol, ...] = ()) -> None:
        """``symbols``: parameters whose values are an argument of ``at``, in order."""
        chain = system.actuator(index)
        self._chain, self._has_inverse = _Chain(chain, system.inputs[index], symbols, system), chain.has_inverse
        limits = [(limit.height, limit.rounding) for limit in reversed(chain.limits)]
        stages = [chain.gain, chain.dead_zone, *(e for limit in limits for e in limit)]
        self._stages = numpy_function(stages, symbols, system.values)

    def at(self, commands: Array, sample_time: float, numbers: Array) -> Array:
        """(N,) of the commands (N,) with these values of the symbols."""
        after = self._chain.act(commands, numbers, sample_time, 1)
        mean = (np.concatenate([after[:1], after[:-1]]) + after) / 2
        if not self._has_inverse:
            return np.asarray(mean)
        gain, width, *limits = map(float, self._stages(*numbers))
        for height, rounding in zip(limits[::2], limits[1::2], strict=True):
            mean = _before_limit(mean, height, rounding)
        return np.asarray((mean + np.sign(mean) * width) / gain) if gain != 0 else commands


def _before_limit(w: Array, height: float, rounding: float) -> Array:
    """Inverse of a rounded saturation, w √((L² − (1 − r²) w²)/(L² − w²)), of height L and rounding r; w for r = 0."""
    if rounding == 0.0:
        return w
    within = np.clip(w, -NEAR_LIMIT * height, NEAR_LIMIT * height)
    return np.asarray(within * np.sqrt((height**2 - (1 - rounding**2) * within**2) / (height**2 - within**2)))


def _delayed(w: Array, steps: float) -> Array:
    """Held values delayed by a number of substeps, also fractional; before the log the value is the first one."""
    steps = float(np.clip(steps, -len(w), len(w)))
    whole = int(np.floor(steps))
    share = steps - whole
    padded = np.concatenate([np.full(max(whole, 0) + 1, w[0]), w, np.full(max(-whole, 0), w[-1])])
    first = 1 + max(whole, 0) - whole
    return np.asarray((1 - share) * padded[first : first + len(w)] + share * padded[first - 1 : first - 1 + len(w)])


def _lagged(w: Array, steps: float, order: int) -> Array:
    """Output of equal first-order lags in series for held values w, exact, averaged over each substep.

    tau y_i' = y_(i−1) − y_i, so the mean of the last is w − steps Σ (y_i(h) − y_i(0)). ``steps``: time constant tau
    over the substep h.
    """
    from scipy.signal import lfilter  # its import takes a second, which is saved for machines without a lag

    decay, mean = float(np.exp(-1.0 / steps)), w
    errors: list[Array] = []
    for _ in range(order):
        driven = decayed([*errors, np.zeros_like(w)], 1 / steps, decay)[-1] + (1 - decay) * w
        end, _ = lfilter([1.0], [1.0, -decay], driven, zi=np.array([decay * w[0]]))
        before = np.concatenate([[w[0]], end[:-1]])
        errors.append(before - w)
        mean = mean - steps * (end - before)
    return mean


class HeldInput:
    """The effective inputs of a System, sample by sample, averaged over parts of each sample; zero before the first.

    The means are exact, also in a part in which a delayed command changes, except that a lag is driven by the mean of
    such a part.
    """

    def __init__(self, system: System, period: float, edges: Array) -> None:
        """Weights of the past commands in the mean over each part of a sample, from the delays.

        ``edges``: (parts + 1,) limits of the parts of a sample, from 0 to 1.
        """
        chains = [system.actuator(k) for k in range(len(system.inputs))]
        delays = [float(chain.delay.subs(system.values)) / period for chain in chains]
        self._past = np.zeros((1 + max((ceil(d) for d in delays), default=0), len(delays)))
        self._shares = np.zeros((len(edges) - 1, *self._past.shape))
        for index, delay in enumerate(delays):
            whole = floor(delay)
            older = np.clip((delay - whole - edges[:-1]) / np.diff(edges), 0.0, 1.0)
            self._shares[:, whole, index] = 1 - older
            if delay > whole:
                self._shares[:, whole + 1, index] = older
        self._act = None
        if system.actuators:
            static = sympy.Matrix([chain.static(w) for chain, w in zip(chains, system.inputs, strict=True)])
            self._given, self._acting = np.zeros(len(chains)), np.zeros(len(chains))
            function = function_of(static, system.inputs, system.values)
            self._buffer, self._act = in_place(function, [self._given], [self._acting])
        lags = [0.0 if chain.lag is None else float(chain.lag.subs(system.values)) for chain in chains]
        self._steps = np.array(lags) / (period * np.diff(edges)[:, None])
        with np.errstate(divide="ignore"):
            self._decay = np.exp(-1 / self._steps)
        self._has_lag = bool(self._steps.any())
        self._orders = [chain.order for chain in chains]
        self._held = np.empty((len(edges) - 1, len(chains)))
        self._lagged = np.zeros((max(self._orders, default=1), len(chains)))

    def take(self, command: Array) -> Array:
        """Hold a command (m,) from now on; effective inputs of this sample, (parts, m), valid until the next call."""
        if self._act is not None:  # gain, dead zone and saturation, which commute with a delay
            self._given[:] = command
            self._act()
            command = self._acting.copy()
        if len(self._past) == 1:
            driven = self._held
            driven[:] = command
        else:
            self._past[1:] = self._past[:-1].copy()
            self._past[0] = command
            driven = np.asarray(np.sum(self._shares * self._past, axis=1))
        return self._behind_lag(driven) if self._has_lag else driven

    def _behind_lag(self, driven: Array) -> Array:
        """Outputs of the lags for the inputs (parts, m), averaged over each part; their states are advanced."""
        means = np.array(driven)
        for i, order in enumerate(self._orders):
            own = self._lagged[:order, i].tolist()  # numbers: of one or two an array takes five times as long
            parts = zip(driven[:, i].tolist(), self._steps[:, i].tolist(), self._decay[:, i].tolist(), strict=True)
            for k, (w, steps, decay) in enumerate(parts):
                if steps == 0:
                    continue
                after = [w + e for e in decayed([y - w for y in own], 1 / steps, decay)]
                means[k, i] = w - steps * sum(new - old for new, old in zip(after, own, strict=True))
                own = after
            self._lagged[:order, i] = own
        return means
