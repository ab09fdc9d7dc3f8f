"""Where a fit starts: values of shape parameters from what a log covers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Covered:
    """What a log covers at the place of an effect; SI.

    Attributes:
        duration, sample_time: s.
        top_speed: 95 % quantile of the speed of the coordinate, or of the contact's slip.
        top_input: 95 % quantile of the input's size.
        span: distance from the lowest to the highest position.
        stiffness: force over displacement at which the declared inertia swings as fast as the log can show.
        periods: asked for only where it is needed: distances after which the residual repeats itself.
    """

    duration: float
    sample_time: float
    top_speed: float
    top_input: float = 1.0
    span: float = 1.0
    stiffness: float = 1.0
    periods: Callable[[], Sequence[float]] = tuple


Start = Callable[[Covered], Sequence[float]]


def speeds(covered: Covered) -> Sequence[float]:
    """From a hundredth of the top speed up to it."""
    return tuple(np.geomspace(max(0.01 * covered.top_speed, 1e-9), max(covered.top_speed, 2e-9), 12))


def periods(covered: Covered) -> Sequence[float]:
    """Those that stand out in the residual over position."""
    return tuple(covered.periods())


def delays(covered: Covered) -> Sequence[float]:
    """From a quarter of a sample to 50 ms or eight samples."""
    h = covered.sample_time
    return tuple(np.geomspace(0.25 * h, max(0.05, 8 * h), 14))


def lags(covered: Covered) -> Sequence[float]:
    """From half a sample to a quarter of a second or sixteen samples."""
    h = covered.sample_time
    return tuple(np.geomspace(0.5 * h, max(0.25, 16 * h), 14))


def slow_times(covered: Covered) -> Sequence[float]:
    """From a twentieth of the log to twice its length: slower is a straight line, faster is another effect."""
    return tuple(np.geomspace(0.05 * covered.duration, 2 * covered.duration, 10))


def inputs(covered: Covered) -> Sequence[float]:
    """From a fiftieth of the top input to nearly all of it."""
    return tuple(np.geomspace(0.02 * covered.top_input, 0.95 * covered.top_input, 14))


def stiffnesses(covered: Covered) -> Sequence[float]:
    """Down from the stiffest that the log can show by a factor of ten thousand."""
    return tuple(np.geomspace(1e-4 * covered.stiffness, covered.stiffness, 14))


def gaps(covered: Covered) -> Sequence[float]:
    """From a hundred-thousandth to a tenth of the way."""
    return tuple(np.geomspace(1e-5 * covered.span, 0.1 * covered.span, 13))


def dampings(covered: Covered) -> Sequence[float]:
    """A light one: a fiftieth of the stiffness at a tenth of the sample rate."""
    return (0.02 * covered.stiffness * covered.sample_time / (0.2 * np.pi),)


def shares(covered: Covered) -> Sequence[float]:
    """Small, half and large."""
    return (0.25, 0.5, 0.75)
