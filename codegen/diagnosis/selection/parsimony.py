"""What free runs accept: whether a fit with more effects is worth it, and what replaces several of them."""

from collections.abc import Sequence

from codegen.diagnosis.evidence.force_gain import ForceCriterion, added_parameters, nested_evidence_of
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import evidence_of, noise_loss, noise_ratio, random_signs
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of, where_they_differ
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.selection.attenuated_noise import only_attenuates_noise
from codegen.diagnosis.selection.candidate_fits import (
    FORM_GAIN,
    every_part,
    fit_candidates,
    in_simplest_forms,
    simpler_forms,
)
from codegen.diagnosis.selection.comparison import (
    CLOSE,
    force_prefers,
    is_no_better_form,
    most_left,
    nearest_of_equal,
    runs_prefer,
    tied_by_free_runs,
    tolerances_prefer,
)
from codegen.diagnosis.selection.ranking import Ranked, credible, extension_is_shown
from codegen.diagnosis.selection.refusals import (
    contradicted_by_force,
    corrects_a_form,
    force_share,
    is_possible,
    matters,
)
from codegen.diagnosis.selection.significance import hypotheses
from codegen.effects import CATALOGUE
from codegen.effects.register import kinds_of, twins_of

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
    if not is_accepted(search, base, current):
        return base, []
    alone = len(current.trial.parts) == 1
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


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


def judged_together(
    search: Search,
    base: Fit,
    current: Fit,
    rivals: list[Ranked],
    paired: bool,
) -> tuple[Fit, list[Ranked]]:
    """Several effects judged together, which rounds found one after another, and the rivals of the first of them.

    Each may be replaced or removed, and is taken in its simplest form. Where none is replaced or removed, they are not
    tested as a set, since each was accepted in its round.

    Args:
        paired: whether the effects were found as a pair, so that rivals of the first one are unknown, and the other one
            may not have been compared with all candidates.
    """
    if len(current.trial.parts) < 2:
        return current, rivals
    accepted = set() if paired else {p.key for p in current.trial.parts}
    current, rivals = reconsidered(search, current, None if paired else rivals, not paired)
    current, rivals = pruned_with_rivals(search, current, rivals)
    current, rivals = with_simplest_effects(search, current, rivals)  # also of an effect that replaced another
    if {p.key for p in current.trial.parts} != accepted:
        current, rivals = still_accepted(search, base, current, rivals)
    return current if rivals else largest_first(search, current), rivals


def reconsidered(
    search: Search,
    current: Fit,
    rivals: Sequence[Ranked] | None,
    among_all: bool = True,
) -> tuple[Fit, list[Ranked]]:
    """Compare each effect with its possible replacements, the others kept (stepwise selection with replacement).

    Args:
        rivals: of the first effect by the first round; None if they are unknown, as for a pair.
        among_all: whether the last effect was chosen among all candidates with the others kept, as replacements are.

    Returns:
        The better fit, and the rivals that still tie with its first effect. If only a later effect has rivals, it is
        put first.
    """
    for _ in range(MOST_EFFECTS):
        leader = current.trial.parts[0]
        better, tied = swapped(search, current, rivals, among_all)
        if better is None:
            k = min(tied, default=0)
            return (put_first(search, current, k) if k else current), tied.get(k, [])
        current, among_all = better, True
        if rivals and leader.key != current.trial.parts[0].key:
            rivals = []
    return current, []


def swapped(
    search: Search,
    current: Fit,
    rivals: Sequence[Ranked] | None,
    among_all: bool = True,
) -> tuple[Fit | None, dict[int, list[Ranked]]]:
    """The fit with one effect replaced (the new one is last), or None; and index of an effect → rivals that tie.

    If the first round has rivals of the first effect, only these are tested. A rival of another effect must explain
    ``LEAST_SHARE`` of what the fit without that effect leaves, as in the first round, whatever its significance. One
    that explains less hardly differs from that fit, and the effect was accepted as better than that fit.
    """
    tied: dict[int, list[Ranked]] = {}
    parts, here = current.trial.parts, ForceCriterion(search, current)
    for k in range(len(parts)):
        others = possible_replacements(search, parts, k, among_all)
        if not others:
            continue
        without = search.without(current, k)
        tried = fit_candidates(search, without, others, current)
        good = [f for f in tried if is_possible(search, f) and matters(search, f, without)]
        good = in_simplest_forms([f for f in good if not _is_refused(search, without, f)])
        better = (f for f in good if f.cost < current.cost - BETTER and not force_speaks_for(here, f))
        better = (f for f in better if not _is_unshown_extension(search, parts[k], current, f))
        simpler = (f for f in good if _is_as_good_and_simpler(here, f, parts[k]))
        best = nearest_of_equal(search, better) or nearest_of_equal(search, simpler)
        if best is not None:
            return search.fitted_again(best), {}
        own = (f for f in good if CATALOGUE[f.part.kind].extends != parts[k].kind)
        own = (f for f in own if not is_no_better_form(f, current, parts[k]))
        as_it_is = as_replacement(search, current, without)
        same = [f for f in own if tied_by_free_runs(search, as_it_is, as_replacement(search, f, without))]
        if k or rivals is None:
            most = most_left(current)
            alike = (f for f in same if not force_prefers(here, ForceCriterion(search, f), most))
            alike = (f for f in alike if not tolerances_prefer(search, current, f))
            alike = (f for f in alike if explained_share(search, without, f) >= acceptance.LEAST_SHARE)
            tied[k] = [as_replacement(search, f, without) for f in alike]
        else:
            tied[k] = [r for r in rivals if r.part.key in {f.part.key for f in same}]
    return None, {k: found for k, found in tied.items() if found}


