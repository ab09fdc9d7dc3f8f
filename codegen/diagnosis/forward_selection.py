"""Forward selection of effects with cross-validation; each effect is tested again once the others are included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

from codegen.diagnosis import credit
from codegen.diagnosis.candidate_fits import Found, every_part, fit_candidates
from codegen.diagnosis.credit import evidence, held_out_losses, noise_loss, noise_ratio
from codegen.diagnosis.force_evidence import ForceCriterion
from codegen.diagnosis.output_error import Fit
from codegen.diagnosis.ranking import (
    Ranked,
    contradicted_by_force,
    corrects_a_form,
    credible,
    force_share,
    hypotheses,
    is_possible,
    matters,
    nearest_twin_first,
    ordered_by_force,
    run_round,
    same_signature,
    ties,
    usual_form_first,
    whiteness,
)
from codegen.diagnosis.record import Record
from codegen.diagnosis.search import Search
from codegen.diagnosis.shooting import hidden_states
from codegen.diagnosis.trial import Part
from codegen.effects import CATALOGUE
from codegen.effects.register import kinds_of

MOST_EFFECTS = 3
DIVERGING, SHORTEST = 100.0, 0.25
"""Error of the refit, in noise, above which segments are halved, down to this share of their length."""
SWAPPED = 6
BEAM = 3
"""Candidates of the first round that get a second round of their own."""
PAIRED = 5
"""Best candidates of the first round that are tried in pairs, where the best leaves far more than the noise."""
BETTER = 10.0
"""Nats by which another effect must fit better to replace one found earlier."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class LaterRound:
    """A round after the first: the effects found before it, and its candidates, best first."""

    found_before: tuple[Part, ...]
    ranked: tuple[Ranked, ...]


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of forward selection.

    Attributes:
        base: the refit of the declared structure. final: the fit with all effects (``base`` where there is none).
        first: the first round, best first. rivals: of the first effect, which the data cannot tell from it.
        explained: share of the squared residual, or of its excess over the noise, that the effects remove.
        segments: number in the record.
        unexplained: whether no effect is credited although the residual is material and far above the noise, at least
            in some segments.
        later: rounds after the first, whether or not they found an effect.
    """

    base: Fit
    final: Fit
    first: tuple[Ranked, ...]
    rivals: tuple[Ranked, ...]
    explained: float
    segments: int
    unexplained: bool = False
    later: tuple[LaterRound, ...] = ()

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.final.runner.trial.parts


def within_reach(search: Search) -> tuple[Search, Fit]:
    """The search with segments so short that free runs stay near the measured motion, and its refit.

    The error of a free run grows with the square of time, in a chaotic machine faster; a run that has left the motion
    no longer discriminates candidates, and its slopes are useless. Segments are halved while the refit's error exceeds
    ``DIVERGING`` times the noise.
    """
    near, base, share = search, search.refit(), 1.0
    while noise_ratio(base) > DIVERGING and share > SHORTEST:
        share /= 2
        near = replace(search, record=search.shorter(share), shorter=partial(_shorter, search, share))
        base = near.refit()
    return near, base


def _shorter(search: Search, factor: float, share: float) -> Record:
    return search.shorter(factor * share)


def find_effects(search: Search, base: Fit, report_progress: Progress, refit_only: bool = False) -> Outcome:
    """Forward selection until no candidate is credited; no round at all where ``refit_only``.

    Args:
        base: the refit of the declared structure.
    """
    current = confirmed = base
    first: list[Ranked] = []
    rivals: list[Ranked] = []
    paired = False
    later: list[LaterRound] = []
    for turn in range(0 if refit_only else MOST_EFFECTS):
        if turn and at_noise(current):
            break
        parts = every_part(search, current.runner.trial.parts)
        ranked = run_round(search, current, parts, partial(report_progress, turn))
        first = first or ranked
        if turn:
            later.append(LaterRound(current.runner.trial.parts, tuple(ranked)))
        possible = [r for r in ranked if not r.why_not or r.unsure]
        if not possible:
            break
        possible = nearest_twin_first(search, ordered_by_force(search, usual_form_first(search, possible)))
        tied = ties(search, possible)
        current = search.fitted_again(possible[0].found.fit)
        rivals = rivals if turn else tied
        if not credible(search, confirmed, current, hypotheses(parts)):
            continue
        if confirmed is not base and explained_share(search, confirmed, current) < credit.FURTHER:
            break
        rivals = tied or rivals
        confirmed = current
        if not turn and noise_ratio(current) > credit.NEAR_NOISE:
            pair = _pair(search, possible[:PAIRED])
            if pair is not None and pair.cost < current.cost and worth_it(search, current, pair, hypotheses(parts)):
                current = confirmed = pair
                rivals, paired = [], True
    current = confirmed
    if not current.runner.trial.parts:
        rivals = []
    if len(current.runner.trial.parts) > 1:
        current, rivals = _reconsidered(search, current, first, None if paired else rivals)
        current, rivals = _pruned_with_rivals(search, current, rivals)
        single = _merged(search, current)
        current, rivals = (current, rivals) if single is None else (single, [])
        current, rivals = still_credited(search, base, current, rivals, len(first))
        current = current if rivals else _largest_first(search, current)
    lost = current is base and not refit_only
    lost = lost and (noise_ratio(base) > credit.NEAR_NOISE or credit.share_far(base) > credit.FEW)
    return Outcome(
        base,
        current,
        tuple(first),
        tuple(rivals),
        explained_share(search, base, current),
        len(search.record.start),
        lost and credit.misfit(base) > credit.LEAST_SIZE,
        tuple(later),
    )


def _pair(search: Search, ranked: Sequence[Ranked]) -> Fit | None:
    """The best fit with two effects, at least one of them among the best of the first round.

    Where two effects are missing, each biases the fit of the other; which of several is right is seen only with both in
    the model. So effects that leave nearly as little as the best get a second round of their own (a beam search);
    other pairs are of the best candidates, of different signature.
    """
    found: list[Fit] = []
    for k, one in enumerate(ranked):
        if 0 < k < BEAM and _nearly_as_good(one, ranked[0]):
            others = every_part(search, [one.found.part])
        else:
            others = [r.found.part for r in ranked[k + 1 :] if not same_signature(one.found.part, r.found.part)]
        if others:
            both = run_round(search, search.fitted_again(one.found.fit), others, lambda share: None)
            found += [search.fitted_again(r.found.fit) for r in both if not r.why_not][:1]
    return min(found, key=lambda fit: fit.cost, default=None)


def _nearly_as_good(one: Ranked, best: Ranked) -> bool:
    """Whether a candidate leaves at most ``TIE_RATIO`` times the squared residual of the best."""
    return 1 - one.evidence.share <= credit.TIE_RATIO * (1 - best.evidence.share)


def _merged(search: Search, current: Fit) -> Fit | None:
    """The fit with one effect in place of two of the same signature, where it fits as well; None elsewhere.

    Example: part of a long wave and a hardening spring found first can together imitate a linear spring.
    """
    parts = current.runner.trial.parts
    for j, k in combinations(range(len(parts)), 2):
        if not same_signature(parts[j], parts[k]):
            continue
        rest = search.without(search.without(current, k), j)
        others = [p for p in every_part(search, rest.runner.trial.parts) if same_signature(p, parts[j])]
        good = [f for f in fit_candidates(search, rest, others, lambda share: None) if is_possible(search, f)]
        if good and not worth_it(search, good[0].fit, current, hypotheses(others)):
            simpler = search.fitted_again(good[0].fit)
            return _merged(search, simpler) or simpler
    return None


def worth_it(search: Search, fit: Fit, richer: Fit, candidates: int) -> bool:
    """Whether free runs credit the fit with more effects, which explains at least ``FURTHER`` of the remaining loss."""
    much = explained_share(search, fit, richer) >= credit.FURTHER
    return much and credible(search, fit, richer, candidates)


def pruned(search: Search, fit: Fit, candidates: int, spared: int = 0) -> Fit:
    """Backward elimination: the fit without effects that are not worth it once the others are included.

    Args:
        spared: number of last effects that stay.
    """
    for k in range(len(fit.runner.trial.parts) - 1 - spared, -1, -1):
        if len(fit.runner.trial.parts) > 1:
            without = search.without(fit, k)
            fit = fit if worth_it(search, without, fit, candidates) else without
    return fit


def _pruned_with_rivals(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Backward elimination; where the first effect is dropped, so are its rivals."""
    leader, kept = current.runner.trial.parts[0], pruned(search, current, 1)
    return kept, rivals if _same(leader, kept.runner.trial.parts[0]) else []


