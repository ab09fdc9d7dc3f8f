"""Output-error fits by multiple shooting: Gauss–Newton over the parameters, segment start states eliminated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.parallel import in_parallel
from codegen.diagnosis.fit.linear import scales, solved
from codegen.diagnosis.fit.trial import Part, Runner, Trial
from codegen.mechanics.system import System

STEP, FINE_STEP = 1e-4, 1e-6
"""Steps for slopes, over the size of a parameter: of a fit, and of its covariance."""
LEAST_PART = 1e-3
"""Least size of a parameter in differences, over its scale: a smaller step is lost in the rounding of the runs."""
LEAST_DAMPING, RAISED_DAMPING = 1e-6, 1e-4
"""Levenberg–Marquardt damping of the first step, and the least one that is raised, tenfold, after a rejected step."""
MOST_TRIALS = 6
"""Most dampings that are tried for one step."""
HUGE = 1e6
BLOCKS = 8
"""Number of blocks of neighbouring segments, each held out in turn."""
WITHIN = 3.0
"""Prior standard deviations that a toleranced parameter may move at most; a larger deviation is an effect."""
FAR_START = 3.0
"""RMS residual of a segment, in noise, above which its measured start state is tried again."""
AT_END = 0.999
"""Share of the distance to a limit from which on a parameter counts as limited."""
WIDE = 20.0
UNKNOWN = 10.0
"""Standard deviation, in sizes of a parameter, of the weak prior in cross-validation: an estimate without one block is
drawn to the estimate from all blocks."""
MANY = 12
"""Number of toleranced parameters above which slopes are computed once a fit: those of an arm, linear in forces."""
SPEED_SHARE = 0.005
"""Prior deviations of a start state: ``WIDE`` times the noise; of its velocity at least this share of the top speed."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Gaussian prior and limits of a fit's parameters, (p,).

    Attributes:
        precision: (p, p) inverse prior covariance over ``tempering``, the share of independent residuals.
        deviation: prior standard deviations; infinite for a parameter without a prior.
        size: of each parameter, for the longest step.
        least: smallest value, 0 for a friction level; free runs do not simulate negative friction.
        scale: of each parameter, in its unit, whatever its value; 0 where ``size`` is never too small.
    """

    precision: Array
    deviation: Array
    centre: Array
    size: Array
    reach: Array
    least: Array
    tempering: float = 1.0
    within: float = WITHIN
    scale: Array | float = 0.0

    @property
    def differenced(self) -> Array:
        """(p,) sizes for differences: of a parameter near zero ``LEAST_PART`` of its scale."""
        return np.maximum(self.size, LEAST_PART * np.asarray(self.scale))

    @cached_property
    def bound(self) -> Array:
        """Largest distance from the centre."""
        return np.asarray(self.within * self.deviation)

    def clip(self, theta: Array) -> Array:
        return np.maximum(np.clip(theta, self.centre - self.bound, self.centre + self.bound), self.least)

    def blocked(self, theta: Array, right: Array) -> NDArray[np.bool_]:
        """Parameters at their smallest value that the descent direction ``right`` would lower."""
        return np.asarray((theta <= self.least) & (right < 0))

    def limited(self, theta: Array, first: Array) -> NDArray[np.bool_]:
        """Whether parameters are at a limit: of the prior, or of their reach from the fit's start."""
        at_reach = np.abs(theta - first) >= AT_END * self.reach
        return np.asarray(at_reach | (np.abs(theta - self.centre) >= AT_END * self.bound))

    def cost(self, theta: Array) -> float:
        return 0.5 * float((theta - self.centre) @ self.slope(theta))

    def slope(self, theta: Array) -> Array:
        """(p,) derivative of the cost."""
        return np.asarray(self.precision @ (theta - self.centre))


