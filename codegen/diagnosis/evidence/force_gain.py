"""Comparison of two models by the force residual, the second criterion, and by the score test of nested ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import exp, log1p

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.stats import chi2, f

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import LEAST_ROWS
from codegen.diagnosis.fit.acceptance import (
    SIGN_BLOCKS,
    Evidence,
    are_large,
    evidence_of,
    in_blocks,
    p_of_log_ratios,
    p_of_sign_flips,
)
from codegen.diagnosis.fit.drive import residual_at_drive, residual_without_levels, without_values
from codegen.diagnosis.fit.force_rows import slopes_of_evidence
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.linear import correlation, independent, solved
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search, joint_of_difference
from codegen.diagnosis.fit.trial import Trial, with_values


def contains(richer: Trial, trial: Trial) -> bool:
    """Whether a trial contains another one as a special case: every part, with at least its parameters."""
    own = {p.key: set(p.names) for p in richer.parts}
    return all(set(p.names) <= own.get(p.key, set()) for p in trial.parts)


def extends(richer: Trial, trial: Trial) -> bool:
    """Whether a trial has the same effects as another one, one of them by a kind that extends the other's kind."""
    added, lost = beyond(richer, trial), beyond(trial, richer)
    if len(added) != 1 or len(lost) != 1 or len(richer.parts) != len(trial.parts):
        return False
    one, other = richer.parts[added[0]], trial.parts[lost[0]]
    return one.effect.extends == other.kind and one.on == other.on


def beyond(trial: Trial, other: Trial) -> list[int]:
    """Indices of the effects of a trial that another one does not have."""
    known = {p.key for p in other.parts}
    return [k for k, p in enumerate(trial.parts) if p.key not in known]


def added_parameters(trial: Trial, richer: Trial) -> int:
    """Number of parameters of a richer trial's effects that another trial does not have."""
    known = {p.key: len(p.names) for p in trial.parts}
    return sum(max(0, len(p.names) - known.get(p.key, 0)) for p in richer.parts)


def nested_evidence_of(before: Fit, after: Fit) -> Evidence:
    """Evidence for ``after`` over ``before``, which it contains, on the same segments, with the score test."""
    return replace(evidence_of(before, after), by_score=score_test(before, after))


def score_test(before: Fit, after: Fit) -> float:
    """P-value of the slope of the loss towards ``after`` if ``before``, which it contains, is true.

        u_s = w_s r_s·d_s,   q_s = w_s d_s·d_s,   d = r − r₁ less its part along the slopes of ``before``

    with r and r₁ the residuals of segment s without and with the added parameters, and w_s = 1/(1 + (r² + (r −
    r₁)²)/K), which bounds the influence of runs that diverge in either model, and favours no sign of r·(r − r₁). Along
    d the common parameters are at their optimum, so that u_s has the mean zero under the null hypothesis. Sums over
    ``SIGN_BLOCKS`` blocks of segments are judged by ``t_of_scores``.
    """
    change = before.residual - after.residual
    weights = 1 / (1 + (before.residual**2 + change**2).mean(axis=1))
    change = _beside_its_own(before, change, weights)
    scores, sizes = (in_blocks(weights * (r * change).sum(axis=1)) for r in (before.residual, change))
    return along_best(*t_of_scores(scores, sizes), len(after.theta) - len(before.theta))


def t_of_scores(scores: Array, sizes: Array) -> tuple[float, float]:
    """Student's t of the sums U_b of scores r·d over blocks, and the effective number of blocks.

    c = ΣU_b/ΣQ_b, with Q_b the sums of d·d, is the estimated coefficient of d, and t is c over its jackknife standard
    error. The effective number of B blocks is at most 1/Σh_b², with h_b the shares of Q_b (Kish), and at most
    B (1 − φ)/(1 + φ), with φ the autocorrelation at lag 1 of U_b − c Q_b, for slow disturbances.
    """
    count, rest = len(sizes), sizes.sum() - sizes
    if not np.all(rest > 0):
        return 0.0, 0.0
    c = float(scores.sum() / sizes.sum())
    left = scores - c * sizes
    error = float(np.sqrt((count - 1) / count * ((left / rest) ** 2).sum()))
    phi = correlation(left)
    independent = count * (1 - phi) / (1 + phi)
    t = c / error * np.sqrt(independent / count) if error > 0 else 0.0
    return float(t), min(independent, float(sizes.sum() ** 2 / (sizes @ sizes)))


def along_best(t: float, blocks: float, parameters: int) -> float:
    """P-value of Student's t of B blocks along the best of all directions of k fitted parameters.

    The largest t² is Hotelling's T², and T² (B − k)/(k (B − 1)) has the F distribution of k and B − k.
    """
    k = max(parameters, 1)
    if blocks <= k or t <= 0:
        return 1.0
    return float(f.sf(t**2 * (blocks - k) / (k * (blocks - 1)), k, blocks - k))


