"""Whether a motion has settled into a limit cycle, a sustained oscillation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WINDOWS = 3
PERIODS = 2
KEEPS = 0.95
HYSTERESIS = 0.25


@dataclass(frozen=True)
class LimitCycle:
    """An oscillation of one coordinate at steady state.

    Attributes:
        coordinate: its index.
        amplitude: half of peak to peak in the last window; infinite where the motion left all bounds.
        period: s; NaN where the motion left all bounds.
    """

    coordinate: int
    amplitude: float
    period: float


def limit_cycle(time: Array, positions: Array, floor: Array) -> LimitCycle | None:
    """The limit cycle that a run ends in, or None.

    The second half of the run is cut into three windows. A coordinate is in a limit cycle if in each window it goes
    through at least two periods, and its amplitude is at least ``floor`` and does not decay: that of the last window is
    95 % or more of that of the first. A period ends where the motion passes the middle of its swing upwards, after it
    was a quarter of the amplitude below. A machine at rest, or one that creeps, is in none.

    Args:
        time: (N,) s, evenly spaced.
        positions: (N, n); NaN from where the motion is not finite, which counts as a limit cycle.
        floor: (n,) amplitudes below which nothing counts, such as a few encoder steps.
    """
    if not np.isfinite(positions).all():
        return LimitCycle(int(np.argmin(np.isfinite(positions).all(axis=0))), float("inf"), float("nan"))
    late = time >= (time[0] + time[-1]) / 2
    found = [_of_coordinate(time[late], positions[late, i], i, float(floor[i])) for i in range(positions.shape[1])]
    cycles = [c for c in found if c is not None]
    return max(cycles, key=lambda c: c.amplitude / max(float(floor[c.coordinate]), 1e-300), default=None)


def at_rest(positions: Array, floor: Array) -> bool:
    """Whether no coordinate moved by ``floor`` in the last sixth of a run."""
    late = positions[-max(2, len(positions) // (2 * WINDOWS)) :]
    return bool(np.isfinite(late).all() and np.all(np.ptp(late, axis=0) < 2 * floor))


def _of_coordinate(time: Array, x: Array, index: int, floor: float) -> LimitCycle | None:
    amplitudes, periods = [], []
    for part, at in zip(np.array_split(x, WINDOWS), np.array_split(time, WINDOWS), strict=True):
        amplitude = float(np.ptp(part)) / 2
        if amplitude < floor or amplitude == 0:
            return None
        passes = _upward_passes(part - (part.max() + part.min()) / 2, HYSTERESIS * amplitude)
        if len(passes) < PERIODS + 1:
            return None
        amplitudes.append(amplitude)
        periods.append(float(at[passes[-1]] - at[passes[0]]) / (len(passes) - 1))
    if amplitudes[-1] < KEEPS * amplitudes[0]:
        return None
    return LimitCycle(index, amplitudes[-1], periods[-1])


def _upward_passes(x: Array, band: float) -> list[int]:
    """Where x passes zero upwards, each time after it was below −band."""
    passes, below = [], False
    for k, value in enumerate(x.tolist()):
        if value < -band:
            below = True
        elif below and value >= 0:
            passes.append(k)
            below = False
    return passes
