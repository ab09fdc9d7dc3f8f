"""Where the fit of each candidate starts: shapes tried on free runs near the refit, weights by least squares."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from codegen.diagnosis.output_error import Shot, means, segment_cost, segment_weights
from codegen.diagnosis.trial import CHAIN, STRUCTURE, Part, Runner
from codegen.effects import CATALOGUE
from codegen.effects.periodic import PHASE_NAME as PHASE
from codegen.effects.start import Covered

Array = NDArray[np.float64]

TRIES, SIMPLEX = 200, 0.5
"""Of a simplex search: free runs at most, and its first size in logarithms."""
SMALL = 1e-3
"""Size of a probe of a weight, in what would be a large effect."""


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
    shapes = CATALOGUE[part.kind].starts(covered)
    now = means(base.runner, base.runner.run(base.theta, base.offsets))
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *now.shape))
    found = []
    for shape in shapes:
        if _weighted(part) is None:
            found.append(_beside(runner, base, moved, part.inward(shape)))
            continue
        columns, recover = _columns(runner, base, part, shape, covered, now)
        step, cost = _solve(base, now, np.concatenate([moved, columns]), weights)
        values = recover(step[len(base.theta) :], shape)
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
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    right = scaled @ (flat * weights).ravel() - price * away
    step = np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-9)[0] / size
    left = flat - np.tensordot(step, columns, axes=1)
    return step, segment_cost(left) + 0.5 * float((price * (away + step) ** 2).sum())


def _weighted(part: Part) -> tuple[str, ...] | None:
    """The parameters that scale the effect, or None where it is tried at values of all of them."""
    if part.kind in CHAIN or part.kind in STRUCTURE:
        return None
    if part.size:
        return (part.size, PHASE)
    effect = CATALOGUE[part.kind]
    return tuple(p.name for p in effect.parameters if p not in effect.shapes)


def _columns(
    runner: Runner, base: Shot, part: Part, shape: Mapping[str, float], covered: Covered, now: Array
) -> tuple[Array, Callable[[Array, Mapping[str, float]], dict[str, float]]]:
    effect = CATALOGUE[part.kind]
    if part.size:
        size = part.size
        small = next(SMALL * covered.size(p.unit) for p in effect.parameters if p.name == size)
        probes = [dict(shape) | {size: small, PHASE: phase} for phase in (0.0, np.pi / 2)]
        steps = [small] * 2

        def recover(weights: Array, shape: Mapping[str, float]) -> dict[str, float]:
            return dict(shape) | {size: float(np.hypot(*weights)), PHASE: float(np.arctan2(weights[1], weights[0]))}
    else:
        scaling = [p for p in effect.parameters if p not in effect.shapes]
        zero = {p.name: float(p.neutral or 0.0) for p in scaling}
        steps = [SMALL * covered.size(p.unit) for p in scaling]
        probes = [dict(shape) | zero | {p.name: zero[p.name] + d} for p, d in zip(scaling, steps, strict=True)]

        def recover(weights: Array, shape: Mapping[str, float]) -> dict[str, float]:
            return dict(shape) | {p.name: zero[p.name] + float(w) for p, w in zip(scaling, weights, strict=True)}

    columns = []
    for probe, step in zip(probes, steps, strict=True):
        theta = np.concatenate([base.theta, part.inward(probe)])
        slope = (now - means(runner, runner.run(theta, base.offsets))) / step
        columns.append(base.starts.project(slope, slope=True))
    return np.stack(columns), recover
