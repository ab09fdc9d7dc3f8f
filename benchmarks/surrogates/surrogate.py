"""Surrogates of a log: the same motion, the residual's size and colour, and no law between the two.

The force that the effects of a diagnosis add is taken out everywhere, so that the declared model lacks nothing. What
its own residual then is, that of the model that the diagnosis ends with, is cut into blocks; each block gets a random
sign, or all are put into a random order. (Shifted around within itself, a block keeps its mean, and so a law over
position that is slower than the block.) The change goes into the logged input, as the shared spike.py does it.

Blocks fade into each other, and into what is there near a standstill and a reversal. The residual of a good model is
the noise of the measured position, M ë: its double integral stays small only if it is cut smoothly. A step in it is a
push, after which free runs leave the motion by tens of times the noise. So is the residual at a reversal if it is
moved: the low-passed jump of the friction stands against the sign of a smoothed speed there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, maximum_filter1d, minimum_filter1d

from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual, slip_velocities
from codegen.diagnosis.fit.signals import SHORTEST_TEST_S, Motion, smooth_motion
from codegen.logs import Log
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]
Way = Literal["signs", "order"]

WAYS: tuple[Way, ...] = ("signs", "order")
BLOCK_S = 1.0
"""Longer than the segments of a diagnosis: a disturbance may outlast one of those."""
FADE_PERIODS = 3.0
"""Duration of a fade in periods of the cutoff: longer than the correlation of the low-passed noise."""
REVERSAL_PERIODS = 1.0
"""Periods of the cutoff before and after a reversal at which the residual is not changed."""


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
    residual, left = (inverse_dynamics_residual(system, motion) for system in (refit, augmented or refit))
    length = max(2, round(BLOCK_S / log.sample_time))
    fade, near = (round(k / (motion.cutoff_hz * log.sample_time)) for k in (FADE_PERIODS, REVERSAL_PERIODS))
    moving = faded(Problem(refit, motion, {}).used & ~at_reversals(refit, motion, near), fade)
    change = moving * (scrambled(moving * left, length, fade, way, random) - left)
    return replace(log, inputs=log.inputs + input_change(refit, log, change + left - residual, cutoff_hz))


def scrambled(residual: Array, length: int, fade: int, way: Way, random: np.random.Generator) -> Array:
    """(N, n) blocks of a residual with random signs, or in a random order, faded into each other within ``fade``.

    All coordinates of a block alike. What does not fill a block at the end stays.
    """
    count = len(residual)
    whole = count // length
    block = np.minimum(np.arange(count) // length, whole)  # the rest is a block of its own
    if way == "signs":
        signs = np.append(random.choice((-1.0, 1.0), whole), 1.0)
        return residual * smoothed(signs[block], fade)[:, None]
    made = np.zeros_like(residual)
    for k, source in enumerate([*random.permutation(whole).tolist(), whole]):
        weight, shift = smoothed((block == k).astype(float), fade), (source - k) * length
        there = np.flatnonzero(weight)
        there = there[(there + shift >= 0) & (there + shift < count)]
        made[there] += weight[there, None] * residual[there + shift]
    return made


def at_reversals(system: System, motion: Motion, near: int) -> NDArray[np.bool_]:
    """(N, n) samples no further than ``near`` from a reversal of a contact that acts on the coordinate."""
    slip = slip_velocities(system, motion)
    turned = np.zeros(slip.shape, dtype=bool)
    turned[1:] = np.sign(slip[1:]) != np.sign(slip[:-1])
    about = maximum_filter1d(turned, 2 * near + 1, axis=0)
    acts = np.array(system.distribution.tolist()) != 0
    return np.asarray((about[:, None, :] & acts[None]).any(axis=2))


def faded(used: NDArray[np.bool_], fade: int) -> Array:
    """(N, n) 0 at samples that are not used, 1 further away than ``fade`` from these, and smooth in between."""
    within = minimum_filter1d(used.astype(float), 2 * (fade // 2) + 1, axis=0)
    return smoothed(within, fade)


def smoothed(values: Array, fade: int) -> Array:
    """Steps of values (N, …) made smooth: their mean over ``fade`` samples, with the weights of Hann's window."""
    window = np.hanning(2 * (fade // 2) + 3)[1:-1]
    return np.asarray(convolve1d(values, window / window.sum(), axis=0, mode="nearest"))


def input_change(system: System, log: Log, force: Array, cutoff_hz: float | None = None) -> Array:
    """(N, m) what the inputs must do more for these generalised forces, (N, n); forces without an input stay out."""
    motion = smooth_motion(log, cutoff_hz, SHORTEST_TEST_S)
    slopes = [Matrix(system.force.diff(w)) for w in system.inputs]
    matrix = evaluate_forces(system, slopes, motion).transpose(1, 2, 0)
    return np.asarray((np.linalg.pinv(matrix) @ force[:, :, None])[:, :, 0])