def possible_replacements(search: Search, parts: Sequence[Part], k: int, among_all: bool = True) -> list[Part]:
    """Possible replacements of effect ``k``; of a last one chosen ``among_all``, only those confused with it."""
    rest = [p for j, p in enumerate(parts) if j != k]
    same = {parts[k].key, *twins_of(parts[k].effect, search.system, parts[k].place)}
    possible = [p for p in every_part(search, rest) if p.key not in same]
    possible = [p for p in possible if joint_of(search, p) == joint_of(search, parts[k])]
    if k < len(parts) - 1 or not among_all:
        return possible
    alike = {c.other for c in CATALOGUE[parts[k].kind].confused_with}
    return [p for p in possible if kinds_of(p.kind) & alike]


def as_replacement(search: Search, found: Fit, without: Fit) -> Ranked:
    """A replacement with its evidence over the fit without it."""
    before, after = where_they_differ(search, without, found)
    ratio = noise_ratio(after) / noise_ratio(before)
    return Ranked(found, nested_evidence_of(before, after), ratio, float("nan"), "")


def _is_as_good_and_simpler(here: ForceCriterion, found: Fit, part: Part) -> bool:
    """Whether a replacement has fewer parameters than the effect ``part``, and neither criterion prefers that effect.

    Example: a load that a damper hardly moves is an inertia error and viscous friction, two effects in one.
    """
    search, current = here.search, here.fit
    if len(found.part.names) >= len(part.names) or found.cost > current.cost + FORM_GAIN:
        return False
    return not runs_prefer(search, current, found) and not force_prefers(here, ForceCriterion(search, found))


def _is_unshown_extension(search: Search, part: Part, current: Fit, found: Fit) -> bool:
    """Whether a replacement only extends the effect ``part``, and free runs do not show what it adds."""
    return CATALOGUE[found.part.kind].extends == part.kind and not extension_is_shown(search, current, found)


def force_speaks_for(here: ForceCriterion, found: Fit) -> bool:
    """Whether the force residual prefers the present effects to a replacement far from the noise."""
    return not acceptance.near_noise(found) and force_prefers(here, ForceCriterion(here.search, found), 1 / CLOSE)


def _is_refused(search: Search, without: Fit, found: Fit) -> bool:
    """Whether the force residual contradicts a replacement, or it only attenuates noise of the inputs."""
    before, after = ForceCriterion(search, without), ForceCriterion(search, found)
    if corrects_a_form(before, after) or contradicted_by_force(before, after):
        return True
    return bool(only_attenuates_noise(search, *where_they_differ(search, without, found)))


def with_simplest_effects(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """The fit with each effect at the joint of the last one in its simplest form that fits as well with all the others.

    Each form was chosen before the later effects were found. Examples: a backlash with a gap of 1e-15 rad is a
    compliance; viscous friction whose slope falls with speed may be a line once a spring is found. A simpler kind is
    then removed from the rivals. A parameter of the other form starts from the one with its unit.
    """
    trial, values = current.trial, current.values[1]
    if len(trial.parts) < 2:
        return current, rivals
    for k, part in enumerate(trial.parts):
        own = {p.unit: values[k][p.name] for p in part.effect.parameters}
        here = joint_of(search, part) == joint_of(search, trial.parts[-1])
        for form in simpler_forms(part) if here else []:
            simpler = part_of(form, part.place, search.system)
            start = {p.name: values[k].get(p.name, own.get(p.unit, 1.0)) for p in form.parameters}
            other = search.replaced(current, {k: (simpler, start)})
            if other.cost <= current.cost + FORM_GAIN:
                return with_simplest_effects(search, other, [r for r in rivals if r.part.key != simpler.key])
    return current, rivals


def largest_first(search: Search, fit: Fit) -> Fit:
    """The fit with the effect of the largest force first; unchanged without effects, or with one that adds states."""
    trial = fit.trial
    if not trial.parts or hidden_states(trial.changed) > hidden_states(trial.system):
        return fit
    sizes = [force_share(search, p, v) for p, v in zip(trial.parts, fit.values[1], strict=True)]
    k = max(range(len(sizes)), key=sizes.__getitem__)
    return put_first(search, fit, k) if k else fit


def put_first(search: Search, fit: Fit, k: int) -> Fit:
    """The fit with its k-th effect before the others."""
    refitted_values, found = fit.values
    order = sorted(range(len(found)), key=lambda j: j != k)
    return search.with_parts(fit, refitted_values, [fit.trial.parts[j] for j in order], [found[j] for j in order])
