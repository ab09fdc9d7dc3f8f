"""The digital controller of a simulated machine: what it sees at a sample, and linear feedback from that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Signal = Callable[[float], Array]
"""t in s → a value for each coordinate or each input."""


class Sample(NamedTuple):
    """What a controller sees at t_k.

    Attributes:
        time: t_k, s.
        positions: (n,) as measured.
        velocities: (n,) as measured, or low-passed differences of the measured positions.
        estimates: (outputs,) latest of the observer, in its order; empty without one.
        sent: (m,) the command of the sample before, limited and with the cancelling input; zero at first.
        period: s since the controller's last sample.
    """

    time: float
    positions: Array
    velocities: Array
    estimates: Array
    sent: Array
    period: float


class Controller(Protocol):
    """A command at each sample."""

    def start(self) -> None:
        """Forget what earlier runs left behind."""

    def command(self, now: Sample) -> Array:
        """(m,) held until the next sample."""


@dataclass
class Feedback:
    """w = feed(t) + K_x (x_r − x) + K_v (v_r − v) + K_i ∫(x_r − x) dt: open loop, P, PD, PI, PID and state feedback.

    A PI controller of velocity is K_v and K_i with x_r the integral of v_r. An integral rests while the command last
    sent is at its limit and the error would push it further (K_i then has one coordinate an input).

    Attributes:
        inputs, coordinates: m and n.
        feed: t → (m,).
        reference: t → x_r (n,); zero if not given. velocity_reference: t → v_r (n,).
        position_gain, velocity_gain, integral_gain: K_x, K_v, K_i, each (m, n); zero if not given.
        limit: (m,) of the command, for the integral; the loop itself limits what is sent.
    """

    inputs: int
    coordinates: int
    feed: Signal | None = None
    reference: Signal | None = None
    velocity_reference: Signal | None = None
    position_gain: Array | None = None
    velocity_gain: Array | None = None
    integral_gain: Array | None = None
    limit: Array | None = None

    def __post_init__(self) -> None:
        """Refuse gains of another shape.

        Raises:
            ValueError: with the shape found and the one expected.
        """
        shape = (self.inputs, self.coordinates)
        for name in ("position_gain", "velocity_gain", "integral_gain"):
            gain = getattr(self, name)
            if gain is not None and np.shape(gain) != shape:
                raise ValueError(f"{name} of shape {np.shape(gain)}; expected {shape}, inputs by coordinates")
        self.start()

    def start(self) -> None:
        self._sum = np.zeros(self.inputs)

    def command(self, now: Sample) -> Array:
        w = np.zeros(self.inputs) if self.feed is None else np.asarray(self.feed(now.time), dtype=float)
        error = -now.positions if self.reference is None else self.reference(now.time) - now.positions
        if self.position_gain is not None:
            w = w + self.position_gain @ error
        if self.velocity_gain is not None:
            target = 0.0 if self.velocity_reference is None else self.velocity_reference(now.time)
            w = w + self.velocity_gain @ (target - now.velocities)
        if self.integral_gain is not None:
            push = self.integral_gain @ error
            if self.limit is not None:
                push = np.where((np.abs(now.sent) >= self.limit) & (push * now.sent > 0), 0.0, push)
            self._sum = self._sum + now.period * push
            w = w + self._sum
        return w


def sampled(values: Array, period: float) -> Signal:
    """A function of t from its values (N, …) at 0, period, 2 period …"""
    last = len(values) - 1
    return lambda t: np.asarray(values[min(round(t / period), last)])
