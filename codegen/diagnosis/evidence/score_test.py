"""Score test in free runs: whether the misfit of a model points along the change of the prediction by an added effect.

A gain in loss is less by what the effect itself amounts to than twice the slope of the loss towards it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import f

from codegen.base.arrays import Array
from codegen.diagnosis.fit.credit import Evidence, evidence_of, in_blocks
from codegen.diagnosis.fit.linear import correlation, solved
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.trial import Trial


def contains(richer: Trial, trial: Trial) -> bool:
    """Whether a trial has every part of another one, at least in its form, so that it contains that model."""
    own = {(p.kind, p.on): set(p.names) for p in richer.parts}
    return all(set(p.names) <= own.get((p.kind, p.on), set()) for p in trial.parts)


def added_parameters(trial: Trial, richer: Trial) -> int:
    """Number of parameters of the effects that a trial has and another has not, or has in a simpler form."""
    known = {(p.kind, p.on): len(p.names) for p in trial.parts}
    return sum(max(0, len(p.names) - known.get((p.kind, p.on), 0)) for p in richer.parts)


def nested_evidence_of(before: Fit, after: Fit) -> Evidence:
    """Evidence for ``after`` over ``before``, a model that it contains, on the same segments: the score test too."""
    return replace(evidence_of(before, after), by_score=score_test(before, after))


def score_test(before: Fit, after: Fit) -> float:
    """Probability of such a slope of the loss towards ``after`` where ``before``, which it contains, is true.

        u_s = w_s r_s·d_s,   q_s = w_s d_s·d_s,   d = r − r₁ less its part along the slopes of ``before``

    with r and r₁ the residuals of segment s without and with the added parameters, and w_s = 1/(1 + (r² + (r −
    r₁)²)/K), which lets no run decide that leaves the motion, in either model, and favours no sign of r·(r − r₁). Along
    d the parameters that both have are at their optimum, so u_s has the mean zero if nothing is added. Sums over
    ``SIGNED`` blocks of segments are judged by ``t_of_scores``.
    """
    change = before.residual - after.residual
    weights = 1 / (1 + (before.residual**2 + change**2).mean(axis=1))
    change = _beside_its_own(before, change, weights)
    scores, sizes = (in_blocks(weights * (r * change).sum(axis=1)) for r in (before.residual, change))
    return along_best(*t_of_scores(scores, sizes), len(after.theta) - len(before.theta))


def t_of_scores(scores: Array, sizes: Array) -> tuple[float, float]:
    """Student's t of the sums U_b of scores r·d over blocks, and the number of blocks that it rests on.

    ΣU_b/ΣQ_b = c, with Q_b the sums of d·d, is the size of d by one step, its standard error that of the jackknife, and
    t is c over this error. Blocks count as 1/Σh_b² at most, h_b the shares of Q_b (Kish's effective number), and as B
    (1 − φ)/(1 + φ), φ the autocorrelation at lag 1 of U_b − c Q_b: a slow disturbance makes neighbours alike.
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
    """Probability of Student's t of B blocks along the best of all directions of k fitted parameters.

    The largest t² is Hotelling's T², and T² (B − k)/(k (B − 1)) has the F distribution of k and B − k.
    """
    k = max(parameters, 1)
    if blocks <= k or t <= 0:
        return 1.0
    return float(f.sf(t**2 * (blocks - k) / (k * (blocks - 1)), k, blocks - k))


def _beside_its_own(fit: Fit, change: Array, weights: Array) -> Array:
    """A change of the prediction, (S, K n), less its weighted projection on the slopes of the fit's free parameters.

    A fit stops a little before its optimum; what a further step would gain is no evidence for an effect.
    """
    slopes = fit.slopes[~fit.limited]
    if not len(slopes):
        return change
    weighted = (slopes * weights[:, None]).reshape(len(slopes), -1)
    matrix = weighted @ slopes.reshape(len(slopes), -1).T + np.diag(fit.prior.precision[~fit.limited])
    return np.asarray(change - np.tensordot(solved(matrix, weighted @ change.ravel()), slopes, axes=1))