@dataclass(frozen=True, eq=False)
class Fit:
    """An output-error fit, or one of the force residual with the same fields (``ForceFits``).

    Attributes:
        theta: (p,) the trial's vector.
        offsets: (S, 2n) of the segments' start states.
        unprojected: (S, K n) averages of measured less predicted, over their noise.
        residual: ``unprojected`` after regression on the start states.
        slopes: (p, S, K n) of the prediction by theta, after the same regression.
        limited: (p,) whether the fit ended at a limit of the parameter.
        of_forces: whether the residual is one of forces, which no free run of ``runner`` gives.
    """

    runner: Runner
    theta: Array
    offsets: Array
    unprojected: Array
    residual: Array
    slopes: Array
    starts: Starts
    prior: Prior
    limited: NDArray[np.bool_]
    of_forces: bool = False

    @property
    def trial(self) -> Trial:
        return self.runner.trial

    @property
    def values(self) -> tuple[Array, list[dict[str, float]]]:
        """Refitted values, and the parameters of each effect."""
        return self.trial.split(self.theta)

    @property
    def part(self) -> Part:
        """The effect that was added last."""
        return self.trial.parts[-1]

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters of the effect that was added last."""
        return self.values[1][-1]

    @cached_property
    def model(self) -> System:
        return self.trial.model(*self.values)

    @property
    def by_segment(self) -> Array:
        """(S,) sum of squared residuals."""
        return np.asarray((self.residual**2).sum(axis=1))

    @property
    def cost(self) -> float:
        return segment_cost(self.residual) + self.prior.cost(self.theta)

    @property
    def prior_nats(self) -> float:
        """−log of the prior density at the values with a tolerance, 0 at the declared ones; without tempering."""
        return self.prior.tempering * self.prior.cost(self.theta)

    @cached_property
    def held_out_losses(self) -> Array:
        """(S,) cross-validated loss of each segment, under the fit to the other blocks by one Gauss–Newton step.

        A weak prior (``UNKNOWN``) keeps a parameter that the other blocks do not determine. One at its limit stays
        there, as in the fit. The prediction after the step is linear in it, or simulated where the loss of an effect is
        not smooth.
        """
        free = np.flatnonzero(~self.limited)
        residual, slopes, prior = self.residual, self.slopes[free], self.prior
        segments = np.arange(len(residual))
        if not len(slopes):
            return segment_losses(residual)
        weighted = slopes * segment_weights(residual)[:, None]
        normal = np.einsum("ask,bsk->sab", weighted, slopes, optimize=True)
        right = np.einsum("ask,sk->sa", weighted, residual)
        losses, step = np.empty(len(residual)), np.zeros(len(self.theta))
        held = (prior.precision + np.diag((UNKNOWN * prior.size) ** -2.0))[np.ix_(free, free)]
        for block in np.array_split(segments, BLOCKS):
            rest = np.setdiff1d(segments, block)
            pull = right[rest].sum(axis=0) - prior.slope(self.theta)[free]
            step[free] = solved(normal[rest].sum(axis=0) + held, pull)
            if not self.of_forces and any(part.effect.rough for part in self.trial.parts):
                losses[block] = self._simulated(step, block, rest)
            else:
                losses[block] = segment_losses(residual[block] - np.tensordot(step[free], slopes[:, block], axes=1))
        return losses

    def _simulated(self, step: Array, block: NDArray[np.int_], rest: NDArray[np.int_]) -> Array:
        """Losses of a block in free runs after a step by the other blocks, ``rest``, if the step reduces their loss."""
        theta, losses = self.prior.clip(self.theta + step), segment_losses(self.residual)
        moved = self.starts.project(mean_residuals(self.runner, self.runner.run(theta, self.offsets)))
        after = segment_losses(moved)
        return np.asarray((after if after[rest].sum() < losses[rest].sum() else losses)[block])

    @cached_property
    def raw_slopes(self) -> list[Array]:
        """Slopes (S, K n) by every parameter, before regression on the start states."""
        return _slopes(self.runner, self.theta, self.offsets, self.unprojected, STEP * self.prior.differenced, {})

    @cached_property
    def projected_slopes(self) -> Array:
        """(p, S, K n) slopes after regression on the start states."""
        return self.starts.projected(self.raw_slopes, self.residual)

    def residual_of(self, runner: Runner, theta: Array) -> Array:
        """(S, K n) measured less predicted, over its noise, of another trial on this record from this fit's starts."""
        (residual,) = self.residuals_of(runner, [theta])
        return residual

    def residuals_of(self, runner: Runner, thetas: Sequence[Array]) -> list[Array]:
        """``residual_of`` for several vectors."""
        offsets = runner.offsets_of(self.runner, self.offsets)
        return [mean_residuals(runner, run(offsets)) for run in runner.several(thetas)]

    @property
    def for_table(self) -> Fit:
        """The fit without its arrays over segments, which take nearly all its memory: values and limits alone."""
        flat, deep = np.zeros((0, 0)), np.zeros((0, 0, 0))
        starts = Starts(deep, deep, flat)
        return replace(self, offsets=flat, unprojected=flat, residual=flat, slopes=deep, starts=starts)

    def rows_of(self, joint: int) -> slice:
        """The rows of a joint of an arm that is simulated joint by joint."""
        joints = self.runner.record.joints
        assert joints is not None
        return slice(joints.index(joint), None, len(joints))

    def of_joint(self, joint: int) -> Fit:
        """The fit restricted to the rows of one joint; its theta is unchanged."""
        rows, starts = self.rows_of(joint), self.starts
        return replace(
            self,
            runner=replace(self.runner, record=replace(self.runner.record, joints=(joint,))),
            offsets=self.offsets[rows],
            unprojected=self.unprojected[rows],
            residual=self.residual[rows],
            slopes=self.slopes[:, rows],
            starts=Starts(starts.slopes[rows], starts.solver[rows], starts.width[rows]),
        )

    def started_as(self, other: Fit, joint: int) -> Fit:
        """The fit with the start states of one joint taken from another fit of that joint."""
        rows, own, new = self.rows_of(joint), self.starts, other.starts
        offsets, slopes, solver, width = (a.copy() for a in (self.offsets, own.slopes, own.solver, own.width))
        offsets[rows], slopes[rows], solver[rows], width[rows] = other.offsets, new.slopes, new.solver, new.width
        return replace(self, offsets=offsets, starts=Starts(slopes, solver, width))


