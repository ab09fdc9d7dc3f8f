"""Where the fit of each candidate starts: shapes tried on free runs near the refit, weights by least squares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from codegen.diagnosis.output_error import Shot, means, scales, segment_cost, segment_weights
from codegen.diagnosis.trial import Runner
from codegen.effects.start import Covered

Array = NDArray[np.float64]

TRIES, SIMPLEX = 200, 0.5
"""Of a simplex search: free runs at most, and its first size in logarithms."""


def starting_points(
    runner: Runner, base: Shot, raw: Sequence[Array], covered: Covered, most: int
) -> list[tuple[float, Array]]:
    """The best starts, as (cost by one linear step, theta of the trial), best first.

    Args:
        runner: of the trial with the part last.
        base: the fit without it. raw: slopes of its parameters, not projected.
        covered: by the log where the part sits.
    """
    part = runner.trial.parts[-1]
    effect = part.effect
    now = means(base.runner, base.runner.run(base.theta, base.offsets))
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *now.shape))
    found = []
    for shape in effect.starts(covered):
        if not effect.scaling:
            found.append(_beside(runner, base, moved, part.inward(shape)))
            continue
        columns = []
        for probe, size in effect.probes(shape, covered):
            theta = np.concatenate([base.theta, part.inward(probe)])
            slope = (now - means(runner, runner.run(theta, base.offsets))) / size
            columns.append(base.starts.project(slope, slope=True))
        step, cost = _solve(base, now, np.concatenate([moved, np.stack(columns)]), weights)
        values = effect.weighted(shape, step[len(base.theta) :].tolist())
        theta = np.concatenate([base.theta + step[: len(base.theta)], part.inward(values)])
        found.append((cost, theta))
    found.sort(key=lambda pair: pair[0])
    return found[:most]


def settled(runner: Runner, base: Shot, raw: Sequence[Array], theta: Array) -> tuple[float, Array]:
    """(cost, theta) after a simplex search over the parameters of the last part: for a loss too rough for slopes.

    Args:
        theta: where to start; the rest follows by one linear step each.
    """
    size = len(runner.trial.parts[-1].names)
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *base.residual.shape))
    first = theta[-size:]
    simplex = np.vstack([first, first + SIMPLEX * np.eye(size)])
    best = minimize(
        lambda inner: _beside(runner, base, moved, inner)[0],
        first,
        method="Nelder-Mead",
        options={"maxfev": TRIES, "initial_simplex": simplex},
    )
    return _beside(runner, base, moved, best.x)


def _beside(runner: Runner, base: Shot, moved: Array, inner: Array) -> tuple[float, Array]:
    """(cost, theta) of the last part at these values, all else by one linear step from the base.

    Args:
        moved: projected slopes of the base's parameters.
    """
    theta = np.concatenate([base.theta, inner])
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    step, cost = _solve(base, means(runner, runner.run(theta, base.offsets)), moved, weights)
    theta[: len(base.theta)] += step
    return cost, theta


def _solve(base: Shot, residual: Array, columns: Array, weights: Array) -> tuple[Array, float]:
    """(step, cost) of one linear step; the prior stays where the spec has it, wherever the base went."""
    flat = base.starts.project(residual)
    if not len(columns):
        return np.zeros(0), segment_cost(flat)
    scaled = (columns * weights).reshape(len(columns), -1)
    price, away = np.zeros(len(columns)), np.zeros(len(columns))
    price[: len(base.price)], away[: len(base.price)] = base.price, base.theta - base.centre
    matrix = scaled @ scaled.T + np.diag(price)
    size = scales(matrix)
    right = scaled @ (flat * weights).ravel() - price * away
    step = np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-9)[0] / size
    left = flat - np.tensordot(step, columns, axes=1)
    return step, segment_cost(left) + 0.5 * float((price * (away + step) ** 2).sum())
