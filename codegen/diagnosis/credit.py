"""What a candidate is credited with: how much better it predicts segments that its fit did not see, and how surely."""

from __future__ import annotations

from dataclasses import dataclass
from math import erfc, exp, sqrt

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.output_error import Shot, means, scales, segment_losses, segment_weights

Array = NDArray[np.float64]

BLOCKS = 8
ALPHA = 0.01
"""False-alarm rate of one log over all candidates (Bonferroni), by random signs on the gains of segments."""
LEAST_SHARE = 0.05
"""A candidate removes at least this share of the squared residual (geometric mean over held-out segments)."""
LEAST_SIZE = 5e-3
"""Its force is at least this share of the drive force (RMS); where it is no force, its change of the prediction is."""
LEAST_NET = 1e-3
"""Of the drive force: what the force of a model with the effect differs by, at least, from that of the refit without.
An effect may be large while the refitted friction levels take nearly all of it. Of one that adds states: what it
changes the prediction by, over what the drive force does to it."""
NEAR_NOISE = 3.0
"""Only a model whose error is within this of the noise is judged by the likelihood that the noise gives it."""
FAR, FEW = 10.0, 0.05
"""A refit that leaves more than so many times the noise in more than this share of the segments lacks something there,
however well it fits the others. Of the practice logs without an effect none has more."""
FURTHER = 0.4
"""What a second or third effect removes of what is left, at least: less is what the first, in its standard form, does
not fit of the true one."""
SIGNED = 48
"""Blocks of neighbouring segments whose gains may have either sign without an effect; a disturbance may outlast one
segment."""
AT_NOISE = 0.05
"""A model whose loss is this near to that of pure noise has nothing left to find."""
TIE_LEVEL = 0.05
TIE_RATIO = 2.0
"""A rival ties with the best where p > ``TIE_LEVEL`` and it leaves at most so many times the squared residual."""
GAIN_STEP = 1e-3


@dataclass(frozen=True)
class Evidence:
    """What held-out segments say for one fit over another.

    Attributes:
        gain: nats of log-likelihood, summed over segments.
        share: of the squared residual that is removed: of its geometric mean over segments or of its sum, whichever is
            larger. An effect that acts in a few segments alone removes most of the sum and little of the mean.
        t: sum of the gains of blocks of neighbouring segments over the root of the sum of their squares: what it would
            be in standard deviations if every block's gain could as well have had the other sign.
        won, blocks: blocks of segments on which it is better.
    """

    gain: float
    share: float
    t: float
    won: int
    blocks: int

    def p(self, whiteness: float) -> float:
        """One-sided probability of such gains without an effect.

        The smaller of two tests, doubled: random signs on the gains of segments, which a gain in few segments cannot
        pass; and the likelihood ratio with the number of residuals that are independent, which counts where the
        candidate's own residual is near the noise.

        Args:
            whiteness: share of the candidate's residuals that are independent.
        """
        return min(1.0, 2 * min(random_signs(self.t), exp(-max(whiteness * self.gain, 0.0))))


def random_signs(t: float) -> float:
    """One-sided probability of ``t`` where the gain of each block could as well have had the other sign."""
    return 0.5 * erfc(t / sqrt(2))


def held_out_losses(shot: Shot) -> Array:
    """(S,) loss of each segment under the fit to the other blocks of segments, by one Gauss–Newton step back."""
    residual, slopes = shot.residual, shot.slopes
    segments = len(residual)
    if not len(slopes):
        return segment_losses(residual)
    weighted = slopes * segment_weights(residual)[:, None]
    normal = np.einsum("ask,bsk->sab", weighted, slopes, optimize=True)
    right = np.einsum("ask,sk->sa", weighted, residual)
    losses = np.empty(segments)
    prior = np.diag(shot.price)
    for block in np.array_split(np.arange(segments), BLOCKS):
        rest = np.setdiff1d(np.arange(segments), block)
        matrix = normal[rest].sum(axis=0) + prior
        size = scales(matrix)
        pull = right[rest].sum(axis=0) - shot.price * (shot.theta - shot.centre)
        step = np.linalg.lstsq(matrix / np.outer(size, size), pull / size, rcond=1e-10)[0] / size
        losses[block] = segment_losses(residual[block] - np.tensordot(step, slopes[:, block], axes=1))
    return losses