def segment_losses(residual: Array) -> Array:
    """(S,) robust loss of each segment, K/2·log(1 + RSS/K): −log-likelihood with a scale of its own above the noise."""
    count = residual.shape[1]
    return np.asarray(0.5 * count * np.log1p((residual**2).sum(axis=1) / count))


def segment_weights(residual: Array) -> Array:
    """(S,) weights with which least squares has the gradient of ``segment_losses``."""
    return np.asarray(1 / (1 + (residual**2).mean(axis=1)))


def segment_cost(residual: Array) -> float:
    return float(segment_losses(residual).sum())


def resolution(cost: float) -> float:
    """Decrease of a cost, in nats, below which a fit has converged; smaller differences of costs mean nothing."""
    return 1e-2 + 1e-4 * cost


def mean_residuals(runner: Runner, predicted: Array) -> Array:
    """Measured less predicted, averaged over groups of samples and divided by the noise of the average: (S, K n)."""
    record = runner.record
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.sqrt(record.group) / record.of_starts(record.noise)[:, None]
        error = (record.mean_targets - record.means(predicted)) * scale
    flat = error.reshape(len(error), -1)
    if np.isnan(flat).any():
        flat = np.nan_to_num(flat, nan=HUGE)
    return np.asarray(np.clip(flat, -HUGE, HUGE))


