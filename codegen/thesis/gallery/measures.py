"""Measures of runs: distances, errors at rest, overshoot and noise, in SI.

A function of a figure's module that returns a ``Reading`` is the measure of a statement in ``claims/``, whose
``number:`` says what it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.friction import LAWS
from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec

Mask = NDArray[np.bool_]
SLIDES = 0.98
"""Share of its largest friction from which on a contact counts as sliding."""


@dataclass(frozen=True)
class Reading:
    """A measured number, with the numbers that it is computed from as (name, value) in ``unit``."""

    value: float
    parts: tuple[tuple[str, float], ...] = ()
    unit: str = ""


def rms(values: Array) -> float:
    """Root mean square; infinite if a value is not finite, NaN for no values."""
    if not len(values):
        return float("nan")
    if not np.isfinite(values).all():
        return float("inf")
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(np.square(values))))


def after(run: LoopRun, start: float) -> Mask:
    """Samples from ``start`` on, s."""
    return np.asarray(run.time >= start - 1e-9)


def position_error(run: LoopRun, ideal: LoopRun) -> Array:
    """Distance of the first coordinate from the ideal motion, (N,)."""
    path = np.interp(run.time, ideal.time, ideal.true_positions[:, 0])
    return np.asarray(run.true_positions[:, 0] - path)


def friction_error(run: LoopRun, coordinate: int = 0) -> Array:
    """F − F̂ on a coordinate, (N,)."""
    return np.asarray(run.friction[:, coordinate] - run.friction_estimate[:, coordinate])


def friction_level(spec: Spec, contact: int, speed: Array) -> Array:
    """Friction of a contact in steady sliding at speeds (N,); at speed 0 the breakaway force."""
    chosen = spec.contacts[contact]
    return LAWS[chosen.law].sliding_level(speed, {name: float(value) for name, value in chosen.parameters.items()})


def sliding(run: LoopRun, coordinate: int = 0, share: float = 0.02) -> Mask:
    """Samples at which a coordinate moves faster than a share of its top speed."""
    speed = np.abs(run.true_velocities[:, coordinate])
    return np.asarray(speed > share * np.nanmax(speed))


def missed_in_presliding(truth: Array, estimate: Array, level: float, chosen: Mask) -> float:
    """RMS error in presliding over the RMS friction there: near 1 if the estimate has no hysteresis."""
    presliding = (np.abs(truth) < SLIDES * level) & chosen
    return ratio(rms((truth - estimate)[presliding]), rms(truth[presliding]))


def since_reversal(run: LoopRun, half_period: float) -> Array:
    """Seconds since the square reference last jumped, (N,)."""
    return np.asarray(np.mod(run.time + 1e-9, half_period))


def hang_off(run: LoopRun, target: Array, half_period: float, start: float, end: float) -> float:
    """Mean distance to the reference over the last tenth of each half period between two times."""
    settled = since_reversal(run, half_period) > 0.9 * half_period
    chosen = settled & (run.time >= start) & (run.time < end)
    return float(np.mean(np.abs(run.true_positions[chosen, 0] - target[chosen])))


def overshoot(estimate: Array, truth: Array) -> float:
    """Largest magnitude of the estimate over that of the true values, minus 1."""
    return float(np.max(np.abs(estimate)) / np.max(np.abs(truth)) - 1)


def falling(values: Sequence[float], labels: Sequence[str], unit: str) -> Reading:
    """The largest ratio of a number to the one before it: below 1 if the numbers decrease."""
    return Reading(max(ratio(b, a) for a, b in pairwise(values)), tuple(zip(labels, values, strict=True)), unit)


def ratio(above: float, below: float) -> float:
    """A ratio; infinite over zero."""
    return above / below if below else float("inf")


def ripple(values: Array, run: LoopRun, window: float) -> float:
    """RMS of a signal about its running mean over ``window`` seconds, at the run's sample time."""
    length = max(2, round(window / float(run.time[1] - run.time[0])))
    mean = np.convolve(values, np.full(length, 1 / length), mode="valid")
    start = (length - 1) // 2
    return rms(values[start : start + len(mean)] - mean)
