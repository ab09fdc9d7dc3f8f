"""Significance of a candidate's gain: its p-value over all hypotheses that were tried (Bonferroni's correction).

The p-value is that of the gain of free runs on held-out segments, or also that of the force residual where free runs
leave doubt.
"""

from collections.abc import Sequence
from math import comb, prod

import numpy as np

from codegen.diagnosis.evidence.force_gain import ForceCriterion, added_parameters, beyond
from codegen.diagnosis.evidence.reservations import resolvable_periods
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import Evidence, independent_share, near_noise, noise_ratio
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import worded

FORCE_SHARE, FORCE_SHARE_OF_FEW = 0.1, 0.5
"""Share of α for the test on the force residual (weighted Bonferroni), and that for logs of fewer than
``acceptance.SIGN_BLOCKS`` segments, since a sign test on B segments gives at least Φ(−√B)."""


def hypotheses(parts: Sequence[Part]) -> int:
    """Number of candidates for Bonferroni's correction; nested forms of one effect count once."""
    return len({p.key for p in parts})


def hypotheses_tried(search: Search, before: Fit, after: Fit, candidates: int) -> float:
    """Number of hypotheses among which the additional effects of a model were chosen.

    It counts every set of as many of the candidates, and for an effect with an unknown period each resolvable period.
    """
    parts, values = after.trial.parts, after.values[1]
    added = [(parts[k], values[k]) for k in beyond(after.trial, before.trial)]
    sets = comb(max(candidates, len(added)), len(added))
    return sets * prod(resolvable_periods(search.system, search.motion, p, values) for p, values in added)


def p_by_free_runs(search: Search, fit: Fit, evidence: Evidence, candidates: float) -> float:
    """Nominal probability that any of ``candidates`` hypotheses gains as much by chance in free runs (Bonferroni).

    ``fit``: with the candidate; ``evidence``: its gain over the fit without it.
    """
    only_noise = acceptance.leaves_only_noise(fit, noise_assumed(search, fit))
    return min(1.0, candidates * evidence.p(whiteness(search, fit), only_noise))


def chance_in_words(p: float, many: float) -> str:
    """A p-value over so many hypotheses: why a gain on every held-out part may still be chance."""
    return worded("chance", p=p, many=many, alpha=acceptance.ALPHA)


def combined_p(p: float, before: ForceCriterion, after: ForceCriterion, candidates: float) -> float:
    """P-value by free runs, and where that exceeds α also by the force residual (weighted Bonferroni).

    Args:
        p: by free runs, of ``p_by_free_runs``.
        before, after: force residuals without and with the candidate.
        candidates: number of hypotheses (``hypotheses_tried``).
    """
    few = len(after.search.record.start) < acceptance.SIGN_BLOCKS
    share = FORCE_SHARE_OF_FEW if few else FORCE_SHARE
    free = min(1.0, p / (1 - share))
    if free <= acceptance.ALPHA:
        return free
    gain = after.added_to(before)
    if gain.left > 1 - acceptance.LEAST_SHARE:
        return free
    return min(free, candidates * gain.p_added(added_parameters(before.fit.trial, after.fit.trial)) / share)


def whiteness(search: Search, fit: Fit) -> float:
    """Share of the residuals that count as independent; 0 far from the noise, where the likelihood is not valid.

    A wrong model form gives one error per segment, whatever the number of samples. So only the noise's share of the
    squared residual counts: at three times the noise a ninth of the residuals, so that the likelihood gain must be nine
    times as large. This is more cautious than a quasi-likelihood, whose dispersion is in ``segment_losses``.
    """
    near = near_noise(fit, noise_assumed(search, fit))
    return independent_share(fit) / dispersion(search, fit) if near else 0.0


def dispersion(search: Search, fit: Fit) -> float:
    """Squared ratio of residual to noise in the median segment, at least 1."""
    return max(1.0, (noise_assumed(search, fit) * noise_ratio(fit)) ** 2)


def noise_assumed(search: Search, fit: Fit) -> float:
    """Ratio of the noise that a fit assumes to the measurement noise; the largest of its joints."""
    joints = list(fit.runner.record.joints or [0])
    return float(np.max(fit.runner.record.noise[joints] / search.record.noise[joints]))