def state_slopes(runner: Runner, predict: Callable[[Array], Array], offsets: Array, base: Array) -> Starts:
    """The elimination of start states by differences from ``base``, the residual of ``predict`` at ``offsets``."""
    n = offsets.shape[1] // 2
    record = runner.record
    noise = record.of_starts(record.noise)
    duration = runner.record.length * runner.record.sample_time

    def slope(k: int) -> Array:
        size = 3 * noise[:, k % n] / (1.0 if k < n else duration)
        moved = offsets.copy()
        moved[:, k] += size
        return np.asarray((base - mean_residuals(runner, predict(moved))) / size[:, None])

    slopes = np.stack(in_parallel(slope, range(2 * n)), axis=2)
    least = record.of_starts(SPEED_SHARE * record.top_speed)
    width = np.hstack([WIDE * noise, np.maximum(WIDE * noise / duration, least)])
    if any(record.integrated):  # a random walk over the log, from white noise of the speed
        walks = record.of_starts(np.array(record.integrated, dtype=float)) > 0
        wide = noise * np.sqrt(len(record.measured)), np.maximum(noise / record.sample_time, least)
        width = np.where(np.hstack([walks, walks]), np.hstack(wide), width)
    normal = np.einsum("skp,skq->spq", slopes, slopes) + width[:, :, None] ** -2.0 * np.eye(2 * n)
    return Starts(slopes, np.linalg.solve(normal, slopes.transpose(0, 2, 1)), width)


@dataclass(frozen=True, eq=False)
class Starts:
    """Elimination of the segments' start states, which have a wide Gaussian prior.

    (S, K n, 2n) slopes of the prediction, (S, 2n, K n) solver for their least-squares shift, (S, 2n) prior deviations.
    """

    slopes: Array
    solver: Array
    width: Array

    def shift(self, residual: Array) -> Array:
        return np.asarray(np.clip(np.matmul(self.solver, residual[..., None])[..., 0], -3 * self.width, 3 * self.width))

    def project(self, values: Array, slope: bool = False) -> Array:
        """Residual of values (S, K n) after regression on the start states."""
        shift = np.matmul(self.solver, values[..., None]) if slope else self.shift(values)[..., None]
        return np.asarray(values - np.matmul(self.slopes, shift)[..., 0])

    def projected(self, slopes: Sequence[Array], like: Array) -> Array:
        """(p, S, K n) slopes, each as ``like``, after regression on the start states.

        A joint of an arm does not feel most parameters of the links; such a slope is zero, and stays so.
        """
        found = np.zeros((len(slopes), *like.shape))
        for k, slope in enumerate(slopes):
            if slope.any():
                found[k] = self.project(slope, slope=True)
        return found


def shooting_fit(
    runner: Runner,
    theta: Array,
    offsets: Array,
    prior: Prior,
    rounds: int,
    residual: Array | None = None,
    difference: float = STEP,
    final_slopes: bool = True,
) -> Fit:
    """Output-error fit with the slopes by the start states computed at ``theta``.

    Args:
        rounds, final_slopes: as of ``GaussNewton.fit``.
        residual: (S, K n) at ``theta``, where it is known.
        difference: as of ``GaussNewton``.
    """
    predict = runner.at(theta)
    if residual is None:
        residual = mean_residuals(runner, predict(offsets))
    starts = state_slopes(runner, predict, offsets, residual)
    return GaussNewton(runner, starts, prior, theta, offsets, residual, difference=difference).fit(rounds, final_slopes)


