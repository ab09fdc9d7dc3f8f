"""Cross-validated evidence for a candidate model: log-likelihood gained on held-out segments, and its significance.

A segment's loss is its negative log-likelihood, K/2 log(1 + RSS/K), with RSS the sum of its K squared residuals in
units of the noise. A model "removes" a share s of the squared residual r² of another one if its own is (1 − s) r².
"""

from dataclasses import dataclass
from math import erfc, exp, log1p, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from codegen.base.arrays import Array
from codegen.diagnosis.fit.linear import independent, limited
from codegen.diagnosis.fit.output_error import BLOCKS, Fit, mean_residuals

ALPHA = 0.01
"""False-alarm rate of one round over all its candidates (Bonferroni); up to three rounds may accept something."""
LEAST_SHARE = 0.05
"""Least share of the squared residual that a candidate must remove (``Evidence.share``)."""
LEAST_SIZE = 5e-3
"""Least RMS force of an effect over the RMS drive force; of an effect that is no force, least ``size_of``."""
LEAST_NET = 1e-3
"""Least RMS of the force of the model with the effect less that of the refit, over the RMS drive force. It is less
than the force of the effect where friction levels can reproduce that. For an effect with states, least ``size_of``."""
NEAR_NOISE = 3.0
"""Largest RMS residual, in units of the noise, at which the Gaussian likelihood is used."""
FAR, FEW = 10.0, 0.05
"""A refit is incomplete if its RMS residual exceeds ``FAR`` times the noise in a share of segments above ``FEW``."""
SETTLED = 1 / 3
"""Largest product of two ratios in ``free_runs_settle``: squared free-run error and squared force residual, each with
the effect over without."""
FURTHER = 0.4
"""Least share of the remaining loss that a further effect must remove; less can be a misfit of the first one's form."""
ELSEWHERE = 0.2
"""The same for a further effect over another variable, which no misfit of the first one's form resembles."""
FURTHER_LOAD = 0.85
"""The same for a load behind a spring beside another effect, which the force residual cannot confirm."""
SIGN_BLOCKS = 48
"""Blocks of consecutive segments in the sign test: a disturbance may last longer than one segment."""
SIGN_STEPS = 2000
"""Grid of ``p_of_sign_flips``: number of steps in Σ |g_b|."""
LEAST_FAR = 5
"""Fewest blocks for a t test on the blocks with large residuals only."""
LARGE = 4.0
"""A block is large if either model's squared residual exceeds this multiple of the median of the smaller one."""
ONLY_NOISE = 1.2
"""Squared ratio of residual to noise up to which the likelihood of free runs counts without a test on blocks."""
AT_NOISE = 0.05
"""Relative excess of the loss over that of pure noise below which the search for effects ends."""
TIE_LEVEL = 0.05
TIE_RATIO = 2.0
"""A rival ties with the best candidate if p > ``TIE_LEVEL``, with at most ``TIE_RATIO`` times its squared residual."""
TESTS_OF_RIVALS = 5
"""Number of tests of two rivals at the noise, of which the smallest p is taken (Bonferroni)."""
EXPLAINED = 2.0
"""A segment's gain counts in the likelihood ratio if the candidate's squared residual there is at most this multiple of
that of the noise, or of its own median segment. With 40 values of white noise one segment in 10,000 exceeds it."""
MOST_NATS = 2.0
"""Largest gain of one of the ``SIGN_BLOCKS`` blocks that counts in ``Evidence.capped``."""
MOST = 0.97
"""``size_of`` and ``misfit`` are RMS values over this share of the segments, those with the least change."""
GAIN_STEP = 1e-3
"""Relative step of the drive force in the finite difference of ``_over_drive``."""