def still_credited(
    search: Search, base: Fit, current: Fit, rivals: Sequence[Ranked], candidates: int
) -> tuple[Fit, list[Ranked]]:
    """A fit from which effects were dropped, with its rivals; the refit where a remaining single effect is not
    credited.

    Two effects may be credited together while neither is alone. A rival that was tried in addition to an effect is no
    rival of a single one.
    """
    alone = len(current.runner.trial.parts) == 1
    if alone and not credible(search, base, current, candidates):
        return base, []
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


def at_noise(fit: Fit) -> bool:
    """Whether a model leaves nothing but the noise of the positions."""
    noise = noise_loss(fit)
    return bool(held_out_losses(fit).sum() <= (1 + credit.AT_NOISE) * noise)


def _reconsidered(
    search: Search, current: Fit, first: Sequence[Ranked], rivals: Sequence[Ranked] | None
) -> tuple[Fit, list[Ranked]]:
    """Each effect compared with replacements: the best of the first round, and effects confused with it.

    Args:
        rivals: of the first effect by the first round; None where that round does not tell, as for a pair.

    Returns:
        The better fit, and the rivals that still tie with its first effect. Where a later effect has such rivals and
        the first has none, the later one is put first.
    """
    for _ in range(MOST_EFFECTS):
        leader = current.runner.trial.parts[0]
        better, tied = _swapped(search, current, first, rivals)
        if better is None:
            k = min(tied, default=0)
            return (_put_first(search, current, k) if k else current), tied.get(k, [])
        current = better
        if rivals and not _same(leader, current.runner.trial.parts[0]):
            rivals = []
    return current, []