@dataclass(eq=False)
class GaussNewton:
    """Output-error fit by Gauss–Newton steps with Levenberg–Marquardt damping.

    Minimises Σ loss(segment) + prior cost over θ. The start states of the segments are eliminated with fixed slopes.

    Attributes:
        theta: (p,) parameters: first the start of the fit, then the last accepted ones.
        offsets: (S, 2n) start states of the segments, alike.
        residual: (S, K n) at the start; computed if None.
        known: slopes (S, K n) by the first parameters that are taken as they are.
        difference: step of a numerical derivative, over the size of its parameter.
    """

    runner: Runner
    starts: Starts
    prior: Prior
    theta: Array
    offsets: Array
    residual: Array | None = None
    known: Sequence[Array] = ()
    difference: float = STEP

    def __post_init__(self) -> None:
        self._first, self.theta = self.theta, self.prior.clip(self.theta)
        if self.residual is None or not np.array_equal(self.theta, self._first):
            self.residual = mean_residuals(self.runner, self.runner.run(self.theta, self.offsets))
        self._residual: Array = self.residual
        self._slopes: list[Array] = []
        self._columns: Array = np.zeros((0, *self._residual.shape))
        self._damping = LEAST_DAMPING

    def fit(self, rounds: int, final_slopes: bool = True) -> Fit:
        """The fit after at most ``rounds`` steps, fewer if it converges.

        Args:
            final_slopes: whether the slopes are computed again after the last one of ``rounds`` steps, a free run for
                each parameter. Not needed if only values and cost are used.
        """
        for _ in range(rounds):
            self._linearise()
            if not self._slopes or not self._step():
                break
        else:  # not converged
            if final_slopes:
                self._linearise()
        projected, limited = self.starts.project(self._residual), self.prior.limited(self.theta, self._first)
        return Fit(
            self.runner,
            self.theta,
            self.offsets,
            self._residual,
            projected,
            self._columns,
            self.starts,
            self.prior,
            limited,
        )

    def _linearise(self) -> None:
        """Compute the slopes at θ, but those that are known; of many toleranced parameters, once a fit."""
        taken: dict[int, Array] = dict(enumerate(self.known))
        toleranced = np.flatnonzero(np.isfinite(self.prior.deviation))
        if self._slopes and len(toleranced) > MANY:
            taken |= {int(k): self._slopes[k] for k in toleranced}
        steps = self.difference * self.prior.differenced
        self._slopes = _slopes(self.runner, self.theta, self.offsets, self._residual, steps, taken)
        self._columns = self.starts.projected(self._slopes, self._residual)

    def _step(self) -> bool:
        """Take a step that lowers the cost; whether there was one, and it lowered the cost by its resolution.

        The damping is raised until the cost falls, at most ``MOST_TRIALS`` times, and lowered after the step.
        """
        theta, prior, flat = self.theta, self.prior, self.starts.project(self._residual)
        cost = segment_cost(flat) + prior.cost(theta)
        weighted = self._columns * segment_weights(flat)[:, None]
        matrix = weighted.reshape(len(weighted), -1) @ self._columns.reshape(len(weighted), -1).T + prior.precision
        right = np.einsum("ask,sk->a", weighted, flat) - prior.slope(theta)
        longest = 2.0 * np.maximum(prior.size, np.abs(theta))
        for _ in range(MOST_TRIALS):
            step = np.clip(damped_step(matrix, right, self._damping, prior.blocked(theta, right)), -longest, longest)
            moved = prior.clip(np.clip(theta + step, self._first - prior.reach, self._first + prior.reach))
            changes = zip(moved - theta, self._slopes, strict=True)
            shift = self.starts.shift(self._residual - sum(change * slope for change, slope in changes if change))
            trial = mean_residuals(self.runner, self.runner.run(moved, self.offsets + shift))
            new = segment_cost(self.starts.project(trial)) + prior.cost(moved)
            if new < cost:
                break
            self._damping = max(self._damping, RAISED_DAMPING) * 10
        else:
            return False
        self._damping = max(self._damping / 10, LEAST_DAMPING)
        self.theta, self.offsets, self._residual = moved, self.offsets + shift, trial
        return cost - new >= resolution(cost)


def damped_step(matrix: Array, right: Array, damping: float, held: NDArray[np.bool_]) -> Array:
    """The Levenberg–Marquardt step from normal equations, scaled to a unit diagonal; 0 for held parameters."""
    free = ~held
    matrix, right, step = matrix[np.ix_(free, free)], right[free], np.zeros(len(right))
    size = scales(matrix)
    step[free] = np.linalg.solve(matrix / np.outer(size, size) + damping * np.eye(len(size)), right / size) / size
    return step