def _beside_its_own(fit: Fit, change: Array, weights: Array) -> Array:
    """A change of the prediction, (S, K n), less its weighted projection on the slopes of the fit's free parameters."""
    slopes = fit.slopes[~fit.limited]
    if not len(slopes):
        return change
    weighted = (slopes * weights[:, None]).reshape(len(slopes), -1)
    matrix = weighted @ slopes.reshape(len(slopes), -1).T + fit.prior.precision[np.ix_(~fit.limited, ~fit.limited)]
    return np.asarray(change - np.tensordot(solved(matrix, weighted @ change.ravel()), slopes, axes=1))


@dataclass(frozen=True)
class ForceGain:
    """Comparison of two models by their force residuals.

    Attributes:
        left: squared residual over the other model's, on the coordinate on which they differ most.
        nats: gain in log-likelihood for the number of independent residuals.
        by_signs: p of the gains of blocks of the log if their signs are random (``p_of_sign_flips``).
        score: ``t_of_scores`` of the sums over blocks of r'(r − r₁), r the other model's residual and r₁ this one's.
        nats_added: gain in log-likelihood if either residual may contain slow noise (``slow_noise_likelihood``).
        ratios: logarithms of the other model's squares over this one's, in the blocks with most to explain.
        values: number of independent residuals in those blocks.
    """

    left: float
    nats: float
    score: tuple[float, float] = (0.0, 0.0)
    nats_added: float = 0.0
    ratios: tuple[float, ...] = ()
    values: float = 0.0
    by_signs: float = 1.0

    @property
    def p(self) -> float:
        """``p_of_rivals`` of models with as many fitted parameters."""
        return self.p_of_rivals()

    def p_of_rivals(self, fitted: int = 0, against: float = 0.0) -> float:
        """One-sided p-value of the gain if the model is no better: by blocks, or by likelihood if larger.

        The likelihood ratio is valid if the other model is true, the tests on blocks also if both are incomplete.

        Args:
            fitted: number of parameters that only this model has, fitted to the same residuals.
            against: nats of other evidence for the other model.
        """
        by_blocks = min(1.0, 2 * min(self.by_signs, self.where_large(fitted)))
        return max(by_blocks, exp(-max(self.nats - fitted - against, 0.0)))

    def p_added(self, parameters: int) -> float:
        """P-value of the gain if the other model is true and this one has so many more parameters.

        It is the larger of a score test on blocks and of Wilks' likelihood-ratio test, which is also valid for noise
        slower than a block. A score test is used since the gain r² − r₁² of a block is smaller than 2 r'(r − r₁) by the
        square of the added force. The force is fitted to this log, along the best of its k directions
        (``along_best``); what is fitted to both models must be removed from both residuals
        (``ForceCriterion.added_to``).
        """
        k = max(parameters, 1)
        by_blocks = min(1.0, 2 * min(along_best(*self.score, k), self.where_large(k)))
        return max(by_blocks, float(chi2.sf(2 * max(self.nats_added, 0.0), k)))

    def where_large(self, fitted: int = 0) -> float:
        """P-value of a t test in the blocks with the largest residuals, less fitted/n by chance."""
        if not self.ratios or fitted >= self.values:
            return 1.0
        return p_of_log_ratios(np.array(self.ratios) + log1p(-fitted / self.values))


def force_gain(problem: Problem, before: Array, after: Array, joint: int | None = None) -> ForceGain:
    """The gain of residuals ``after`` over ``before``, both (N, n), after regression on friction levels or more.

    Low-passed at f, a log of T seconds has 2 f T independent values, or fewer if these are correlated. Blocks have
    equally many used samples, since a block without any would count as one without a gain.

    Args:
        joint: the only coordinate that is compared; all if not given.
    """
    motion, rows = problem.motion, problem.used
    if joint is not None:
        rows = rows & (np.arange(rows.shape[1]) == joint)
    moving = np.flatnonzero(rows[:, rows.sum(axis=0) >= LEAST_ROWS].any(axis=1))
    blocks_of = np.array_split(moving, SIGN_BLOCKS)
    rate = 2 * motion.cutoff_hz * motion.sample_time
    left, nats, added, blocks, scores = 1.0, 0.0, 0.0, np.zeros(SIGN_BLOCKS), np.zeros((2, SIGN_BLOCKS))
    squares, values = np.zeros((2, SIGN_BLOCKS)), np.zeros(SIGN_BLOCKS)
    for i in range(rows.shape[1]):
        if rows[:, i].sum() < LEAST_ROWS:
            continue
        b, a = (np.where(rows[:, i], r[:, i], 0.0) for r in (before, after))
        whole = max(float(b @ b), float(a @ a), 1e-300)
        ratio = max(float(a @ a), 1e-12 * whole) / max(float(b @ b), 1e-12 * whole)
        share = independent(correlation(a[:: max(1, round(1 / rate))]))
        nats -= 0.5 * share * min(rate, 1.0) * float(rows[:, i].sum()) * float(np.log(ratio))
        with_effect, without = (slow_noise_likelihood(r[rows[:, i]] / np.sqrt(whole), rate) for r in (a, b))
        added += with_effect - without
        by_block = np.array([_sums(r**2, blocks_of) for r in (b, a)]) / whole
        blocks += by_block[0] - by_block[1]
        squares += by_block
        values += share * min(rate, 1.0) * _sums(rows[:, i], blocks_of)
        scores += np.array([_sums(r * (b - a), blocks_of) for r in (b, b - a)]) / whole
        if abs(np.log(ratio)) > abs(np.log(left)):
            left = ratio
    some = squares.min(axis=0) > 0
    one, other = squares[:, some]
    large = are_large(one, other) if some.any() else np.zeros(0, dtype=bool)
    ratios = tuple(np.log(one[large] / other[large]).tolist())
    many = float(values[some][large].sum())
    return ForceGain(left, nats, t_of_scores(*scores), added, ratios, many, p_of_sign_flips(blocks))