def _swapped(
    search: Search, current: Fit, first: Sequence[Ranked], rivals: Sequence[Ranked] | None
) -> tuple[Fit | None, dict[int, list[Ranked]]]:
    """The fit with one effect replaced (the new one is last), or None; and by index of an effect, rivals that tie.

    Where the first round names rivals of the first effect, there are no others.
    """
    tied: dict[int, list[Ranked]] = {}
    parts = current.runner.trial.parts
    for k in range(len(parts)):
        others = _others(search, parts, k, first)
        if not others:
            continue
        without = search.without(current, k)
        tried = fit_candidates(search, without, others, lambda share: None)
        plain = ForceCriterion(search, without)
        good = [f for f in tried if is_possible(search, f) and matters(search, f, without)]
        good = [f for f in good if not _refused_by_force(plain, ForceCriterion(search, f.fit), f)]
        if good and good[0].fit.cost < current.cost - BETTER:
            return search.fitted_again(good[0].fit), tied
        of_its_own = [f for f in good if CATALOGUE[f.part.kind].extends != parts[k].kind]
        same = [f for f in of_its_own if _ties(search, f, current)]
        if k or rivals is None:
            left = [_ranked(f, without) for f in same if not _preferred_by_force(search, current, f)]
        else:
            left = [r for r in rivals if any(_same(f.part, r.found.part) for f in same)]
        if left:
            tied[k] = left
    return None, tied


def _refused_by_force(before: ForceCriterion, after: ForceCriterion, found: Found) -> bool:
    """Whether the force residual speaks against a replacement."""
    return bool(corrects_a_form(before, after, found) or contradicted_by_force(before, after))


