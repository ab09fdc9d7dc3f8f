"""Starting values of a candidate's fit, by free runs and by the force residual of the measured motion.

By free runs: shapes on a grid, weights by one linear step. By the force residual r = g − M a − U λ: weights and
friction levels by linear least squares for each shape. A stage of an actuator changes r only through the effective
input w, r + (∂g/∂w)(w' − w); its one parameter is found by a bounded search.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import product

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from codegen.base.arrays import Array
from codegen.diagnosis.fit.force_rows import force_rows
from codegen.diagnosis.fit.linear import fitted, scales, solved
from codegen.diagnosis.fit.output_error import Fit, segment_cost, segment_weights
from codegen.diagnosis.fit.residual import (
    Problem,
    ResidualAlong,
    effective_inputs,
    evaluate_forces,
    force_function,
    inverse_dynamics_residual,
    points,
    unfiltered_residual,
)
from codegen.diagnosis.fit.signals import Motion, low_pass
from codegen.diagnosis.fit.trial import Part, Runner, Trial, model_of
from codegen.effects.start import Covered
from codegen.mechanics.casadi_form import over_rows
from codegen.mechanics.system import Matrix, System

TRIES, MORE_TRIES, SIMPLEX = 60, 180, 0.5
"""Simplex searches before the Gauss–Newton steps: most free runs of each and of that from the best of them, and the
initial size in logarithms. A simplex that has shrunk in a local minimum leaves it when it is begun anew."""
APART_STARTS = 1.0
"""Least distance between the starts of simplex searches, in logarithms: twice their initial size."""


def starting_points(
    runner: Runner, base: Fit, covered: Covered, shapes: Sequence[Mapping[str, float]]
) -> list[tuple[float, Array]]:
    """(cost after one linear step, theta) with the trial's last part of each shape."""
    part = runner.trial.parts[-1]
    if part.effect.scaling:
        return [_weighted_by_runs(runner, base, covered, shape) for shape in shapes]
    return _with_values(runner, base, [part.inward(shape) for shape in shapes])


def _weighted_by_runs(runner: Runner, base: Fit, covered: Covered, shape: Mapping[str, float]) -> tuple[float, Array]:
    """A starting point of an effect with weights, which follow by the linear step too."""
    part = runner.trial.parts[-1]
    effect = part.effect
    columns = []
    for probe, size in effect.probes(shape, covered):
        theta = np.concatenate([base.theta, part.inward(probe)])
        slope = (base.unprojected - base.residual_of(runner, theta)) / size
        columns.append(base.starts.project(slope, slope=True))
    step, cost = _linear_step(base, base.unprojected, np.concatenate([base.projected_slopes, np.stack(columns)]))
    values = effect.weighted(shape, step[len(base.theta) :].tolist())
    return cost, np.concatenate([base.theta + step[: len(base.theta)], part.inward(values)])


def best_starts(found: Sequence[tuple[float, Array]], most: int, apart: int = 0) -> list[tuple[float, Array]]:
    """The best distinct results of ``starting_points``; with ``apart`` last values ``APART_STARTS`` apart."""
    ordered, chosen = sorted(found, key=lambda pair: pair[0]), list[tuple[float, Array]]()
    for cost, theta in ordered if apart else ordered[:most]:
        least = APART_STARTS if apart else 0.0
        if all(np.abs(theta - other)[-apart:].max() > least for _, other in chosen):
            chosen.append((cost, theta))
        if len(chosen) == most:
            break
    return chosen


def simplex_search(runner: Runner, base: Fit, theta: Array, tries: int = TRIES) -> tuple[float, Array]:
    """(cost, theta) by Nelder–Mead from ``theta`` over the parameters of the last part, where the loss is not smooth.

    The other parameters follow by one linear step for each of at most so many evaluations.
    """
    size = len(runner.trial.parts[-1].names)
    first = theta[-size:]
    simplex = np.vstack([first, first + SIMPLEX * np.eye(size)])
    best = minimize(
        lambda inner: _with_values(runner, base, [inner])[0][0],
        first,
        method="Nelder-Mead",
        options={"maxfev": tries, "initial_simplex": simplex},
    )
    return _with_values(runner, base, [best.x])[0]


def _with_values(runner: Runner, base: Fit, inner: Sequence[Array]) -> list[tuple[float, Array]]:
    """(cost, theta) with each of these values of the last part, all other parameters by one linear step from the base.

    The values are at most as many as ``Runner.at_once``, or take longer.
    """
    thetas, found = [np.concatenate([base.theta, one]) for one in inner], []
    for theta, residual in zip(thetas, base.residuals_of(runner, thetas), strict=True):
        step, cost = _linear_step(base, residual, base.projected_slopes)
        theta[: len(base.theta)] += step
        found.append((cost, theta))
    return found


