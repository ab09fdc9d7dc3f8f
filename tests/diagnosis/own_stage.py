"""A stage whose mass, friction and load may change in time, simulated apart from the project's own simulator."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from codegen.logs import Log, read_log
from codegen.spec import Spec


def simulated(
    folder: Path,
    spec: Spec,
    mass: Callable[[float], float] = lambda t: 2.0,
    level: Callable[[float, float], float] = lambda t, v: 4.5,
    push: Callable[[float], float] = lambda t: 0.0,
    viscous: float = 6.0,
    duration: float = 24.0,
) -> Log:
    """A stage under its position loop, moved from place to place: implicit steps of 0.2 ms, set-valued friction."""
    draw = np.random.default_rng(5)
    places, sub, step = draw.uniform(-0.2, 0.2, size=40), 10, 2e-4
    x = v = w = known = 0.0
    rows = []
    for k in range(round(duration / step)):
        t = k * step
        if k % sub == 0:
            move, since = divmod(t, 2.0)
            s = min(1.0, since)
            shape, rate = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
            a, b = places[int(move)], places[int(move) + 1]
            read = round((x + 5e-6 * draw.normal()) / 2e-6) * 2e-6
            speed, known = (read - known) / (sub * step), read
            w = 4000 * (a + (b - a) * shape - read) + 120 * ((b - a) * rate - speed)
            rows.append((t, read, w))
        sliding = v + step * (w + push(t) - viscous * v) / mass(t)
        v = float(np.sign(sliding)) * max(0.0, abs(sliding) - step * level(t, v) / mass(t))
        x += step * v
    path = folder / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="t,x,w", comments="", fmt="%.9g")
    return read_log(path, spec)