@dataclass(frozen=True)
class Evidence:
    """Comparison of a fit with the one before it, on held-out segments.

    Attributes:
        gain: log-likelihood gained, summed over segments, nats.
        share: removed share of the squared residual, of its geometric mean over segments or of its sum, whichever is
            larger, since an effect that acts in few segments removes little of the mean.
        t: Σ g_b / √Σ g_b² over the gains of ``signed`` blocks of segments; a z-score if their signs are random.
        won, blocks: number of the cross-validated blocks with a gain, and of all.
        where_far, where_large: p-value of Student's t test on log ratios of squared residuals, over the blocks in which
            either model's residual exceeds ``FAR`` times the noise, or over those chosen by ``LARGE``; 1 if these are
            too few.
        by_score: p-value of ``score_test``, if the fit contains the one before it.
        likely: the gain in nats without those of segments of which the candidate leaves more than noise
            (``EXPLAINED``).
        capped: the gain in nats with at most ``MOST_NATS`` from each block, so that few blocks do not decide.
    """

    gain: float
    share: float
    t: float
    won: int
    blocks: int
    where_far: float = 1.0
    where_large: float = 1.0
    signed: int = 0
    by_score: float | None = None
    capped: float = 0.0
    likely: float = 0.0

    def p(self, whiteness: float, only_noise: bool = True) -> float:
        """One-sided p-value of the gain under "no effect": the smallest of several, times their number (Bonferroni).

        The tests are

        - a sign test on all blocks;
        - the likelihood ratio of white noise, without gains in segments of which the candidate leaves more than noise:
          what it leaves of a disturbance is one error, however many values of the segment it changes;
        - two t tests on blocks with large residuals, for an effect that acts in few blocks;
        - the score test, if one model contains the other.

        Args:
            whiteness: share of the candidate's residuals that are independent.
            only_noise: whether the candidate leaves only noise. If not, its errors may be correlated between segments,
                and few segments may decide the likelihood ratio of two wrong models. The likelihood ratio then counts
                only as far as a t test on blocks agrees with it.
        """
        likelihood = exp(-max(whiteness * self.likely, 0.0))
        if not only_noise:
            likelihood = max(likelihood, self.by_blocks)
        tests = [random_signs(self.t), likelihood, self.where_far, self.where_large]
        tests += [] if self.by_score is None else [self.by_score]
        return min(1.0, len(tests) * min(tests))

    def p_of_rivals(self, whiteness: float, at_noise: bool, by_prior: float = 0.0) -> float:
        """One-sided p-value for two models neither of which contains the other: ``p``, at the noise also by ``capped``.

        If the other model is true, the mean of the likelihood ratio is 1, and a gain of G nats has at most the
        probability exp(−G) (Markov's inequality). A cap does not increase a gain, so this also holds for ``capped``.

        Args:
            by_prior: nats by which the prior density of the values is larger than that of the other model's values.
        """
        p = self.p(whiteness, only_noise=False)
        return min(p, TESTS_OF_RIVALS * exp(-max(whiteness * self.capped + by_prior, 0.0))) if at_noise else p

    @property
    def by_blocks(self) -> float:
        """One-sided p-value of Student's t test on the gains of B blocks, assumed normal: t √((B − 1)/(B − t²))."""
        spread = self.signed - self.t**2
        if self.signed < 2:
            return 1.0
        return float(student.sf(self.t * sqrt((self.signed - 1) / max(spread, 1e-12)), self.signed - 1))


def random_signs(t: float) -> float:
    """One-sided p-value of ``Evidence.t`` if the gain of each block has a random sign: 1 − Φ(t), Φ the normal CDF.

    It is too small for few blocks: B equal gains have t = √B and are all positive with the probability 2^−B, which is 3
    times 1 − Φ(√B) for B = 3 and 1.7 times for B = 8.
    """
    return 0.5 * erfc(t / sqrt(2))


def p_of_sign_flips(gains: Array) -> float:
    """One-sided p-value of ``exact_sign_flips``, not less than that of ``random_signs``."""
    norm = float(np.linalg.norm(gains))
    normal = random_signs(float(gains.sum()) / norm) if 0 < norm < np.inf else 1.0
    return min(1.0, max(exact_sign_flips(gains), normal))