def _linear_step(base: Fit, residual: Array, columns: Array) -> tuple[Array, float]:
    """(step, cost) of one weighted least-squares step with the prior."""
    flat = base.starts.project(residual)
    if not len(columns):
        return np.zeros(0), segment_cost(flat)
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    scaled = (columns * weights).reshape(len(columns), -1)
    normal, right, known = scaled @ scaled.T, scaled @ (flat * weights).ravel(), len(base.theta)
    normal[:known, :known] += base.prior.precision
    right[:known] -= base.prior.slope(base.theta)
    step = solved(normal, right, 1e-9)
    left = flat - np.tensordot(step, columns, axes=1)
    return step, segment_cost(left) + base.prior.cost(base.theta + step[:known])


DENSE = 10.0
"""Samples in a period of the cutoff, which are enough for a starting value."""
STEP = 1e-4
"""Step of a value for its slope, over its size."""
SEARCHED, REACH = 16, 2.0
"""Bounded search: most evaluations, and half its width about the best of the grid, in the fit's coordinate."""


@dataclass(frozen=True, eq=False)
class ForceStart:
    """Starting values of candidates in addition to one fit, ``base``.

    Attributes:
        whole: whether all values of the base follow by linear least squares, with their prior and limits; else levels.
        runners: part → free runs of the base with it, for states that are not logged; compiled where there are none.
        known: with ``whole``, index of a value → (N, n) slope of the low-passed residual by it, where that is known.
    """

    problem: Problem
    base: Fit
    whole: bool = False
    runners: Mapping[Part, Runner] = field(default_factory=dict)
    known: Mapping[int, Array] = field(default_factory=dict)
    _along: dict[Part, ResidualAlong] = field(default_factory=dict)

    def best(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """(share of the squared force residual that remains, theta) with the last part and levels; or None.

        A base that diverged, so that its residual is no number, gives no start.
        """
        part = trial.parts[-1]
        if trial.adds_states or self.base.trial.adds_states or not np.isfinite(self._residual).all():
            return None
        if part.effect.scaling:
            return self._weighted(trial, covered) if set(part.symbols) <= set(trial.free) else None
        if len(part.names) != 1 or set(part.symbols) & set(trial.free):
            return None
        grid = [float(part.inward(shape)[0]) for shape in part.effect.starts(covered)]
        tried = {inner: self._left(trial, inner) for inner in grid}
        centre = min(tried, key=lambda inner: tried[inner][0])

        def of(inner: float) -> float:
            tried[inner] = self._left(trial, inner)
            return tried[inner][0]

        near = grid if part.effect.rough else []  # of a loss with steps, the neighbours of the grid
        low = max((g for g in near if g < centre), default=centre - REACH)
        bounds = low, min((g for g in near if g > centre), default=centre + REACH)
        minimize_scalar(of, bounds=bounds, method="bounded", options={"maxiter": SEARCHED, "xatol": 0.01})
        inner = min(tried, key=lambda inner: tried[inner][0])
        theta = np.append(self.base.theta, inner)
        theta[self._places] += tried[inner][1]
        return (tried[inner][0], theta) if np.isfinite(theta).all() else None

    def with_levels(self, trial: Trial, thetas: Sequence[Array]) -> list[tuple[float, Array]]:
        """For each of the vectors of a trial (share of the squared force residual that remains, theta), with refitted
        levels; the share is ∞ where states diverge.
        """
        residuals = self._residuals_of(trial, thetas)
        return [self._with_levels(theta, self._rows(one)) for theta, one in zip(thetas, residuals, strict=True)]

    def _with_levels(self, theta: Array, residual: Array) -> tuple[float, Array]:
        """``with_levels`` of a vector with this residual, (R,)."""
        if not np.isfinite(residual).all():
            return np.inf, theta
        ((step, share),) = self._least_squares([np.zeros((len(residual), 0))], residual)
        theta = theta.copy()
        theta[self._places] += step
        return share, theta

    def _residuals_of(self, trial: Trial, thetas: Sequence[Array]) -> Iterator[Array]:
        """(M, n) low-passed force residuals of a trial at the base's values and those of its last part in each vector.

        Only the change from the base's residual is computed at every ``_every``-th sample and low-passed there.
        Measurement noise is the same in both residuals and cancels, so it does not alias.
        """
        motion, model, part = self.problem.motion, self.base.model, trial.parts[-1]
        alone = Trial(model, (part,), ())
        if (alone.changed.actuators, alone.changed.sensor_errors) != (model.actuators, model.sensor_errors):
            for theta in thetas:
                yield inverse_dynamics_residual(model_of(trial, theta), motion)[:: self._every]
            return
        if part not in self._along:
            compiled = self.runners.get(part)
            first = () if compiled is None else self.base.theta
            self._along[part] = ResidualAlong(alone, motion, compiled, first)
        own = [theta[len(self.base.theta) :] for theta in thetas]
        for changed in self._along[part].several(own, self._every):
            yield self._residual[:: self._every] + self._low_pass(changed - self._unfiltered)

    def _low_pass(self, forces: Array) -> Array:
        """Forces (M, n) at every so many samples, low-passed."""
        motion = self.problem.motion
        return low_pass(forces, motion.cutoff_hz, self._every * motion.sample_time)

    def _weighted(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """The best of an effect's shapes, with its weights and the levels by linear least squares."""
        part, effect = trial.parts[-1], trial.parts[-1].effect
        at, found = self._points, []
        function = self._added(trial.changed, part.symbols)
        residual = self._rows(self._residual[:: self._every])

        def change(values: Mapping[str, float]) -> Array:
            numbers = np.array([values[name] for name in part.names])
            return self._rows(self._low_pass(over_rows(function, at, numbers)))

        shapes = list(effect.starts(covered))
        probes = [effect.probes(shape, covered) for shape in shapes]
        groups = [np.column_stack([change(values) / size for values, size in one]) for one in probes]
        for shape, one, (step, share) in zip(shapes, probes, self._least_squares(groups, residual), strict=True):
            theta = np.append(self.base.theta, part.inward(effect.weighted(shape, step[: len(one)].tolist())))
            theta[self._places] += step[len(one) :]
            if np.isfinite(theta).all():
                found.append((share, theta))
        return min(found, key=lambda pair: pair[0], default=None)

    def _added(self, system: System, symbols: Sequence[sympy.Symbol]) -> casadi.Function:
        """What a system adds to g − M a − U λ of the base, as a function of a point of the motion and these symbols."""
        trial = self.base.trial
        own = dict(zip(trial.symbols, trial.numbers(self.base.theta), strict=True))
        added = (system.equation_error - trial.changed.equation_error).applyfunc(distributed)
        return force_function(system, [Matrix(added)], symbols, own)

    def _left(self, trial: Trial, inner: float) -> tuple[float, Array]:
        """(share that remains, steps of the base's values) with the part's parameter at this value."""
        change = self._acting(trial, np.append(self.base.theta, inner)) - self._own
        force = np.einsum("jni,nj->ni", self._by_input, change)
        residual = self._rows((self._residual + self.problem.motion.low_pass(force))[:: self._every])
        ((step, share),) = self._least_squares([np.zeros((len(residual), 0))], residual)
        return share, step

    def _acting(self, trial: Trial, theta: Array) -> Array:
        """(N, m) effective inputs at each sample: the mean of those before and after it."""
        motion = self.problem.motion
        after = trial.chains.act(motion.commands, trial.numbers(theta), motion.sample_time, 1)
        return 0.5 * (after + np.vstack([after[:1], after[:-1]]))

    def _rows(self, forces: Array) -> Array:
        """(R,) forces at the points of all coordinates, away from standstill, over the RMS residual of the base."""
        used = self.problem.used[:: self._every].T
        return np.concatenate([f[u] / s for f, u, s in zip(forces.T, used, self._sizes, strict=True) if u.any()])

    def _least_squares(self, groups: Sequence[Array], residual: Array) -> list[tuple[Array, float]]:
        """For each group of columns (R, k) the steps of their weights and of the values, and the share that remains."""
        if not self.whole:
            return [self._steps(np.hstack([columns, self._slopes]), residual, columns.shape[1]) for columns in groups]
        if not groups:  # an effect without starting values, as cogging where the residual has no period
            return []
        joined, left = self._in_few_rows(np.hstack(groups), residual)
        values = joined[:, joined.shape[1] - len(self.base.theta) :]
        ends = np.cumsum([columns.shape[1] for columns in groups])
        own = [joined[:, end - columns.shape[1] : end] for columns, end in zip(groups, ends, strict=True)]
        return [self._steps(np.hstack([columns, values]), left, columns.shape[1]) for columns in own]

    def _steps(self, columns: Array, residual: Array, weights: int) -> tuple[Array, float]:
        """The least-squares steps of so many weights and of the values, and the share that remains."""
        theta, prior = self.base.theta, self.base.prior
        step = -fitted(columns, residual)
        if self.whole:
            moved = theta + step[weights:]
            within = prior.clip(moved)
            fixed = np.append(np.zeros(weights, dtype=bool), within != moved)  # of a value within, no bit has changed
            if fixed.any():
                step[weights:] = within - theta
                step[~fixed] = -fitted(columns[:, ~fixed], residual + columns[:, fixed] @ step[fixed])
        rest = residual + columns @ step
        return step, float(rest @ rest) / max(1, len(self._slopes))

    @cached_property
    def _held(self) -> Array:
        """(p, p) rows of the deviations from the prior's centre: R of the prior's precision R'R."""
        size = scales(self.base.prior.precision)
        values, axes = np.linalg.eigh(self.base.prior.precision / np.outer(size, size))
        return np.asarray(np.sqrt(self._dense * np.maximum(values, 0.0))[:, None] * axes.T * size)

    @cached_property
    def _factors(self) -> tuple[Array, Array]:
        """The QR factors of the slopes by all values, with the rows of the prior."""
        q, r = np.linalg.qr(np.vstack([self._slopes, self._held]))
        return q, r

    def _in_few_rows(self, columns: Array, residual: Array) -> tuple[Array, Array]:
        """The same problem with a row for each unknown and one more, by orthogonal transformations (``_factors``).

        The columns of all shapes of an effect are transformed together: each time the large factor is read from memory.
        """
        q, r = self._factors
        held = np.zeros((len(r), columns.shape[1] + 1))
        held[:, -1] = self._held @ (self.base.theta - self.base.prior.centre)
        others = np.vstack([np.column_stack([columns, residual]), held])
        along = q.T @ others
        across = np.linalg.qr(others - q @ along)[1]
        zeros = np.zeros((len(across), len(r)))
        few = np.vstack([np.hstack([along[:, :-1], r]), np.hstack([across[:, :-1], zeros])])
        return few, np.append(along[:, -1], across[:, -1])

    @cached_property
    def _every(self) -> int:
        """Distance of the samples that are used."""
        return self.problem.motion.step(DENSE)

    @property
    def _dense(self) -> float:
        """Used samples per independent value of the low-passed residual, of which there are two in a cutoff period."""
        motion = self.problem.motion
        return max(1.0, 1 / (2 * motion.cutoff_hz * motion.sample_time * self._every))

    @cached_property
    def _points(self) -> Array:
        """(M, 3n + m + 1) the motion, its effective inputs and time, at every so many samples."""
        inputs = effective_inputs(self.base.model, self.problem.motion)
        return points(self.base.model, self.problem.motion, inputs, self._every)

    @cached_property
    def _residual(self) -> Array:
        return inverse_dynamics_residual(self.base.model, self.problem.motion)

    @cached_property
    def _unfiltered(self) -> Array:
        """(M, n) the base's residual at these points, unfiltered, with states that are not logged."""
        return unfiltered_residual(self.base.model, self.problem.motion)[:: self._every]

    @cached_property
    def _sizes(self) -> list[float]:
        """RMS of the base's residual on each coordinate."""
        used = self.problem.used.T
        squares = [float(np.mean(r[u] ** 2)) if u.any() else 1.0 for r, u in zip(self._residual.T, used, strict=True)]
        return [max(square, 1e-300) ** 0.5 for square in squares]

    @cached_property
    def _own(self) -> Array:
        return self._acting(self.base.trial, self.base.theta)

    @cached_property
    def _by_input(self) -> Array:
        """(m, N, n) slopes of g by each effective input."""
        columns = [Matrix(self.base.model.force.diff(w)) for w in self.base.model.inputs]
        return evaluate_forces(self.base.model, columns, self.problem.motion)

    @cached_property
    def _places(self) -> list[int]:
        """Indices of the values that follow."""
        if self.whole:
            return list(range(len(self.base.theta)))
        return [k for k, s in enumerate(self.base.trial.refitted_symbols) if s in self.problem.levels]

    @cached_property
    def _slopes(self) -> Array:
        """(R, p) slopes of the residual by the values that follow."""
        if self.whole:
            slopes = [self._slope(k) if k not in self.known else self.known[k] for k in self._places]
            return np.column_stack([self._rows(slope[:: self._every]) for slope in slopes])
        symbols = [self.base.trial.refitted_symbols[k] for k in self._places]
        rows = force_rows(self.base.model, self.problem, symbols)
        sizes = [s for s, u in zip(self._sizes, self.problem.used.T, strict=True) if u.any()]
        used = [r.slopes[r.sample % self._every == 0] for r in rows]
        return np.concatenate([slopes / s for slopes, s in zip(used, sizes, strict=True)])

    def _slope(self, k: int) -> Array:
        """(N, n) slope of the residual by a value of the base, by a difference."""
        step, theta = STEP * float(self.base.prior.size[k]), self.base.theta.copy()
        theta[k] += step
        residual = inverse_dynamics_residual(model_of(self.base.trial, theta), self.problem.motion)
        return np.asarray((residual - self._residual) / step)


FREQUENCIES = np.geomspace(0.03, 1.5, 40)
"""Frequencies of the load with the motor held, in cutoffs of the log."""
DAMPING_RATIOS = (0.03, 0.12, 0.4)
LEAST_SHARE, MOST_SHARE = 0.03, 0.97
"""Range of the load's share of the inertia."""
APART = 1.3
"""Least ratio between the frequencies of two starting values."""


@dataclass(frozen=True)
class Resonance:
    """A load behind a spring: ω in rad/s with the motor held, damping ratio ζ and share ρ of the inertia."""

    frequency: float
    damping_ratio: float
    share: float


def resonances(
    residual: Array, acceleration: Array, used: NDArray[np.bool_], inertia: float, motion: Motion, most: int
) -> tuple[Resonance, ...]:
    """The resonances that explain most of a residual (N,) at the used samples, best first, with distinct frequencies.

    A load ρM behind a spring k and a damper c follows the motor's acceleration a by (c s + k)/(ρM s² + c s + k) a, and
    the residual of the rigid model is

        r = ρM (a_load − a) = −ρM · s²/(s² + 2ζω s + ω²) a,   ω² = k/(ρM), 2ζω = c/(ρM),

    so for each ω and ζ one regression on the filtered acceleration (N,) gives ρ. A free run with a frequency 10 % off
    does not show so narrow a resonance; here a fine grid is cheap.
    """
    found: list[tuple[float, Resonance]] = []
    if not used.any():
        return ()
    y = residual[used] - residual[used].mean()
    for frequency, ratio in product(2 * np.pi * motion.cutoff_hz * FREQUENCIES, DAMPING_RATIOS):
        column = resonant(float(frequency), ratio, acceleration, motion)[used]
        power = float(column @ column)
        share = -float(column @ y) / (power * inertia) if power > 0 else 0.0
        if share > 0:
            left = y + min(share, MOST_SHARE) * inertia * column
            kept = min(max(share, LEAST_SHARE), MOST_SHARE)
            found.append((float(left @ left), Resonance(float(frequency), ratio, kept)))
    chosen: list[Resonance] = []
    for _, one in sorted(found, key=lambda pair: pair[0]):
        if all(max(one.frequency, r.frequency) > APART * min(one.frequency, r.frequency) for r in chosen):
            chosen.append(one)
        if len(chosen) == most:
            break
    return tuple(chosen)


def resonant(frequency: float, damping_ratio: float, acceleration: Array, motion: Motion) -> Array:
    """(N,) acceleration filtered by s²/(s² + 2ζω s + ω²), low-passed."""
    b, a = _resonant_filter(frequency, damping_ratio, motion.sample_time)
    return motion.low_pass(lfilter(b, a, acceleration)[:, None])[:, 0]


@lru_cache(maxsize=2 * len(FREQUENCIES) * len(DAMPING_RATIOS))
def _resonant_filter(frequency: float, damping_ratio: float, sample_time: float) -> tuple[Array, Array]:
    """Numerator and denominator in z of s²/(s² + 2ζω s + ω²): all coordinates are searched by the same ones."""
    # The bilinear transform s = 2/h (z − 1)/(z + 1) in the operations of scipy.signal.bilinear, which takes a
    # millisecond for each: (z + 1)/f and (z − 1) f with f² = 2/h.
    f = np.sqrt(2 / sample_time)
    p = 1.0 / f
    square, stiffness = f * f, frequency**2 * (p * p)
    damping = 2 * damping_ratio * frequency * p * f
    numerator = np.array([square, -2 * square, square])
    middle = 2 * stiffness - 2 * square
    denominator = np.array([stiffness + damping + square, middle, stiffness - damping + square])
    return numerator / denominator[0], denominator / denominator[0]


def distributed(expression: sympy.Expr) -> sympy.Expr:
    """An expression with its products of sums multiplied out, so that equal terms cancel, and its exponentials kept.

    SymPy multiplies denominators out too, and there exp(−x) is exp(x), which overflows where exp(−x) is zero.
    """
    kept = {term: sympy.Dummy(real=True) for term in expression.atoms(sympy.exp)}
    return sympy.expand_mul(expression.xreplace(kept)).xreplace({name: term for term, name in kept.items()})
