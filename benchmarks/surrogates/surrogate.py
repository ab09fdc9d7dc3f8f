"""Surrogates of a log: the same motion, the residual's size and colour, and no law between the two.

The force residual of the refitted model is cut into blocks; each block gets a random sign, or all
are put into a random order. (Shifted around within itself, a block keeps its mean, and so a law over position that is
slower than the block.) The change goes back into the logged input, as the shared spike.py does it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.balance import evaluate_forces
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.signals import smooth_motion
from codegen.logs import Log
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]
Way = Literal["signs", "order"]

WAYS: tuple[Way, ...] = ("signs", "order")
BLOCK_S = 1.0
"""Longer than the segments of a diagnosis: a disturbance may outlast one of those."""


def surrogate(log: Log, refit: System, way: Way, random: np.random.Generator, cutoff_hz: float | None = None) -> Log:
    """A surrogate of a log.

    Args:
        refit: the declared model with refitted values, whose residual it is.
        cutoff_hz: of the low-pass on the residual; by default as a diagnosis chooses it.
    """
    motion = smooth_motion(log, cutoff_hz)
    used = Problem(refit, motion, {}).masks.rows
    residual = np.where(used, inverse_dynamics_residual(refit, motion), 0.0)
    length = max(2, round(BLOCK_S / log.sample_time))
    changed = np.where(used, scrambled(residual, length, way, random), 0.0)
    return replace(log, inputs=log.inputs + input_change(refit, log, changed - residual, cutoff_hz))


def scrambled(residual: Array, length: int, way: Way, random: np.random.Generator) -> Array:
    """(N, n) blocks of a residual with random signs, or in a random order; all coordinates of a block alike."""
    whole = len(residual) // length
    blocks = [residual[k * length : (k + 1) * length] for k in range(whole)]
    if way == "signs":
        blocks = [block * random.choice((-1.0, 1.0)) for block in blocks]
    else:
        blocks = [blocks[k] for k in random.permutation(whole)]
    return np.concatenate([*blocks, residual[whole * length :]])


def input_change(system: System, log: Log, force: Array, cutoff_hz: float | None = None) -> Array:
    """(N, m) what the inputs must do more for these generalised forces, (N, n); forces without an input stay out."""
    motion = smooth_motion(log, cutoff_hz)
    slopes = [Matrix(system.force.diff(w)) for w in system.inputs]
    matrix = evaluate_forces(system, slopes, motion).transpose(1, 2, 0)
    return np.asarray((np.linalg.pinv(matrix) @ force[:, :, None])[:, :, 0])