def exact_sign_flips(gains: Array) -> float:
    """One-sided p-value of a sign-flip test: P(Σ s_b |g_b| ≥ Σ g_b) for independent random signs s_b = ±1.

    The distribution of Σ s_b |g_b| is the inverse Fourier transform of its characteristic function Π cos(ω |g_b|), with
    the |g_b| rounded to a grid.
    """
    sizes = np.abs(gains)
    whole = float(sizes.sum())
    if not 0 < whole < np.inf:
        return 1.0
    steps = np.rint(sizes * (SIGN_STEPS / whole)).astype(np.int32)
    most, reached = int(steps.sum()), int((np.sign(gains) * steps).sum())
    length = 2 * (most + 1)  # sums lie from −most to most
    turns = np.arange(length // 2 + 1, dtype=np.int32)[:, None] * steps % length
    cosines = np.cos(2 * np.pi / length * np.arange(length))
    probabilities = np.fft.irfft(cosines[turns].prod(axis=1), length)
    return min(1.0, float(probabilities[np.arange(reached, most + 1)].sum()))


def evidence_of(before: Fit, after: Fit, floored: bool = True) -> Evidence:
    """Evidence for ``after`` by held-out losses; with ``floored``, losses are raised to that of pure noise."""
    losses = before.held_out_losses
    floor = noise_loss(before) / len(losses) if floored else 0.0
    return evidence(losses, after.held_out_losses, before.residual.shape[1], floor)


def most_explained(fit: Fit) -> float:
    """Largest ``Evidence.share`` that ``evidence_of`` can give to a fit after this one: it then leaves noise alone."""
    losses, floor = fit.held_out_losses, noise_loss(fit) / len(fit.residual)
    return evidence(losses, np.full(len(losses), floor), fit.residual.shape[1], floor).share


def evidence(base: Array, other: Array, kept: int, floor: float = 0.0) -> Evidence:
    """Evidence for a model over another one, from their held-out losses ``other`` and ``base`` of the segments, (S,).

    ``kept``: K, number of residuals in a segment; ``floor``: loss of a segment of pure noise, to which smaller ones are
    raised.
    """
    gains = np.maximum(base, floor) - np.maximum(other, floor)
    total = float(gains.sum())
    spread = float(np.sqrt((in_blocks(gains) ** 2).sum()))
    wins = [block.sum() > 0 for block in np.array_split(gains, BLOCKS)]
    before, after, noise = (_squares(losses, kept) for losses in (base, other, np.full(len(base), floor)))
    disturbed = after > EXPLAINED * max(float(np.median(after)), float(noise[0]))
    of_mean = float(1 - np.exp(-2 * total / (len(gains) * kept)))
    sum_before, sum_after, sum_noise = float(before.sum()), float(after.sum()), len(gains) * float(noise[0])
    of_sum = 1 - max(sum_after, sum_noise) / sum_before if sum_before > sum_noise else 0.0
    far = large = 1.0
    if floor:  # blocks are chosen by both models alike: a choice by the one before alone would favour the other
        least = in_blocks(noise)
        first, second = (np.maximum(in_blocks(squares), least) for squares in (before, after))
        far = p_of_log_ratios(np.log((first / second)[np.maximum(first, second) > FAR**2 * least]))
        first, second = (in_blocks(np.maximum(squares, noise)) for squares in (before, after))
        large = p_of_log_ratios(np.log((first / second)[are_large(first, second)]))
    return Evidence(
        gain=total,
        share=max(of_mean, of_sum),
        t=total / spread if spread > 0 else 0.0,
        won=int(sum(wins)),
        blocks=len(wins),
        where_far=far,
        where_large=large,
        signed=min(SIGN_BLOCKS, len(gains)),
        capped=float(np.minimum(in_blocks(gains), MOST_NATS).sum()),
        likely=float(np.where(disturbed, np.minimum(gains, 0.0), gains).sum()),
    )


def in_blocks(values: Array) -> Array:
    """Sums over ``SIGN_BLOCKS`` blocks of consecutive segments."""
    return np.array([b.sum() for b in np.array_split(values, min(SIGN_BLOCKS, len(values)))])


def are_large(before: Array, after: Array) -> NDArray[np.bool_]:
    """The blocks chosen by ``LARGE``."""
    return np.asarray(np.maximum(before, after) > LARGE * float(np.median(np.minimum(before, after))))


def p_of_log_ratios(logarithms: Array) -> float:
    """One-sided p-value of Student's t test that log(before/after) has a positive mean over blocks.

    1 for fewer than ``LEAST_FAR`` blocks. The logarithms are taken as normally distributed; with two different values
    only, as of diverging runs, the test is not valid.
    """
    if len(logarithms) < LEAST_FAR or not logarithms.std() > 0:
        return 1.0
    count = len(logarithms)
    t = float(logarithms.mean()) / (float(logarithms.std(ddof=1)) / sqrt(count))
    return float(student.sf(t, count - 1))


def _squares(losses: Array, kept: int) -> Array:
    """RSS = K (exp(2 loss/K) − 1), the inverse of ``segment_losses``; K = ``kept``."""
    return np.asarray(kept * np.expm1(np.minimum(2 * losses / kept, 600.0)))


def independent_share(fit: Fit) -> float:
    """Share of independent residuals (1 − φ)/(1 + φ), φ the median over segments of the autocorrelation at lag 1."""
    n = fit.offsets.shape[1] // 2
    residual = fit.residual.reshape(len(fit.residual), -1, n)
    power = (residual**2).sum(axis=(1, 2))
    phis = (residual[:, 1:] * residual[:, :-1]).sum(axis=(1, 2)) / np.maximum(power, 1e-300)
    return independent(limited(float(np.median(phis))))


def noise_loss(fit: Fit) -> float:
    """Expected loss of a model whose residual is measurement noise alone: RSS = K − (free start-state components)."""
    segments, kept = fit.residual.shape
    free = fit.starts.slopes.shape[2]
    return float(0.5 * segments * kept * float(np.log1p((kept - free) / kept)))


def size_of(fit: Fit, base: Fit) -> float:
    """RMS change of the prediction by the candidate, over the RMS change by the whole drive force."""
    change = base.residual_of(fit.runner, fit.theta) - base.unprojected
    return _over_drive(base.starts.project(change, slope=True), base)


def misfit(base: Fit) -> float:
    """RMS residual over the RMS change of the prediction by the whole drive force."""
    return _over_drive(base.residual, base)


def is_negligible(fit: Fit) -> bool:
    """Whether the RMS residual of all segments is below ``LEAST_NET`` of the RMS change by the drive force."""
    return _over_drive(fit.residual, fit, 1.0) < LEAST_NET


def _over_drive(change: Array, base: Fit, share: float = MOST) -> float:
    """RMS of a change of the prediction over that by the drive force, over the ``share`` of least changed segments."""
    runner = base.runner
    reduced = mean_residuals(runner, runner.run(base.theta, base.offsets, 1 - GAIN_STEP))
    by_drive = base.starts.project((base.unprojected - reduced) / GAIN_STEP, slope=True)
    power, drive_power = (change**2).sum(axis=1), (by_drive**2).sum(axis=1)
    kept = power <= np.quantile(power, share)
    return float(np.sqrt(power[kept].sum() / max(float(drive_power[kept].sum()), 1e-300)))


def share_far(fit: Fit) -> float:
    """Share of the segments whose RMS residual is above ``FAR`` times the noise."""
    return float((fit.by_segment > FAR**2 * fit.residual.shape[1]).mean())


def noise_ratio(fit: Fit) -> float:
    """Median over segments of the RMS residual, in units of the noise."""
    return float(np.sqrt(np.median(fit.by_segment) / fit.residual.shape[1]))


def is_far(fit: Fit) -> bool:
    """Whether a model leaves far more than the noise in the median segment, so that it is incomplete."""
    return noise_ratio(fit) > NEAR_NOISE


def near_noise(fit: Fit, times: float = 1.0) -> bool:
    """Whether the residual is near the noise, in the median and in all but a share ``FEW`` of the segments."""
    return noise_ratio(fit) * times <= NEAR_NOISE and share_far(fit) <= FEW


def leaves_only_noise(fit: Fit, times: float = 1.0) -> bool:
    """Whether the residual is that of noise: both its median square and its mean loss are at most at ``ONLY_NOISE``."""
    squares = times**2 * fit.by_segment / fit.residual.shape[1]
    return float(np.median(squares)) <= ONLY_NOISE and float(np.log1p(squares).mean()) <= log1p(ONLY_NOISE)


def free_runs_settle(fit: Fit, share: float, times: float) -> bool:
    """Whether free runs accept a model although it increases the force residual, squared, by the factor ``times``.

    They must end near the noise, which no wrong model does, and their squared error must decrease, by ``share``, by a
    larger factor (``SETTLED``). The force residual shows neither a narrow Stribeck peak nor a load behind a spring.
    """
    return near_noise(fit) and (1 - share) * times < SETTLED