ORDER = 12
"""Lags of the prewhitening filter, in half periods of the cutoff."""


def prewhitened_gain(problem: Problem, before: Array, after: Array, joint: int | None = None) -> ForceGain:
    """The gain of residuals ``after`` over ``before``, both (N, n), after a filter that makes their mean white.

    The filter is 1 − Σ c_k z^−k of ``ORDER`` lags, by least squares on the mean of both residuals, which favours
    neither (generalised least squares with autoregressive errors). So each frequency counts by what both leave there: a
    slow error of the form of friction does not hide a difference at higher frequencies. Two samples in a period of the
    cutoff are used.
    """
    motion, blocks, squares, nats = problem.motion, np.zeros(SIGN_BLOCKS), np.zeros(2), 0.0
    every = motion.step(2)
    for i in range(before.shape[1]) if joint is None else [joint]:
        used = problem.used[::every, i]
        b, a = (np.where(used, r[::every, i], 0.0) for r in (before, after))
        windows = np.lib.stride_tricks.sliding_window_view((a + b) / 2, ORDER + 1)[:, ::-1]
        whole = np.lib.stride_tricks.sliding_window_view(used, ORDER + 1).all(axis=1)
        if whole.sum() < LEAST_ROWS:
            continue
        weights = np.linalg.lstsq(windows[whole, 1:], windows[whole, 0], rcond=None)[0]
        without, with_it = (np.convolve(r, [1.0, *-weights], "valid")[whole] ** 2 for r in (b, a))
        size = max(float(without.sum()), float(with_it.sum()), 1e-300)
        blocks += [part.sum() / size for part in np.array_split(without - with_it, SIGN_BLOCKS)]
        squares += float(without.sum()) / size, float(with_it.sum()) / size
        nats += 0.5 * len(without) * float(np.log(max(without.sum(), 1e-300) / max(with_it.sum(), 1e-300)))
    left = float(squares[1] / squares[0]) if squares[0] > 0 else 1.0
    return ForceGain(left, nats, by_signs=p_of_sign_flips(blocks))


def _sums(values: Array | NDArray[np.bool_], blocks: Sequence[NDArray[np.intp]]) -> Array:
    """Sums over blocks, given by the indices of their samples."""
    return np.array([values[block].sum() for block in blocks], dtype=float)