def evidence(base: Array, other: Array, kept: int, floor: float = 0.0) -> Evidence:
    """For ``other`` over ``base``, both (S,) held-out losses of ``kept`` residuals a segment.

    Args:
        floor: loss of a segment whose residual is the noise: nobody is credited for less.
    """
    gains = np.maximum(base, floor) - np.maximum(other, floor)
    signed = np.array([b.sum() for b in np.array_split(gains, min(SIGNED, len(gains)))])
    spread = float(np.sqrt((signed**2).sum()))
    blocks = np.array([b.sum() for b in np.array_split(gains, BLOCKS)])
    squares = [float(_squares(losses, kept).sum()) for losses in (base, other)]
    least = float(len(gains) * _squares(np.array([floor]), kept)[0])
    return Evidence(
        float(gains.sum()),
        max(
            float(1 - np.exp(-2 * gains.sum() / (len(gains) * kept))),
            1 - max(squares[1], least) / squares[0] if squares[0] > least else 0.0,
        ),
        float(gains.sum() / spread) if spread > 0 else 0.0,
        int((blocks > 0).sum()),
        len(blocks),
    )


def _squares(losses: Array, kept: int) -> Array:
    """The squared residuals that have these losses: the inverse of ``segment_losses``."""
    return np.asarray(kept * np.expm1(np.minimum(2 * losses / kept, 600.0)))


def independent_share(shot: Shot) -> float:
    """Share of the residuals that count as independent: (1 − φ)/(1 + φ) with φ the correlation of neighbours."""
    n = shot.offsets.shape[1] // 2
    rows = shot.residual.reshape(len(shot.residual), -1, n)
    power = (rows**2).sum(axis=(1, 2))
    phi = float(np.median((rows[:, 1:] * rows[:, :-1]).sum(axis=(1, 2)) / np.maximum(power, 1e-300)))
    phi = min(max(phi, 0.0), 0.99)
    return float((1 - phi) / (1 + phi))


def noise_loss(shot: Shot) -> float:
    """The loss of a model whose residual is the noise of the positions and nothing else."""
    segments, kept = shot.residual.shape
    free = shot.starts.slopes.shape[2]
    return float(0.5 * segments * kept * float(np.log1p((kept - free) / kept)))


def size_of(shot: Shot, base: Shot) -> float:
    """How much the candidate changes the prediction, over what the whole drive force does to it."""
    runner = base.runner
    now = means(runner, runner.run(base.theta, base.offsets))
    change = base.starts.project(means(shot.runner, shot.runner.run(shot.theta, base.offsets)) - now, slope=True)
    return _over_drive(change, now, base)


def misfit(base: Shot) -> float:
    """What is left of the measured motion, over what the whole drive force does to it."""
    runner = base.runner
    return _over_drive(base.residual, means(runner, runner.run(base.theta, base.offsets)), base)


def _over_drive(change: Array, now: Array, base: Shot) -> float:
    """RMS over RMS, without the few segments that change most."""
    runner = base.runner
    less = means(runner, runner.run(base.theta, base.offsets, 1 - GAIN_STEP))
    drive = base.starts.project((now - less) / GAIN_STEP, slope=True)
    power, driven = (change**2).sum(axis=1), (drive**2).sum(axis=1)
    kept = power <= np.quantile(power, 0.97)
    return float(np.sqrt(power[kept].sum() / max(float(driven[kept].sum()), 1e-300)))


def share_far(shot: Shot) -> float:
    """Share of the segments whose RMS residual is above ``FAR`` times the noise."""
    return float((shot.by_segment > FAR**2 * shot.residual.shape[1]).mean())


def level(shot: Shot) -> float:
    """Median over segments of the RMS residual, in noise."""
    return float(np.sqrt(np.median(shot.by_segment) / shot.residual.shape[1]))
