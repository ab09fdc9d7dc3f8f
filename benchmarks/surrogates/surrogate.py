"""Surrogates of a log: the same motion, the residual's size and colour, and no law between the two.

The force residual of the model that a diagnosis ends with is cut into blocks; each block gets a random sign, or all
are put into a random order; and that takes the place of the residual of the refitted model. (Shifted around within
itself, a block keeps its mean, and so a law over position that is slower than the block.) The change goes back into the
logged input, as the shared spike.py does it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual
from codegen.diagnosis.fit.signals import SHORTEST_TEST_S, smooth_motion
from codegen.logs import Log
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]
Way = Literal["signs", "order"]

WAYS: tuple[Way, ...] = ("signs", "order")
BLOCK_S = 1.0
"""Longer than the segments of a diagnosis: a disturbance may outlast one of those."""


def surrogate(
    log: Log,
    refit: System,
    way: Way,
    random: np.random.Generator,
    cutoff_hz: float | None = None,
    augmented: System | None = None,
) -> Log:
    """A surrogate of a log.

    Args:
        refit: the declared model with refitted values, which lacks nothing in the surrogate.
        cutoff_hz: of the low-pass on the residual; by default as a diagnosis chooses it.
        augmented: the model whose residual is cut and put in place of that of the refit; by default the refit. It has
            what a diagnosis credits, so that blocks cannot bring that along.
    """
    motion = smooth_motion(log, cutoff_hz, SHORTEST_TEST_S)
    used = Problem(refit, motion, {}).used
    residual, left = (
        np.where(used, inverse_dynamics_residual(system, motion), 0.0) for system in (refit, augmented or refit)
    )
    length = max(2, round(BLOCK_S / log.sample_time))
    changed = np.where(used, scrambled(left, length, way, random), 0.0)
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
    motion = smooth_motion(log, cutoff_hz, SHORTEST_TEST_S)
    slopes = [Matrix(system.force.diff(w)) for w in system.inputs]
    matrix = evaluate_forces(system, slopes, motion).transpose(1, 2, 0)
    return np.asarray((np.linalg.pinv(matrix) @ force[:, :, None])[:, :, 0])