@dataclass(frozen=True, eq=False)
class ForceCriterion:
    """The force residual of a fit, computed when it is needed.

    Two fits to an arm that is simulated joint by joint are compared at the joint on which their effects differ: a step
    of the links' values that suits this joint may increase the residual at another one, which is explained already.
    """

    search: Search
    fit: Fit

    @cached_property
    def residual(self) -> Array:
        """(N, n) with the friction levels of the fit."""
        return inverse_dynamics_residual(self.fit.model, self.search.motion)

    @cached_property
    def without_levels(self) -> Array:
        """(N, n) residual after regression on the friction levels."""
        return residual_without_levels(self.search.problem, self.fit.model)

    def over(self, other: ForceCriterion) -> ForceGain:
        """The gain of this fit over another by force residual."""
        joint = joint_of_difference(self.search, self.fit, other.fit)
        return force_gain(self.search.problem, other.without_levels, self.without_levels, joint)

    def added_to(self, other: ForceCriterion) -> ForceGain:
        """The gain over a fit with fewer effects, both after regression on levels and toleranced values.

        A refit by free runs may leave a value off by some standard errors of the force. If a refit with a worthless
        effect corrects that, it is no evidence for the effect. Slopes are at the other fit's values.
        """
        if len(self.search.refitted_symbols) == len(self.search.problem.levels):
            return self.over(other)
        joint = joint_of_difference(self.search, self.fit, other.fit)
        own = self.without_values(other.slopes, joint)
        return force_gain(self.search.problem, other.without_own_values(joint), own, joint)

    def over_in_time(self, other: ForceCriterion) -> ForceGain:
        """The gain over a fit with another law of how late an input acts: prewhitened, on ``Motion.finer``.

        A delay and a lag of the same T differ by (ωT)²/2 of the drive force, so by little below the coarse cutoff,
        where what both leave at reversals decides. Where the samples are too far apart for a finer motion, ``over``.
        """
        motion = self.search.motion.finer
        if motion is self.search.motion:
            return self.over(other)
        joint = joint_of_difference(self.search, self.fit, other.fit)
        problem = replace(self.search.problem, motion=motion)
        one, another = (residual_without_levels(problem, c.fit.model) for c in (self, other))
        return prewhitened_gain(problem, another, one, joint)

    @cached_property
    def slopes(self) -> Array:
        """(N, n, p) slopes by the toleranced values, at those of the fit and without its effects.

        Of a loose motor constant they are those in proportion to the drive force (``slopes_of_evidence``).
        """
        search, refitted_values = self.search, self.fit.values[0].tolist()
        values = dict(zip((s.name for s in search.refitted_symbols), refitted_values, strict=True))
        toleranced = search.refitted_symbols[len(search.problem.levels) :]
        return slopes_of_evidence(with_values(search.system, values), search.motion, toleranced, self._limits)

    @identity_cache(OF_MODELS)
    def without_own_values(self, joint: int | None) -> Array:
        """``without_values`` with the fit's own slopes."""
        return self.without_values(self.slopes, joint)

    def without_values(self, slopes: Array, joint: int | None) -> Array:
        """(N, n) residual after regression on levels and toleranced values within their limits."""
        problem, model = self.search.problem, self.fit.model
        return without_values(problem, model, residual_at_drive(model, problem.motion), slopes, self._limits, joint)

    def beyond_values(self, forces: Array) -> Array:
        """(N, n) forces over ``drive_left``, less what levels, toleranced values and a constant force explain."""
        problem, model = self.search.problem, self.fit.model
        return without_values(problem, model, forces, self.slopes, self._limits, constant=True)

    @property
    def _limits(self) -> tuple[Array, Array]:
        """(p,) least and largest change of the toleranced values from those of the fit."""
        prior, first, count = self.fit.prior, len(self.search.problem.levels), len(self.search.refitted_symbols)
        there = self.fit.theta[first:count] - prior.centre[first:count]
        bound = prior.bound[first:count]
        return -bound - there, bound - there


LONGEST = 1 / 12
"""Longest correlation time over the length of the log; slower noise is like an offset or a drift."""
TIMES = 8
"""Number of correlation times of the slow noise."""
SHARES = (0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.8, 0.9, 0.95, 1.0)
"""Shares of the power in the slow noise."""


def slow_noise_likelihood(residual: Array, band: float) -> float:
    """Log-likelihood of a residual (N,) in nats, of white noise plus first-order autoregressive noise.

    By Whittle's approximation, as the best of a grid of noise models:

        max over a, s, τ of −½ Σ_j (ln a S_j + c_j²/(a S_j)),   S = 1 − s + s (1 − φ²)/|1 − φ exp(−iω)|²,  φ = exp(−1/τ)

    with c_j the cosine transform at ω_j = πj/(N·band), which has no jump at the ends, S the spectrum of white noise and
    a share s of first-order autoregressive noise of the correlation time τ, and a its size. Constants are left out.

    Args:
        band: width of the band over the Nyquist frequency: N values hold N·band independent ones.
    """
    lines = round(len(residual) * min(band, 1.0))
    if lines < 4:
        return 0.0
    power = dct(residual, norm="ortho")[:lines] ** 2
    inverse, logarithms = _spectra(lines)
    sizes = np.maximum(inverse @ power, 1e-300) / lines
    return float(np.max(-0.5 * lines * np.log(sizes) - 0.5 * logarithms))


@lru_cache(maxsize=8)
def _spectra(lines: int) -> tuple[Array, Array]:
    """(models, lines) 1/S of each noise model at each spectral line, and (models,) Σ ln S; S: power spectrum."""
    turn = np.exp(-1j * np.pi * np.arange(lines) / lines)
    models = [np.ones(lines)]
    for time in np.geomspace(1.0, max(1.0, lines * LONGEST), TIMES):
        phi = np.exp(-1 / time)
        slow = (1 - phi**2) / np.abs(1 - phi * turn) ** 2
        models += [1 - share + share * slow for share in SHARES]
    spectra = np.array(models)
    return 1 / spectra, np.log(spectra).sum(axis=1)
