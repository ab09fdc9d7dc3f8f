"""Score test in free runs: correlation of a model's residual with the change of the prediction by an added effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import f

from codegen.base.arrays import Array
from codegen.diagnosis.fit.acceptance import Evidence, evidence_of, in_blocks
from codegen.diagnosis.fit.linear import correlation, solved
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.trial import Trial


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
