"""Output-error fits by multiple shooting: Gauss–Newton over parameters, the start of every segment eliminated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.side_by_side import side_by_side
from codegen.diagnosis.trial import Runner

Array = NDArray[np.float64]

KEPT = 40
"""Means of the residual kept for each segment."""
STEP = 1e-4
HUGE = 1e6
WITHIN = 3.0
"""Prior standard deviations that a parameter with a tolerance may move: what lies beyond is an effect, not a refit."""
AT_END = 0.999
"""Share of the way to a limit from which on a parameter counts as being there."""
WIDE = 20.0
MANY = 12
"""More parameters with a tolerance than this, such as an arm's, have their slopes taken once in a fit: forces are
linear in masses and inertias, which move little."""
SPEED_SHARE = 0.005
"""How far a start may be off: in noise of the position, in the 95 % speed."""


@dataclass(frozen=True, eq=False)
class Shot:
    """An output-error fit.

    Attributes:
        theta: (p,) the trial's vector. offsets: (S, 2n) of the segments' starts.
        residual: (S, K n) means of measured less predicted over the noise of a mean, less what the starts can take.
        slopes: (p, S, K n) of the prediction by theta, projected alike.
        price: (p,) prior weight of each parameter beside this likelihood; centre: (p,) where the prior has it.
        limited: (p,) whether the fit ended at the end of what a parameter may do: of the prior, or of its reach.
        tempering: share of the residuals that count as independent, by which ``price`` was divided.
    """

    runner: Runner
    theta: Array
    offsets: Array
    residual: Array
    slopes: Array
    starts: Starts
    price: Array
    centre: Array
    limited: NDArray[np.bool_]
    tempering: float

    @property
    def by_segment(self) -> Array:
        """(S,) squared residual."""
        return np.asarray((self.residual**2).sum(axis=1))

    @property
    def cost(self) -> float:
        return segment_cost(self.residual) + 0.5 * float((self.price * (self.theta - self.centre) ** 2).sum())

    @property
    def samples(self) -> int:
        """Residuals less what the starts take."""
        segments, kept = self.residual.shape
        return int(segments * (kept - self.starts.slopes.shape[2]))


def scales(matrix: Array) -> Array:
    """(p,) roots of the diagonal of a normal matrix; 1 for a parameter that changes nothing, which then stays."""
    diagonal = np.diag(matrix)
    return np.where(diagonal > 0, np.sqrt(np.maximum(diagonal, 0.0)), 1.0)


def segment_losses(residual: Array) -> Array:
    """(S,) −log-likelihood of each segment whose own scale is unknown above the noise: K/2·log(1 + RSS/K).

    A segment that starts in the wrong state, or that holds what no model of the list explains, weighs no more than a
    constant; where all are alike it is least squares.
    """
    count = residual.shape[1]
    return np.asarray(0.5 * count * np.log1p((residual**2).sum(axis=1) / count))


def segment_weights(residual: Array) -> Array:
    """(S,) weights of least squares with the gradient of ``segment_losses``."""
    return np.asarray(1 / (1 + (residual**2).mean(axis=1)))


def segment_cost(residual: Array) -> float:
    return float(segment_losses(residual).sum())


def means(runner: Runner, predicted: Array) -> Array:
    """Measured less predicted, in means over groups of samples, over the noise of such a mean: (S, K n)."""
    record = runner.record
    with np.errstate(over="ignore", invalid="ignore"):
        error = (record.targets - predicted) / record.of_starts(record.noise)[:, None]
        group = max(1, record.length // KEPT)
        kept = record.length // group
        error = error[:, : kept * group].reshape(len(error), kept, group, -1).mean(axis=2) * np.sqrt(group)
    flat = error.reshape(len(error), -1)
    return np.asarray(np.clip(np.nan_to_num(flat, nan=HUGE, posinf=HUGE, neginf=-HUGE), -HUGE, HUGE))


def state_slopes(runner: Runner, theta: Array, offsets: Array) -> Starts:
    """What the start state of each segment does to its prediction."""
    n = offsets.shape[1] // 2
    record = runner.record
    noise = record.of_starts(record.noise)
    base = means(runner, runner.run(theta, offsets))
    duration = runner.record.length * runner.record.sample_time

    def slope(k: int) -> Array:
        size = 3 * noise[:, k % n] / (1.0 if k < n else duration)
        moved = offsets.copy()
        moved[:, k] += size
        return np.asarray((base - means(runner, runner.run(theta, moved))) / size[:, None])

    slopes = np.stack(side_by_side(slope, range(2 * n)), axis=2)
    speed = record.of_starts(record.top_speed)
    width = np.hstack([WIDE * noise, np.maximum(WIDE * noise / duration, SPEED_SHARE * speed)])
    normal = np.einsum("skp,skq->spq", slopes, slopes) + width[:, :, None] ** -2.0 * np.eye(2 * n)
    return Starts(slopes, np.linalg.solve(normal, slopes.transpose(0, 2, 1)), width)


@dataclass(frozen=True, eq=False)
class Starts:
    """The start states of the segments, to be eliminated.

    Attributes:
        slopes: (S, K n, 2n) of the prediction by them.
        solver: (S, 2n, K n) from a residual to the shift that lowers it most, held by a wide prior.
    """

    slopes: Array
    solver: Array
    width: Array

    def shift(self, residual: Array) -> Array:
        return np.asarray(np.clip(np.matmul(self.solver, residual[..., None])[..., 0], -3 * self.width, 3 * self.width))

    def project(self, values: Array, slope: bool = False) -> Array:
        """Values (S, K n) less what the starts can take."""
        shift = np.matmul(self.solver, values[..., None]) if slope else self.shift(values)[..., None]
        return np.asarray(values - np.matmul(self.slopes, shift)[..., 0])


def fit(
    runner: Runner,
    theta: Array,
    offsets: Array,
    starts: Starts,
    price: Array,
    centre: Array,
    rounds: int,
    known: Sequence[Array] = (),
    scale: Array | None = None,
    reach: Array | None = None,
    tempering: float = 1.0,
    within: float = WITHIN,
) -> Shot:
    """Gauss–Newton from ``theta``, with step control.

    Args:
        offsets, starts: of the segments and their slopes, as ``state_slopes`` gives them.
        price, centre: prior.
        rounds: at most.
        known: raw slopes to use for the first parameters in place of differences.
        scale: size of each parameter, for differences and the longest step.
        reach: how far each may go from where it starts.
        tempering: share of the residuals that count as independent, by which ``price`` was divided.
        within: prior standard deviations that a parameter may move.
    """
    first, farthest = theta, np.full(len(theta), np.inf) if reach is None else reach
    bound = np.where(price > 0, within / np.sqrt(np.maximum(tempering * price, 1e-300)), np.inf)
    theta = np.clip(theta, centre - bound, centre + bound)
    sizes = np.maximum(np.abs(theta), 1e-3) if scale is None else scale
    now = means(runner, runner.run(theta, offsets))
    damping = 1e-6
    slopes: list[Array] = []
    for turn in range(rounds + 1):
        flat = starts.project(now)
        cost = segment_cost(flat) + 0.5 * float((price * (theta - centre) ** 2).sum())
        taken: dict[int, Array] = dict(enumerate(known))
        if turn and (price > 0).sum() > MANY:
            taken |= {int(k): slopes[k] for k in np.flatnonzero(price > 0)}
        slopes = _slopes(runner, theta, offsets, now, sizes, taken)
        columns = np.stack([starts.project(s, slope=True) for s in slopes]) if slopes else np.zeros((0, *flat.shape))
        if turn == rounds or not slopes:
            break
        weighted = columns * segment_weights(flat)[:, None]
        matrix = weighted.reshape(len(weighted), -1) @ columns.reshape(len(columns), -1).T + np.diag(price)
        right = np.einsum("ask,sk->a", weighted, flat) - price * (theta - centre)
        size = scales(matrix)
        improved = False
        for _ in range(6):
            step = np.linalg.solve(matrix / np.outer(size, size) + damping * np.eye(len(size)), right / size) / size
            longest = 2.0 * np.maximum(sizes, np.abs(theta))
            moved = np.clip(theta + np.clip(step, -longest, longest), first - farthest, first + farthest)
            moved = np.clip(moved, centre - bound, centre + bound)
            step = moved - theta
            left = now - np.einsum("a,ask->sk", step, np.stack(slopes))
            shift = starts.shift(left)
            trial = means(runner, runner.run(moved, offsets + shift))
            new = segment_cost(starts.project(trial)) + 0.5 * float((price * (moved - centre) ** 2).sum())
            if new < cost:
                improved = True
                break
            damping = max(damping, 1e-4) * 10
        if not improved:
            break
        damping = max(damping / 10, 1e-6)
        theta, offsets, now = moved, offsets + shift, trial
        if cost - new < 1e-2 + 1e-4 * cost:
            break
    flat = starts.project(now)
    limited = (np.abs(theta - first) >= AT_END * farthest) | (np.abs(theta - centre) >= AT_END * bound)
    return Shot(runner, theta, offsets, flat, columns, starts, price, centre, limited, tempering)


def _slopes(
    runner: Runner, theta: Array, offsets: Array, now: Array, sizes: Array, taken: Mapping[int, Array]
) -> list[Array]:
    """By every parameter; those ``taken`` are known."""
    missing = [k for k in range(len(theta)) if k not in taken]
    found = side_by_side(lambda k: _slope(runner, theta, offsets, now, k, sizes[k]), missing)
    known = {**taken, **dict(zip(missing, found, strict=True))}
    return [known[k] for k in range(len(theta))]


def _slope(runner: Runner, theta: Array, offsets: Array, now: Array, k: int, size: float) -> Array:
    moved = theta.copy()
    step = STEP * max(size, 1e-12)
    moved[k] += step
    return np.asarray((now - means(runner, runner.run(moved, offsets))) / step)


def raw_slopes(shot: Shot) -> list[Array]:
    """Slopes (S, K n) of the prediction by every parameter, the starts' part left in."""
    now = means(shot.runner, shot.runner.run(shot.theta, shot.offsets))
    sizes = np.maximum(np.abs(shot.theta), 1e-3)
    return _slopes(shot.runner, shot.theta, shot.offsets, now, sizes, {})


def again(
    shot: Shot, rounds: int, scale: Array | None = None, reach: Array | None = None, within: float = WITHIN
) -> Shot:
    """Polish with fresh slopes of the starts; the fit as it was where that does not help."""
    starts = state_slopes(shot.runner, shot.theta, shot.offsets)
    prior = shot.price, shot.centre
    new = fit(shot.runner, shot.theta, shot.offsets, starts, *prior, rounds, (), scale, reach, shot.tempering, within)
    return new if new.cost < shot.cost else shot
