"""A machine with one set-valued contact, integrated by SciPy between events; equations straight from effects.md.

Independent of the plants under test: no code of the package runs here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """y = (x, v, …), with friction λ on v.

    Attributes:
        rate: (t, y, w, λ) → y'.
        drive: (t, y, w) → the λ that keeps v where it is.
        level: (t, y, w, s) → the bound on λ against a slip of sign s; None where λ follows from y alone.
        force: (t, y, w) → λ, where there is no level.
    """

    rate: Callable[[float, Array, float, float], list[float]]
    drive: Callable[[float, Array, float], float]
    level: Callable[[float, Array, float, float], float] | None
    force: Callable[[float, Array, float], float] | None = None


def integrate(truth: Truth, time: Array, commands: Array, start: Array) -> Array:
    """y at ``time`` (N, states) under commands held from t_k to t_(k+1)."""
    state, path = np.array(start, dtype=float), [np.array(start, dtype=float)]
    for (begin, end), w in zip(pairwise(time), commands, strict=False):
        state = (
            _smooth(truth, float(w), begin, end, state) if truth.force else _held(truth, float(w), begin, end, state)
        )
        path.append(state)
    return np.array(path)


def _smooth(truth: Truth, w: float, begin: float, end: float, state: Array) -> Array:
    assert truth.force is not None

    def rate(t: float, y: Array) -> list[float]:
        return truth.rate(t, y, w, truth.force(t, y, w))

    return solve_ivp(rate, (begin, end), state, "DOP853", rtol=1e-9, atol=1e-12).y[:, -1]


def _held(truth: Truth, w: float, begin: float, end: float, state: Array) -> Array:
    now, turn = begin, 0.0
    while end - now > 1e-13:
        mode = turn or float(np.sign(state[1]))
        if mode == 0:
            drive = truth.drive(now, state, w)
            stays = -truth.level(now, state, w, -1.0) <= drive <= truth.level(now, state, w, 1.0)
            mode = 0.0 if stays else float(np.sign(drive))
        turn = 0.0
        found = _until_event(truth, w, now, end, state, mode)
        state, now = found.y[:, -1].copy(), found.t[-1]
        if found.status == 1:
            if mode == 0:
                turn = 1.0 if len(found.t_events[0]) else -1.0
            state[1] = 0.0
    return state


def _until_event(truth: Truth, w: float, now: float, end: float, state: Array, mode: float):
    def up(t: float, y: Array) -> float:
        return truth.drive(t, y, w) - truth.level(t, y, w, 1.0)

    def down(t: float, y: Array) -> float:
        return truth.drive(t, y, w) + truth.level(t, y, w, -1.0)

    def rest(t: float, y: Array) -> float:
        return float(y[1]) if t > now + 1e-12 else mode

    def rate(t: float, y: Array) -> list[float]:
        return truth.rate(t, y, w, truth.drive(t, y, w) if mode == 0 else mode * truth.level(t, y, w, mode))

    up.direction, down.direction, rest.direction = 1, -1, -mode
    events = [up, down] if mode == 0 else [rest]
    for event in events:
        event.terminal = True
    return solve_ivp(rate, (now, end), state, "DOP853", events=events, rtol=1e-9, atol=1e-12)
