"""One mass with set-valued friction, integrated between events by SciPy: independent of the plants under test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mass:
    """m v' = force(w, x, v) − λ; |λ| up to level(speed, direction) against a direction of +1 or −1."""

    m: float
    force: Callable[[float, float, float], float]
    level: Callable[[float, float], float]


@dataclass(frozen=True)
class Rest:
    """The event of coming to rest, as ``solve_ivp`` asks for it.

    Attributes:
        direction: of the change of v. since: when the stretch began; at rest then is no event.
    """

    direction: float
    since: float
    terminal: bool = True

    def __call__(self, t: float, y: Array) -> float:
        return float(y[1]) if t > self.since + 1e-12 else -self.direction


def integrate(mass: Mass, time: Array, inputs: Array, x0: float, v0: float, delay: float = 0.0) -> tuple[Array, Array]:
    """x and v at ``time`` under commands held from t_k to t_(k+1), acting ``delay`` later (the first one before)."""
    marks = np.unique(np.concatenate([time, time + delay]))
    marks = marks[np.concatenate([[True], np.diff(marks) > 1e-12]) & (marks <= time[-1] + 1e-12)]
    state, path = np.array([x0, v0]), [np.array([x0, v0])]
    for begin, end in pairwise(marks):
        k = int(np.searchsorted(time + delay, (begin + end) / 2)) - 1
        state = _stretch(mass, float(inputs[max(k, 0)]), begin, end, state)
        if np.min(np.abs(time - end)) < 1e-12:
            path.append(state)
    return np.array(path)[:, 0], np.array(path)[:, 1]


def _stretch(mass: Mass, w: float, begin: float, end: float, state: Array) -> Array:
    """From one mark to the next under one input, from event to event."""
    now = begin
    while end - now > 1e-13:
        x, v = state
        if v == 0:
            drive = mass.force(w, x, 0.0)
            if -mass.level(0.0, -1.0) <= drive <= mass.level(0.0, 1.0):
                return state
        direction = float(np.sign(v)) if v != 0 else float(np.sign(mass.force(w, x, 0.0)))

        def rate(_: float, y: Array, s: float = direction) -> list[float]:
            return [y[1], (mass.force(w, y[0], y[1]) - s * mass.level(abs(y[1]), s)) / mass.m]

        rest = Rest(-direction, now)
        found = solve_ivp(rate, (now, end), state, "DOP853", events=rest, rtol=1e-10, atol=1e-12)
        state, now = found.y[:, -1], found.t[-1]
        if found.status == 1:
            state = np.array([state[0], 0.0])
    return state
