"""What free runs accept: whether a fit with more effects is worth it, and what is left of several effects."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.score_test import added_parameters
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import evidence_of, noise_loss, random_signs
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of, where_they_differ
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.ranking import Ranked, credible
from codegen.diagnosis.selection.significance import hypotheses
from codegen.effects import CATALOGUE
from codegen.effects.register import twins_of

MOST_EFFECTS = 3
BETTER = 10.0
"""Nats by which another effect must fit better to replace one found earlier."""


def at_noise(fit: Fit) -> bool:
    """Whether a model leaves only the noise of the positions."""
    return bool(fit.held_out_losses.sum() <= (1 + acceptance.AT_NOISE) * noise_loss(fit))


def nothing_left(fit: Fit) -> bool:
    """Whether the search ends: only noise is left, or less than the smallest effect changes."""
    return at_noise(fit) or acceptance.is_negligible(fit)


def explained_share(search: Search, base: Fit, final: Fit) -> float:
    """Share of the squared residual removed, or share of the loss above noise removed, whichever is larger."""
    if final is base:
        return 0.0
    soft, before = search.with_noise_floor(base)
    before, after = where_they_differ(search, before, soft.fitted_again(final))
    one = evidence_of(before, after, floored=False)
    excess = float(before.held_out_losses.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)


def least_share(search: Search, known: Sequence[Part], part: Part) -> float:
    """Least share of what the known effects leave that a further effect must remove.

    What a misfit of a known effect's form leaves depends on the same variable as that effect. So a further one over
    this variable must remove more (``acceptance.FURTHER``) than one over another variable (``acceptance.ELSEWHERE``).
    Effects on other joints do not count.
    """
    same_joint = [p for p in known if joint_of(search, p) == joint_of(search, part)]
    if not same_joint:
        return acceptance.LEAST_SHARE
    variables = {p.effect.seen_over for p in same_joint if not _has_twin_elsewhere(search, p)}
    return acceptance.FURTHER if part.effect.seen_over in variables else acceptance.ELSEWHERE


def _has_twin_elsewhere(search: Search, part: Part) -> bool:
    """Whether an effect has the same equation of motion as one that depends on another variable.

    Example: an asymmetric friction level is the same as a constant force, so viscous friction found in addition to it
    does not correct a misfit of its form.
    """
    twins = twins_of(part.effect, search.system, part.place)
    return any(CATALOGUE[kind].seen_over != part.effect.seen_over for kind, _ in twins)


def explains_enough(search: Search, fit: Fit, richer: Fit) -> bool:
    """Whether further effects explain enough of the loss that a fit leaves in free runs, as a fit of their own.

    ``acceptance.FURTHER`` of it is enough. Where much is left that no effect describes, as on most real machines, no
    effect can explain that share. There ``acceptance.ELSEWHERE`` is enough for effects over another variable, if free
    runs and the force residual, each by itself, confirm them. Time is no such variable: the motion changes in time, and
    with it what any misfit leaves.
    """
    share = explained_share(search, fit, richer)
    if share >= acceptance.FURTHER:
        return True
    known = fit.trial.parts
    added = [p for p in richer.trial.parts if p not in known]
    if any(p.effect.seen_over == "time" or least_share(search, known, p) >= acceptance.FURTHER for p in added):
        return False
    return share >= acceptance.ELSEWHERE and _both_confirm(search, fit, richer)


def _both_confirm(search: Search, fit: Fit, richer: Fit) -> bool:
    """Whether free runs and the force residual each prefer the fit with more effects (p ≤ ``acceptance.TIE_LEVEL``).

    The force residual of effects with states is computed by a simulation along the motion, and is no second criterion.
    """
    if hidden_states(richer.trial.changed) > hidden_states(fit.trial.changed):
        return False
    soft, before = search.with_noise_floor(fit)
    by_runs = evidence_of(*where_they_differ(search, before, soft.fitted_again(richer)))
    if random_signs(by_runs.t) > acceptance.TIE_LEVEL:
        return False
    by_force = ForceCriterion(search, richer).added_to(ForceCriterion(search, fit))
    p = by_force.p_added(added_parameters(fit.trial, richer.trial))
    return by_force.left <= 1 - acceptance.LEAST_SHARE and p <= acceptance.TIE_LEVEL


def worth_it(search: Search, fit: Fit, richer: Fit, candidates: int) -> bool:
    """Whether free runs accept the fit with more effects, and these explain enough of the remaining loss."""
    return explains_enough(search, fit, richer) and credible(search, fit, richer, candidates)


def is_accepted(search: Search, base: Fit, fit: Fit) -> bool:
    """Whether free runs accept a fit over one with fewer effects, among all candidates in addition to these."""
    return credible(search, base, fit, hypotheses(every_part(search, base.trial.parts)))


def still_accepted(search: Search, base: Fit, current: Fit, rivals: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """A fit in which effects were replaced or removed, with its rivals; the refit if the fit is not accepted.

    Each effect may be needed in addition to the others although all together predict no better than the refit. A rival
    that was tried in addition to an effect is no rival of a single effect.
    """
    if not (is_accepted(search, base, current) or _accepted_in_turn(search, base, current)):
        return base, []
    alone = len(current.trial.parts) == 1
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


def _accepted_in_turn(search: Search, base: Fit, current: Fit) -> bool:
    """Whether all effects but one are accepted over the refit, and that one in addition to them.

    A test of all together counts every set of as many effects as a hypothesis, which these two tests need not.
    """
    for k in range(len(current.trial.parts) if len(current.trial.parts) > 1 else 0):
        others = search.without(current, k)
        if is_accepted(search, base, others) and is_accepted(search, others, current):
            return True
    return False


def pruned(search: Search, fit: Fit, candidates: int, spared: int = 0) -> Fit:
    """Backward elimination of effects that free runs do not accept; the last ``spared`` stay."""
    for k in range(len(fit.trial.parts) - 1 - spared, -1, -1):
        if len(fit.trial.parts) > 1:
            without = search.without(fit, k)
            fit = fit if worth_it(search, without, fit, candidates) else without
    return fit


def pruned_with_rivals(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Backward elimination; if the first effect is removed, so are its rivals."""
    leader, kept = current.trial.parts[0], pruned(search, current, 1)
    return kept, rivals if leader.key == kept.trial.parts[0].key else []
