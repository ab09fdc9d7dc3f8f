"""Evidence for a candidate: gain in log-likelihood on segments that its fit did not use, and its significance."""

from __future__ import annotations

from dataclasses import dataclass
from math import erfc, exp, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from codegen.diagnosis.output_error import BLOCKS, Fit, mean_residuals

Array = NDArray[np.float64]

ALPHA = 0.01
"""False-alarm rate of one log over all candidates (Bonferroni)."""
LEAST_SHARE = 0.05
"""Least share of the squared residual that a candidate removes (geometric mean over held-out segments)."""
LEAST_SIZE = 5e-3
"""Least force of an effect over the drive force (RMS); for an effect that is no force, its change of the prediction."""
LEAST_NET = 1e-3
"""Least RMS difference, over the drive force, between the model with the effect and the refit without, as levels may
explain nearly all of a large effect; for one that adds states, its change of the prediction over the drive force's."""
NEAR_NOISE = 3.0
"""Multiple of the noise up to which a model's error is judged by the Gaussian likelihood."""
FAR, FEW = 10.0, 0.05
"""A refit with residuals above this multiple of the noise in more than this share of the segments lacks something
there, however well it fits the others. No practice log without an effect has more."""
SETTLED = 1 / 3
"""Free runs settle a question where what they leave, times the factor by which the squared force residual grows, is
below this share of what they left before."""
FURTHER = 0.4
"""Least share of the remaining loss that a second or third effect removes; less can be a misfit of the first effect's
form."""
SIGNED = 48
"""Blocks of neighbouring segments for the sign test; a disturbance may last longer than one segment."""
LEAST_FAR = 5
"""Fewest blocks far above the noise that are compared by themselves."""
LARGE = 4.0
"""A block is one of those with most to explain where one of two models leaves more than this many times the squared
residual that the better of them leaves in the median block."""
AT_NOISE = 0.05
"""A loss this near to that of pure noise leaves nothing to find."""
TIE_LEVEL = 0.05
TIE_RATIO = 2.0
"""A rival ties with the best where p > ``TIE_LEVEL`` and it leaves at most this many times the squared residual."""
GAIN_STEP = 1e-3


@dataclass(frozen=True)
class Evidence:
    """Held-out comparison of one fit with another.

    Attributes:
        gain: nats of log-likelihood, summed over segments.
        share: of the squared residual that is removed: of its geometric mean over segments or of its sum, whichever is
            larger. An effect that acts in few segments removes most of the sum and little of the mean.
        t: sum of the gains of blocks of segments over the root of the sum of their squares: a z-score if each block's
            gain has a random sign.
        won, blocks: blocks of segments on which it is better.
        where_far: one-sided p, by Student's t test on the ratios of squared residuals, in the blocks where one of the
            two is far above the noise; 1 where these are too few. where_large: in the blocks with most to explain.
    """

    gain: float
    share: float
    t: float
    won: int
    blocks: int
    where_far: float = 1.0
    where_large: float = 1.0

    def p(self, whiteness: float) -> float:
        """One-sided probability of such gains without an effect: the smallest of four tests, times four.

        The sign test on all blocks; the likelihood ratio, valid near the noise; and the two t tests on blocks where
        something is missing, for an effect that acts in few of them.

        Args:
            whiteness: share of the candidate's residuals that are independent.
        """
        likelihood = exp(-max(whiteness * self.gain, 0.0))
        return min(1.0, 4 * min(random_signs(self.t), likelihood, self.where_far, self.where_large))


def random_signs(t: float) -> float:
    """One-sided probability of ``t`` where the gain of each block has a random sign."""
    return 0.5 * erfc(t / sqrt(2))


def evidence_of(before: Fit, after: Fit, floored: bool = True) -> Evidence:
    """Evidence for a fit over another by held-out losses.

    Args:
        floored: whether a loss below that of pure noise earns no credit.
    """
    losses = before.held_out_losses
    floor = noise_loss(before) / len(losses) if floored else 0.0
    return evidence(losses, after.held_out_losses, before.residual.shape[1], floor)


def evidence(base: Array, other: Array, kept: int, floor: float = 0.0) -> Evidence:
    """Evidence for ``other`` over ``base``, both (S,) held-out losses of ``kept`` residuals a segment.

    Args:
        floor: loss of a segment whose residual is pure noise; a loss below it earns no credit.
    """
    gains = np.maximum(base, floor) - np.maximum(other, floor)
    spread = float(np.sqrt((_in_blocks(gains) ** 2).sum()))
    blocks = np.array([b.sum() for b in np.array_split(gains, BLOCKS)])
    each = [_squares(losses, kept) for losses in (base, other)]
    squares, noise = [float(one.sum()) for one in each], float(_squares(np.array([floor]), kept)[0])
    least, far, large = len(gains) * noise, 1.0, 1.0
    if floor:
        before, after, own = (_in_blocks(values) for values in (*each, np.full(len(base), noise)))
        far = _of_ratios(np.maximum(before, own), np.maximum(after, own), FAR**2 * own)
        large = where_large(*(_in_blocks(np.maximum(one, noise)) for one in each))
    return Evidence(
        float(gains.sum()),
        max(
            float(1 - np.exp(-2 * gains.sum() / (len(gains) * kept))),
            1 - max(squares[1], least) / squares[0] if squares[0] > least else 0.0,
        ),
        float(gains.sum() / spread) if spread > 0 else 0.0,
        int((blocks > 0).sum()),
        len(blocks),
        far,
        large,
    )