def _largest_first(search: Search, fit: Fit) -> Fit:
    """The fit with the effect of the largest force first; as it is where it has none, or one that adds states, which
    have no force of their own in the log.
    """
    trial = fit.runner.trial
    if not trial.parts or hidden_states(trial.changed) > hidden_states(trial.system):
        return fit
    values = trial.split(fit.theta)[1]
    sizes = [force_share(search, p, v) for p, v in zip(trial.parts, values, strict=True)]
    k = max(range(len(sizes)), key=sizes.__getitem__)
    return _put_first(search, fit, k) if k else fit


def _put_first(search: Search, fit: Fit, k: int) -> Fit:
    """The fit with its k-th effect before the others."""
    moved, found = fit.runner.trial.split(fit.theta)
    order = sorted(range(len(found)), key=lambda j: j != k)
    return search.with_parts(fit, moved, [fit.runner.trial.parts[j] for j in order], [found[j] for j in order])


def _ranked(found: Found, without: Fit) -> Ranked:
    """A replacement with its evidence over the fit without it."""
    losses, before = held_out_losses(found.fit), held_out_losses(without)
    e = evidence(before, losses, without.residual.shape[1], noise_loss(without) / len(before))
    return Ranked(found, e, losses, noise_ratio(found.fit) / noise_ratio(without), float("nan"), "")


def _preferred_by_force(search: Search, current: Fit, other: Found) -> bool:
    """Whether the force residual tells the current fit from one with another effect in its place."""
    gain = ForceCriterion(search, current).over(ForceCriterion(search, other.fit))
    return gain.left < 1 and gain.p <= credit.TIE_LEVEL


def _others(search: Search, parts: Sequence[Part], k: int, first: Sequence[Ranked]) -> list[Part]:
    """Possible replacements of effect ``k``; the last effect was chosen with the others already included."""
    rest = [p for j, p in enumerate(parts) if j != k]
    alike = {c.other for c in CATALOGUE[parts[k].kind].confused_with}
    best = {(r.found.part.kind, r.found.part.on) for r in first[:SWAPPED]} if k < len(parts) - 1 else set()
    same = {(parts[k].kind, parts[k].on), *parts[k].effect.twins(search.system, parts[k].place)}
    possible = [p for p in every_part(search, rest) if (p.kind, p.on) not in same]
    return [p for p in possible if kinds_of(p.kind) & alike or (p.kind, p.on) in best]


def _ties(search: Search, found: Found, current: Fit) -> bool:
    better = evidence(held_out_losses(found.fit), held_out_losses(current), current.residual.shape[1])
    return better.p(whiteness(search, current)) > credit.TIE_LEVEL


def _same(one: Part, other: Part) -> bool:
    return (one.kind, one.on) == (other.kind, other.on)


def common_effects(search: Search, outcome: Outcome) -> tuple[Search, Outcome] | None:
    """The outcome with the effects that all tied models have in common; None where these are not credited alone.

    Rivals may tie for what an effect leaves: a dead zone is found, and in addition to it a delay or a lag of a fraction
    of a sample. Or they imitate a wrong parameter: an inertia and a gain, in addition to cogging. Where the fit with
    the common effects ends at a limit, it and the refit are repeated without limits; otherwise these effects would be
    fitted beside values other than those that are adopted afterwards.

    Returns:
        The search in which the common effects were fitted, and the outcome.
    """
    if not outcome.rivals or len(outcome.parts) < 2:
        return None
    base, common = outcome.base, search.without(outcome.final, 0)
    freed = search.without_limits(common)
    if freed is not None:
        search, common = freed
        base = search.fitted_again(base)
    if not credible(search, base, common, len(outcome.first)):
        return None
    return search, replace(outcome, base=base, final=common, rivals=(), explained=explained_share(search, base, common))


def explained_share(search: Search, base: Fit, final: Fit) -> float:
    """Share of the squared residual removed, or share of the loss above noise removed, whichever is larger."""
    if final is base:
        return 0.0
    soft, before = search.with_noise_floor(base)
    after = soft.fitted_again(final)
    a, b = held_out_losses(before), held_out_losses(after)
    one = evidence(a, b, before.residual.shape[1])
    excess = float(a.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)
