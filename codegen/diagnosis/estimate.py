"""Parameter estimates of the final fit with 95 % confidence intervals by the sandwich covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from codegen.diagnosis.output_error import Fit, scales, segment_weights

Array = NDArray[np.float64]

CONFIDENCE = 0.95
BLOCKS = 16
"""Consecutive parts of the log, each with the same number of segments, whose gradients are summed."""

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimates in SI with 95 % intervals.

    Attributes:
        moved: symbol name → value, interval, of friction levels and parameters with a tolerance.
        effects: for each part: parameter → value, interval.
    """

    moved: dict[str, tuple[float, Interval]]
    effects: tuple[dict[str, tuple[float, Interval]], ...]


def estimate(fit: Fit, other: Fit | None = None) -> Estimate:
    """Estimates and intervals of a fit; the sandwich covariance over segments is valid for coloured noise.

    Errors of the model differ between parts of the log but hardly between neighbouring segments, which then are not
    independent. So the interval is the larger of that over segments and that over ``BLOCKS`` parts of the log.

    Args:
        other: the same fit on segments of another length; the difference between the two is added to the deviation.
    """
    trial = fit.runner.trial
    moved_by = np.zeros(len(fit.theta)) if other is None else other.theta - fit.theta
    segments, count = len(fit.residual), len(fit.theta)
    clusters = [(0, segments - count), *([(BLOCKS, BLOCKS - 1)] if segments > BLOCKS else [])]
    half_widths = np.max(
        [
            float(student.ppf(0.5 + CONFIDENCE / 2, max(freedom, 3))) * np.hypot(standard_errors(fit, number), moved_by)
            for number, freedom in clusters
        ],
        axis=0,
    )
    low, high = fit.theta - half_widths, fit.theta + half_widths
    moved, found = trial.split(fit.theta)
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
            value, half = values[name], float(half_widths[j])
            ends = (coordinate.outward(float(low[j])), coordinate.outward(float(high[j])))
            intervals[name] = (value, ends if coordinate.curved else (value - half, value + half))
        k += len(part.names)
        effects.append(intervals)
    return Estimate(levels, tuple(effects))


def standard_errors(fit: Fit, clusters: int = 0) -> Array:
    """(p,) standard errors in the coordinates of the fit, by the cluster-robust sandwich covariance.

    Args:
        clusters: number of groups of consecutive segments, 0 for each segment by itself; errors of different groups
            are taken as independent.
    """
    clusters = clusters or len(fit.residual)
    weights = segment_weights(fit.residual)
    weighted = fit.slopes * weights[:, None]
    bread = np.einsum("ask,bsk->ab", weighted, fit.slopes, optimize=True) + np.diag(fit.prior_precision)
    by_segment = np.einsum("ask,sk->sa", weighted, fit.residual)
    gradients = np.array([part.sum(axis=0) for part in np.array_split(by_segment, clusters)])
    segments, count = len(fit.residual), len(fit.theta)
    small_sample = segments / max(segments - count, 1) * (1.0 if clusters == segments else clusters / (clusters - 1))
    meat = gradients.T @ gradients * small_sample
    # The prior's gradient has the variance of the tolerances, whatever the tempering of the likelihood.
    meat += np.diag(fit.prior_precision / fit.tempering)
    size = scales(bread)
    inverse = np.linalg.pinv(bread / np.outer(size, size), rcond=1e-12) / np.outer(size, size)
    return np.sqrt(np.maximum(np.diag(inverse @ meat @ inverse), 0.0))