def _in_blocks(values: Array) -> Array:
    """Sums over ``SIGNED`` blocks of neighbours."""
    return np.array([b.sum() for b in np.array_split(values, min(SIGNED, len(values)))])


def where_large(before: Array, after: Array) -> float:
    """One-sided probability of the ratios of two models' squared residuals where there is most to explain."""
    return _of_ratios(before, after, LARGE * float(np.median(np.minimum(before, after))))


def _of_ratios(before: Array, after: Array, above: Array | float) -> float:
    """Probability by a t test on log(after/before) of the blocks where either is above a bound; 1 if they are few.

    Blocks chosen by ``before`` alone would favour any other model: their residual is large by chance too.
    """
    chosen = np.maximum(before, after) > above
    if chosen.sum() < LEAST_FAR:
        return 1.0
    ratios = np.log(after[chosen] / before[chosen])
    spread = float(ratios.std(ddof=1)) / sqrt(len(ratios))
    return float(student.sf(-ratios.mean() / spread, len(ratios) - 1)) if spread > 0 else 1.0


def _squares(losses: Array, kept: int) -> Array:
    """Squared residuals with these losses: the inverse of ``segment_losses``."""
    return np.asarray(kept * np.expm1(np.minimum(2 * losses / kept, 600.0)))


def independent_share(fit: Fit) -> float:
    """Share of independent residuals, (1 − φ)/(1 + φ), with φ the correlation of neighbours."""
    n = fit.offsets.shape[1] // 2
    rows = fit.residual.reshape(len(fit.residual), -1, n)
    power = (rows**2).sum(axis=(1, 2))
    phi = float(np.median((rows[:, 1:] * rows[:, :-1]).sum(axis=(1, 2)) / np.maximum(power, 1e-300)))
    phi = min(max(phi, 0.0), 0.99)
    return float((1 - phi) / (1 + phi))


def noise_loss(fit: Fit) -> float:
    """The loss of a model whose residual is the noise of the positions and nothing else."""
    segments, kept = fit.residual.shape
    free = fit.starts.slopes.shape[2]
    return float(0.5 * segments * kept * float(np.log1p((kept - free) / kept)))


def size_of(fit: Fit, base: Fit) -> float:
    """RMS change of the prediction by the candidate, over that by the whole drive force."""
    moved = mean_residuals(fit.runner, fit.runner.run(fit.theta, base.offsets))
    return _over_drive(base.starts.project(moved - base.unprojected, slope=True), base)


def misfit(base: Fit) -> float:
    """RMS of the residual motion over the change of the prediction by the whole drive force."""
    return _over_drive(base.residual, base)


def _over_drive(change: Array, base: Fit) -> float:
    """RMS of a change over RMS of the change by the drive force, without the 3 % of segments that change most."""
    runner = base.runner
    less = mean_residuals(runner, runner.run(base.theta, base.offsets, 1 - GAIN_STEP))
    drive = base.starts.project((base.unprojected - less) / GAIN_STEP, slope=True)
    power, driven = (change**2).sum(axis=1), (drive**2).sum(axis=1)
    kept = power <= np.quantile(power, 0.97)
    return float(np.sqrt(power[kept].sum() / max(float(driven[kept].sum()), 1e-300)))


def share_far(fit: Fit) -> float:
    """Share of the segments whose RMS residual is above ``FAR`` times the noise."""
    return float((fit.by_segment > FAR**2 * fit.residual.shape[1]).mean())


def noise_ratio(fit: Fit) -> float:
    """Median over segments of the RMS residual, in units of the noise."""
    return float(np.sqrt(np.median(fit.by_segment) / fit.residual.shape[1]))


def near_noise(fit: Fit, times: float = 1.0) -> bool:
    """Whether the Gaussian likelihood holds: in the median, and in all but a few segments.

    Args:
        times: the fit's noise over the measurement's, for the median.
    """
    return noise_ratio(fit) * times <= NEAR_NOISE and share_far(fit) <= FEW


def free_runs_settle(fit: Fit, share: float, times: float) -> bool:
    """Whether free runs credit a model although it makes the force residual larger.

    They must end at the noise in nearly all segments, which no wrong model does, and improve far more than the force
    residual gets worse: it is low-passed and shows no narrow Stribeck peak at a reversal, nor a load behind a spring.

    Args:
        share: of the squared free-run residual that the model removes.
        times: squared force residual over that of the model without it.
    """
    return near_noise(fit) and (1 - share) * times < SETTLED
