"""References as drives get them: moves with limited jerk between random positions, and sums of slow sines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SMOOTH_S = 0.04
"""Length of the moving average that makes the speed's corners round."""


def moves(rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float) -> NDArray[np.float64]:
    """Speeds of trapezoidal moves between random positions in ±stroke/2, with rests between them."""
    found: list[NDArray[np.float64]] = []
    at, total = 0.0, 0
    while total * dt < duration:
        top = speed * float(np.exp(rng.uniform(np.log(0.08), 0.0)))
        acceleration = speed * rng.uniform(2.0, 6.0)
        goal = rng.uniform(-stroke / 2, stroke / 2)
        distance = abs(goal - at)
        top = min(top, np.sqrt(distance * acceleration))
        if top <= 0:
            continue
        ramp, cruise = top / acceleration, distance / top - top / acceleration
        t = np.arange(0, 2 * ramp + cruise, dt)
        shape = np.clip(np.minimum(t / ramp, (2 * ramp + cruise - t) / ramp), 0, 1)
        shape *= distance / max(shape.sum() * dt, 1e-12)
        found += [np.sign(goal - at) * shape, np.zeros(round(rng.uniform(0.03, 0.4) / dt))]
        at, total = goal, total + len(t) + len(found[-1])
    return np.concatenate(found)[: round(duration / dt)]


def sines(rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float) -> NDArray[np.float64]:
    """Speeds of a sum of four sines that is zero at both ends, in ±stroke/2 and at most ``speed``."""
    t = np.arange(round(duration / dt)) * dt
    cycles = np.unique(np.round(duration * np.exp(rng.uniform(np.log(0.15), np.log(3.0), 4))).clip(1))
    position = sum(
        rng.uniform(0.3, 1.0) / c * np.sin(2 * np.pi * c * t / duration + rng.uniform(0, 2 * np.pi)) for c in cycles
    )
    position = position * np.minimum(1, np.minimum(t, t[::-1]) / 0.5) ** 2
    v = np.gradient(position, dt)
    scale = min(stroke / 2 / np.abs(position).max(), speed / np.abs(v).max())
    return np.asarray(scale * v)


def reference(
    rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position and speed, by sections of some seconds of moves or sines, each of which starts where the last ended."""
    parts, left = [], duration
    while left > 0.5:
        length = min(left, rng.uniform(3.0, 7.0))
        make = moves if rng.random() < 0.6 else sines
        part = make(rng, length, dt, stroke, speed)
        # A section of moves ends anywhere: return to the middle first.
        end = part.sum() * dt
        back = max(0.3, 2.5 * abs(end) / speed)
        t = np.arange(round(back / dt)) * dt
        parts += [part, -end / back * (1 - np.cos(2 * np.pi * t / back))]
        left -= length + back
    v = np.concatenate(parts)
    window = np.hanning(round(SMOOTH_S / dt) + 2)
    v = np.convolve(v, window / window.sum(), mode="same")
    return np.cumsum(v) * dt, v
