"""Surrogates of a log: logs like it of a machine that is the declared model, so that no law is missing.

A bootstrap under the null hypothesis, by simulation of the fitted model with resampled residuals (Davison and Hinkley
1997, chapters 4 and 8). The declared model with fitted values follows the motion of the log under a position loop. A
disturbance acts on it that the log does not have: the force residual of the model that a diagnosis ends with, cut into
blocks, each with a random sign, or all in a random order. (Shifted around within itself, a block keeps its mean, and so
a law over position that is slower than the block.) Its noise of M a is left out; new noise of the sensors takes its
place. So noise, disturbance and motion are independent, and an effect's force is nowhere.

A surrogate with the measured motion, and the change of the force in the logged input, is none of that: the low-passed
force of an effect that is taken out leaves what it has above the cutoff and at reversals; a coordinate without an input
keeps its residual; and a residual of another sign is noise in the input that is correlated with the measured motion.

Blocks fade into each other, and away from standstills and reversals, since the residual of a good model is the noise
of the measured position, M ë: its double integral stays small only if it is cut smoothly.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, maximum_filter1d, minimum_filter1d

from codegen.base.errors import BadInput
from codegen.diagnosis.evidence.residual_regression import noise_share
from codegen.diagnosis.fit.record import position_noise
from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual, slip_velocities
from codegen.diagnosis.fit.signals import SHORTEST_TEST_S, Motion, smooth_motion
from codegen.diagnosis.verdict.separation import logged, loop_gains, measured
from codegen.logs import Log
from codegen.mechanics.system import Matrix, System
from codegen.simulate.controller import Feedback, sampled
from codegen.simulate.observed_loop import SampledLoop, run_loop

Array = NDArray[np.float64]
Way = Literal["signs", "order"]

WAYS: tuple[Way, ...] = ("signs", "order")
BLOCK_S = 1.0
"""Longer than the segments of a diagnosis: a disturbance may outlast one of those."""
FADE_PERIODS = 3.0
"""Duration of a fade in periods of the cutoff: longer than the correlation of the low-passed noise."""
REVERSAL_PERIODS = 1.0
"""Periods of the cutoff before and after a reversal without a disturbance: the residual there is that of the filter."""


def surrogate(
    log: Log,
    machine: System,
    way: Way,
    random: np.random.Generator,
    cutoff_hz: float | None = None,
    augmented: System | None = None,
) -> Log:
    """A surrogate of a log.

    Args:
        machine: the declared model with fitted values, which lacks nothing in the surrogate.
        cutoff_hz: of the low-pass on the residual; by default as a diagnosis chooses it.
        augmented: the model whose residual is cut and acts as a disturbance; by default ``machine``. It has what a
            diagnosis accepts, so that blocks cannot bring that along.

    Raises:
        BadInput: if the machine does not follow the motion.
    """
    motion, h = smooth_motion(log, cutoff_hz, SHORTEST_TEST_S), log.sample_time
    lacking, left = (inverse_dynamics_residual(system, motion) for system in (machine, augmented or machine))
    length = max(2, round(BLOCK_S / h))
    fade, near = (round(k / (motion.cutoff_hz * h)) for k in (FADE_PERIODS, REVERSAL_PERIODS))
    moving = faded(Problem(machine, motion, {}).used & ~at_reversals(machine, motion, near), fade)
    every = range(left.shape[1])
    noise = [noise_share(augmented or machine, motion, left[:, i], motion.usable, i) for i in every]  # of M a
    kept = np.sqrt(1 - np.array(noise))
    disturbance = input_change(machine, log, -scrambled(moving * left * kept, length, fade, way, random), cutoff_hz)
    position_gain, velocity_gain = loop_gains(machine, motion.cutoff_hz, motion.positions.mean(axis=0), h)
    loop = Feedback(
        len(machine.inputs),
        feedforward=sampled(log.inputs + input_change(machine, log, -lacking, cutoff_hz) + disturbance, h),
        reference=sampled(motion.positions, h),
        velocity_reference=sampled(motion.velocities, h),
        position_gain=position_gain,
        velocity_gain=velocity_gain,
    )
    run = run_loop(machine, SampledLoop(loop), h, log.size, (motion.positions[0], motion.velocities[0]))
    if not (np.isfinite(run.positions).all() and np.isfinite(run.inputs).all()):
        expected = "a log whose motion the model can follow under a position loop"
        raise BadInput(log.where, "a motion that the model with the fitted values leaves", expected, code="LOG009")
    seed = int(random.integers(2**31))
    positions = measured(log, position_noise(motion, log), run.positions, seed)
    return logged(log, positions, run.inputs - disturbance)


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
    """Flags (N, n) of samples no farther than ``near`` from a reversal of a contact that acts on the coordinate."""
    slip = slip_velocities(system, motion)
    turned = np.zeros(slip.shape, dtype=bool)
    turned[1:] = np.sign(slip[1:]) != np.sign(slip[:-1])
    about = maximum_filter1d(turned, 2 * near + 1, axis=0)
    acts = np.array(system.distribution.tolist()) != 0
    return np.asarray((about[:, None, :] & acts[None]).any(axis=2))


def faded(used: NDArray[np.bool_], fade: int) -> Array:
    """Weights (N, n): 0 at samples that are not used, 1 farther than ``fade`` from these, and smooth in between."""
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
