"""Starting values of candidates: shapes on a grid by free-run simulation, weights by linear least squares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from codegen.diagnosis.output_error import Fit, mean_residuals, scales, segment_cost, segment_weights
from codegen.diagnosis.trial import Runner
from codegen.effects.start import Covered

Array = NDArray[np.float64]

TRIES, SIMPLEX = 120, 0.5
"""Of a simplex search: most free runs, and its initial size in logarithms; Gauss–Newton steps follow."""


def starting_points(
    runner: Runner, base: Fit, raw: Sequence[Array], covered: Covered, most: int
) -> list[tuple[float, Array]]:
    """The best starting values, as (cost after one linear step, theta of the trial), best first.

    Args:
        runner: of the trial with the part last.
        base: the fit without it. raw: slopes by its parameters, before projection.
        covered: by the log where the part acts.
    """
    part = runner.trial.parts[-1]
    effect = part.effect
    now = base.unprojected
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *now.shape))
    found = []
    for shape in effect.starts(covered):
        if not effect.scaling:
            found.append(_with_values(runner, base, moved, part.inward(shape)))
            continue
        columns = []
        for probe, size in effect.probes(shape, covered):
            theta = np.concatenate([base.theta, part.inward(probe)])
            slope = (now - mean_residuals(runner, runner.run(theta, base.offsets))) / size
            columns.append(base.starts.project(slope, slope=True))
        step, cost = _solve(base, now, np.concatenate([moved, np.stack(columns)]), weights)
        values = effect.weighted(shape, step[len(base.theta) :].tolist())
        theta = np.concatenate([base.theta + step[: len(base.theta)], part.inward(values)])
        found.append((cost, theta))
    found.sort(key=lambda pair: pair[0])
    return list({theta.tobytes(): (cost, theta) for cost, theta in found[:most]}.values())  # each once


def simplex_search(runner: Runner, base: Fit, raw: Sequence[Array], theta: Array) -> tuple[float, Array]:
    """(cost, theta) by Nelder–Mead over the parameters of the last part, where the loss is not smooth.

    Args:
        theta: start; the other parameters follow by one linear step for each evaluation.
    """
    size = len(runner.trial.parts[-1].names)
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *base.residual.shape))
    first = theta[-size:]
    simplex = np.vstack([first, first + SIMPLEX * np.eye(size)])
    best = minimize(
        lambda inner: _with_values(runner, base, moved, inner)[0],
        first,
        method="Nelder-Mead",
        options={"maxfev": TRIES, "initial_simplex": simplex},
    )
    return _with_values(runner, base, moved, best.x)


def _with_values(runner: Runner, base: Fit, moved: Array, inner: Array) -> tuple[float, Array]:
    """(cost, theta) with these values of the last part, all other parameters by one linear step from the base.

    Args:
        moved: projected slopes by the base's parameters.
    """
    theta = np.concatenate([base.theta, inner])
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    step, cost = _solve(base, mean_residuals(runner, runner.run(theta, base.offsets)), moved, weights)
    theta[: len(base.theta)] += step
    return cost, theta


def _solve(base: Fit, residual: Array, columns: Array, weights: Array) -> tuple[Array, float]:
    """(step, cost) of one linear least-squares step with the prior."""
    flat = base.starts.project(residual)
    if not len(columns):
        return np.zeros(0), segment_cost(flat)
    scaled = (columns * weights).reshape(len(columns), -1)
    prior_precision, away = np.zeros(len(columns)), np.zeros(len(columns))
    prior_precision[: len(base.prior_precision)], away[: len(base.prior_precision)] = (
        base.prior_precision,
        base.theta - base.centre,
    )
    matrix = scaled @ scaled.T + np.diag(prior_precision)
    size = scales(matrix)
    right = scaled @ (flat * weights).ravel() - prior_precision * away
    step = np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-9)[0] / size
    left = flat - np.tensordot(step, columns, axes=1)
    return step, segment_cost(left) + 0.5 * float((prior_precision * (away + step) ** 2).sum())
