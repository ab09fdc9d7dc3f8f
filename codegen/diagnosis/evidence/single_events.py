"""Single events of a force residual: periods of the cutoff in which it is far above the usual, as of a push."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import LEAST_ROWS, acting_force
from codegen.diagnosis.fit.drive import residual_without_levels
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.residual import Problem
from codegen.mechanics.system import System

FAR_ABOVE, OF_DRIVE = 10.0, 0.5
"""Least RMS residual in a period of the cutoff of an event: over that of the median period, and over that of the drive
force. Of 22 logs without an effect, training and held-out data, one reaches 0.3 of the drive force."""


def events_of(problem: Problem) -> tuple[int, ...]:
    """The middle sample of each event of the declared model, friction levels refitted, ascending.

    Periods in which the velocity changes its sign are left out: there friction whose sign changes one sample early
    leaves a large residual.
    """
    motion, system, found = problem.motion, problem.system, set[int]()
    for i, residual in enumerate(residual_without_levels(problem, system).T):
        sizes, usual, drive = _by_period(problem, residual, system, i)
        if drive > 0:
            far = np.flatnonzero((sizes >= FAR_ABOVE * usual) & (sizes >= OF_DRIVE * drive))
            found |= {int(e[len(e) // 2]) for e in _joined(far, max(2, motion.step(1)))}
    return tuple(sorted(found))


def _joined(places: NDArray[np.intp], gap: int) -> list[NDArray[np.intp]]:
    """Samples in groups that are more than ``gap`` samples apart."""
    return np.split(places, np.flatnonzero(np.diff(places) > gap) + 1) if len(places) else []


def _by_period(problem: Problem, residual: Array, system: System, i: int) -> tuple[Array, float, float]:
    """(N,) RMS of a residual of coordinate i in the period of the cutoff about each sample; the median; the RMS drive.

    The RMS is zero where not all of the period is used or where it has a reversal; all is zero if little is left.
    """
    motion, rows = problem.motion, problem.used[:, i]
    width = max(2, motion.step(1))
    turns = np.abs(np.diff(np.sign(motion.velocities[:, i]), prepend=0.0)) > 0
    used = rows & (_moving_sum(turns.astype(float), 2 * width + 1) < 0.5)
    whole = _moving_sum(used.astype(float), width) > width - 0.5
    if whole.sum() < LEAST_ROWS:
        return np.zeros(len(rows)), 0.0, 0.0
    sizes = np.sqrt(np.maximum(_moving_sum(np.where(used, residual, 0.0) ** 2, width), 0.0) / width) * whole
    return sizes, float(np.median(sizes[whole])), rms(acting_force(system, motion)[rows, i])


def _moving_sum(values: Array, width: int) -> Array:
    """(N,) sum over ``width`` samples about each, also where ``width`` is above N."""
    return np.asarray(np.convolve(values, np.ones(width))[(width - 1) // 2 :][: len(values)])