def _slopes(
    runner: Runner, theta: Array, offsets: Array, now: Array, steps: Array, taken: Mapping[int, Array]
) -> list[Array]:
    """Slopes by every parameter, by differences; those in ``taken`` are known."""

    def slopes(indices: Sequence[int]) -> list[Array]:
        moved = [theta.copy() for _ in indices]
        for one, k in zip(moved, indices, strict=True):
            one[k] += steps[k]
        runs = runner.several(moved)
        return [(now - mean_residuals(runner, run(offsets))) / steps[k] for run, k in zip(runs, indices, strict=True)]

    missing = [k for k in range(len(theta)) if k not in taken and runner.depends_on(k)]
    groups = [missing[k : k + runner.at_once] for k in range(0, len(missing), runner.at_once)]
    found = [slope for group in in_parallel(slopes, groups) for slope in group]
    known = {**taken, **dict(zip(missing, found, strict=True))}
    none = np.zeros_like(now)
    return [known.get(k, none) for k in range(len(theta))]


def polish(fit: Fit, rounds: int, prior: Prior | None = None, final_slopes: bool = True) -> Fit:
    """The fit repeated with new slopes by the start states; the old fit if that is no better."""
    offsets = _restarted(fit)
    known = fit.unprojected if offsets is fit.offsets else None
    new = shooting_fit(fit.runner, fit.theta, offsets, prior or fit.prior, rounds, known, final_slopes=final_slopes)
    return new if new.cost < fit.cost else fit


def _restarted(fit: Fit) -> Array:
    """The start states; those of segments far above the noise as measured, if that fits better."""
    far = np.flatnonzero(fit.by_segment > FAR_START**2 * fit.residual.shape[1])
    if not len(far):
        return fit.offsets
    record, runner = fit.runner.record, fit.runner
    joints = len(record.joints or (0,))  # rows of a segment
    segments = np.unique(far // joints)
    if runner.trial.changed.transmissions:  # simulated only a short time before a segment where few are run
        segments = np.arange(len(record.start))
    rows = (segments[:, None] * joints + np.arange(joints)).ravel()
    part = replace(runner, record=replace(record, start=np.ascontiguousarray(record.start[segments])))
    measured = np.zeros_like(fit.offsets[rows])
    predict = part.at(fit.theta)
    residual = mean_residuals(part, predict(measured))
    left = segment_losses(state_slopes(part, predict, measured, residual).project(residual))
    better = np.intersect1d(far, rows[left < segment_losses(fit.residual[rows])])
    offsets = fit.offsets.copy()
    offsets[better] = 0.0
    return offsets


NEAR_BOUND = 1e-3
"""Distance that counts as at a bound, over the range between two bounds, or over a single bound."""


def at_limit(fit: Fit) -> list[tuple[str, ...]]:
    """Names of the parameters of each effect of a fit that are at a bound of the catalogue or of the fit's reach."""
    marks, limited = [], iter(fit.limited[len(fit.trial.refitted_symbols) :])
    for part, values in zip(fit.trial.parts, fit.values[1], strict=True):
        bounds = {p.name: (p.low, p.high) for p in part.effect.parameters}
        at_bound = {name: _at_bound(values[name], *bounds.get(name, (None, None))) for name in part.names}
        marks.append(tuple(name for name in part.names if next(limited) or at_bound[name]))
    return marks


def levels_at_zero(declared: System, models: Sequence[System], levels: Sequence[sympy.Symbol]) -> tuple[str, ...]:
    """Friction levels that a fit has reduced to zero, the lowest value allowed."""
    return tuple(s.name for s in levels if float(declared.values[s]) and not all(float(m.values[s]) for m in models))


def _at_bound(value: float, low: float | None, high: float | None) -> bool:
    if low is not None and high is not None:
        return min(value - low, high - value) <= NEAR_BOUND * (high - low)
    return any(abs(value - end) <= NEAR_BOUND * abs(end) for end in (low, high) if end is not None)
