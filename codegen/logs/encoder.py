"""The measuring step of a position, seen in the data alone."""

from __future__ import annotations

import numpy as np

from codegen.logs.log import Array

NEAR_STEPS = 50
FEWEST = 20
SHARE_ON_LATTICE = 0.9


def smallest_step(position: Array) -> float:
    """The step on whose multiples the differences of neighbouring samples lie.

    Args:
        position: (N,) raw samples, before any resampling.

    Returns:
        The step in the position's unit, or 0 if the differences lie on no lattice, or are all far larger than it.
    """
    moves = np.abs(np.diff(position))
    rounding = 1e-14 * float(np.abs(position).max(initial=0.0))
    moves = moves[moves > rounding]
    if len(moves) < FEWEST:
        return 0.0
    step = float(moves.min())
    for _ in range(3):  # the smallest difference carries the rounding of the printed digits; a fit over more does not
        near = moves[moves < NEAR_STEPS * step]
        counts = np.maximum(np.round(near / step), 1)
        step = float(near.sum() / counts.sum())
    near = moves[moves < NEAR_STEPS * step]
    off = np.abs(near / step - np.round(near / step))
    if len(near) < FEWEST or np.mean(off < 0.1) < SHARE_ON_LATTICE:
        return 0.0
    return step
