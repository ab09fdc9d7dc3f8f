"""Parameters of the final fit with confidence intervals that do not trust the noise to be white."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from codegen.diagnosis.output_error import Shot, segment_weights

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
        inner = {name: k + j for j, name in enumerate(part.names)}
        k += len(part.names)
        intervals = {}
        for name, value in values.items():
            if name in part.positive or name == "load_fraction":
                ends = [part.outward_one(name, float(e[inner[name]])) for e in (low, high)]
                intervals[name] = (value, (ends[0], ends[1]))
            else:
                half = factor * float(deviation[inner[name]])
                intervals[name] = (value, (value - half, value + half))
        effects.append(intervals)
    return Estimate(levels, tuple(effects))


def standard_errors(shot: Shot) -> Array:
    """(p,) in the coordinates of the fit."""
    weights = segment_weights(shot.residual)
    weighted = shot.slopes * weights[:, None]
    bread = np.einsum("ask,bsk->ab", weighted, shot.slopes, optimize=True) + np.diag(shot.price)
    gradients = np.einsum("ask,sk->sa", weighted, shot.residual)
    meat = gradients.T @ gradients + np.diag(shot.price)
    segments, count = len(shot.residual), len(shot.theta)
    meat *= segments / max(segments - count, 1)
    size = np.sqrt(np.maximum(np.diag(bread), 1e-300))
    inverse = np.linalg.pinv(bread / np.outer(size, size), rcond=1e-12) / np.outer(size, size)
    return np.sqrt(np.maximum(np.diag(inverse @ meat @ inverse), 0.0))
