"""Parameters of the final fit with confidence intervals that do not trust the noise to be white."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from codegen.diagnosis.output_error import Shot, scales, segment_weights

Array = NDArray[np.float64]

CONFIDENCE = 0.95

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values in SI with 95 % intervals.

    Attributes:
        moved: symbol name → value, interval, of friction levels and parameters with a tolerance.
        effects: for each part: parameter → value, interval.
    """

    moved: dict[str, tuple[float, Interval]]
    effects: tuple[dict[str, tuple[float, Interval]], ...]


def estimate(shot: Shot, other: Shot | None = None) -> Estimate:
    """The sandwich covariance over segments: the gradient of each counts as it is, whatever the colour of its noise.

    Args:
        other: the same fit on segments of another length; how far the two lie apart is taken as one more deviation.
    """
    trial = shot.runner.trial
    deviation = standard_errors(shot)
    if other is not None:
        deviation = np.hypot(deviation, other.theta - shot.theta)
    segments, count = len(shot.residual), len(shot.theta)
    factor = float(student.ppf(0.5 + CONFIDENCE / 2, max(segments - count, 3)))
    low, high = shot.theta - factor * deviation, shot.theta + factor * deviation
    moved, found = trial.split(shot.theta)
    below, above = trial.split(low), trial.split(high)
    levels = {
        s.name: (float(v), (float(a), float(b)))
        for s, v, a, b in zip(trial.moved, moved, below[0], above[0], strict=True)
    }
    effects = []
    k = len(trial.moved)
    for part, values in zip(trial.parts, found, strict=True):
        intervals = {}
        for j, (name, coordinate) in enumerate(zip(part.names, part.coordinates, strict=True), k):
            value, half = values[name], factor * float(deviation[j])
            ends = (coordinate.outward(float(low[j])), coordinate.outward(float(high[j])))
            intervals[name] = (value, ends if coordinate.curved else (value - half, value + half))
        k += len(part.names)
        effects.append(intervals)
    return Estimate(levels, tuple(effects))


def standard_errors(shot: Shot) -> Array:
    """(p,) in the coordinates of the fit."""
    weights = segment_weights(shot.residual)
    weighted = shot.slopes * weights[:, None]
    bread = np.einsum("ask,bsk->ab", weighted, shot.slopes, optimize=True) + np.diag(shot.price)
    gradients = np.einsum("ask,sk->sa", weighted, shot.residual)
    segments, count = len(shot.residual), len(shot.theta)
    meat = gradients.T @ gradients * (segments / max(segments - count, 1))
    # The declared values err by their tolerance, whatever weight the prior has beside a tempered likelihood.
    meat += np.diag(shot.price / shot.tempering)
    size = scales(bread)
    inverse = np.linalg.pinv(bread / np.outer(size, size), rcond=1e-12) / np.outer(size, size)
    return np.sqrt(np.maximum(np.diag(inverse @ meat @ inverse), 0.0))
