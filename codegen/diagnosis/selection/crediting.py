"""What free runs credit: whether a fit with more effects is worth it, and what is left of several effects."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import evidence_of, noise_loss
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, where_they_differ
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.ranking import Ranked, credible
from codegen.diagnosis.selection.significance import hypotheses

MOST_EFFECTS = 3
BETTER = 10.0
"""Nats by which another effect must fit better to replace one found earlier."""


def at_noise(fit: Fit) -> bool:
    """Whether a model leaves only the noise of the positions."""
    return bool(fit.held_out_losses.sum() <= (1 + credit.AT_NOISE) * noise_loss(fit))


def nothing_left(fit: Fit) -> bool:
    """Whether the search ends: only noise is left, or less than the smallest effect changes."""
    return at_noise(fit) or credit.is_negligible(fit)


def explained_share(search: Search, base: Fit, final: Fit) -> float:
    """Share of the squared residual removed, or share of the loss above noise removed, whichever is larger."""
    if final is base:
        return 0.0
    soft, before = search.with_noise_floor(base)
    before, after = where_they_differ(search, before, soft.fitted_again(final))
    one = evidence_of(before, after, floored=False)
    excess = float(before.held_out_losses.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)


def worth_it(search: Search, fit: Fit, richer: Fit, candidates: int) -> bool:
    """Whether free runs credit the fit with more effects, which explains at least ``FURTHER`` of the remaining loss."""
    much = explained_share(search, fit, richer) >= credit.FURTHER
    return much and credible(search, fit, richer, candidates)


def is_credited(search: Search, base: Fit, fit: Fit) -> bool:
    """Whether free runs credit a fit over the refit, among all candidates of the first round, fitted or not."""
    return credible(search, base, fit, hypotheses(every_part(search, base.trial.parts)))


def still_credited(search: Search, base: Fit, current: Fit, rivals: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """A fit in which effects were replaced or removed, with its rivals; the refit if the fit is not credited.

    Each effect may be needed in addition to the others although all together predict no better than the refit. A rival
    that was tried in addition to an effect is no rival of a single effect.
    """
    if not is_credited(search, base, current):
        return base, []
    alone = len(current.trial.parts) == 1
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


def pruned(search: Search, fit: Fit, candidates: int, spared: int = 0) -> Fit:
    """Backward elimination of effects that free runs do not credit; the last ``spared`` stay."""
    for k in range(len(fit.trial.parts) - 1 - spared, -1, -1):
        if len(fit.trial.parts) > 1:
            without = search.without(fit, k)
            fit = fit if worth_it(search, without, fit, candidates) else without
    return fit


def pruned_with_rivals(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Backward elimination; if the first effect is removed, so are its rivals."""
    leader, kept = current.trial.parts[0], pruned(search, current, 1)
    return kept, rivals if are_same(leader, kept.trial.parts[0]) else []


def are_same(one: Part, other: Part) -> bool:
    """Whether two are the same effect at the same place, in whichever form."""
    return (one.kind, one.on) == (other.kind, other.on)
