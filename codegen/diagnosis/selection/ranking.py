"""One round of forward selection: every candidate with its evidence and the first test that it fails."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb, prod

import numpy as np
from numpy.typing import NDArray

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.acceleration_error import larger_acceleration_error
from codegen.diagnosis.evidence.force_evidence import ForceCriterion
from codegen.diagnosis.evidence.reservations import (
    never_passed,
    passed_too_fast,
    resolvable_periods,
    shows_no_bend,
    takes_the_level,
)
from codegen.diagnosis.evidence.residual_regression import inertia_noise
from codegen.diagnosis.evidence.score_test import added_parameters, contains, nested_evidence_of
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import Evidence, evidence_of, independent_share, near_noise, noise_ratio, size_of
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import drive_left, drive_shares, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, with_effects, with_values
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.selection.candidate_fits import FORM_GAIN, fit_candidates, is_simpler_form, is_usual_form
from codegen.effects import CATALOGUE
from codegen.effects.register import is_identical
from codegen.mechanics.system import System

Array = NDArray[np.float64]

CLOSE = 1.1
"""Ratio of squared residuals, left or removed, up to which neither of two models far from the noise is preferred."""
CONTRARY = 10.0
"""Nats on held-out segments by which free runs at the noise must prefer one of two candidates for the force not to
prefer the other."""
EQUAL = 2.0
"""Nats by which fits of twins, which are one motion, may differ."""
FORCE_SHARE, FORCE_SHARE_OF_FEW = 0.1, 0.5
"""Share of α for the test on the force residual (weighted Bonferroni), and that where the log has fewer than
``credit.SIGNED`` segments: the sign test on B of them cannot give less than Φ(−√B)."""
LEAST_DRIVE = 0.1
"""Least RMS of the drive force with an effect over that without: less does not move the machine."""
CONTRADICTED = 1.5
"""A candidate that multiplies the squared force residual by this or more is refused, whatever free runs say."""
ALONE = 1.2
"""Squared ratio of residual to noise up to which the likelihood of free runs counts without a test on blocks."""
FORM_ERROR = 0.1
"""Least force of an effect over that of another on the same coordinate that is seen over the same variable."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate of one round with its evidence.

    Attributes:
        ratio: median free-run error over that of the model without it.
        size: change of the prediction, or force, over that of the drive force.
        why_not: the test that it fails, in words; empty where it passes all.
        unsure: whether it fails only the significance test; in addition to another effect it may still pass.
        p: probability of such gains without an effect, for any candidate of the round; compared with α.
        force_criterion: its force residual.
    """

    found: Fit
    evidence: Evidence
    ratio: float
    size: float
    why_not: str
    unsure: bool = False
    p: float = 1.0
    force_criterion: ForceCriterion | None = None


def run_round(
    search: Search, current: Fit, parts: Sequence[Part], report_progress: Callable[[float], None]
) -> list[Ranked]:
    """Fit and rank every candidate in addition to the current effects: those that pass every test first.

    Of forms of one effect that fit alike the simplest stays, unless it is refused and another one is not.
    """
    soft, base = search.with_noise_floor(current)
    before, count, ranked = ForceCriterion(search, base), hypotheses(parts), []
    for found in fit_candidates(soft, base, parts, report_progress):
        one, after = nested_evidence_of(base, found), ForceCriterion(search, found)
        size = relative_size(search, found, base)
        why_not = _why_not(before, after, one, size)
        many = tried(search, base, found, count)
        p = chance(search, found, one, many)
        p = p if why_not else combined_p(p, before, after, many)
        unsure = not why_not and p > credit.ALPHA
        if unsure:
            why_not = (
                f"may be chance: it is better on {one.won} of {one.blocks} held-out parts, with p = {p:.2g} over all "
                f"candidates (at most {credit.ALPHA:g} is accepted)"
            )
        ratio = noise_ratio(found) / noise_ratio(base)
        ranked.append(Ranked(found, one, ratio, size, why_not, unsure, p, after))
    return sorted(in_simplest_admitted_forms(ranked), key=lambda r: (bool(r.why_not) and not r.unsure, r.found.cost))


def in_simplest_admitted_forms(ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates without those forms of an effect that a simpler form replaces.

    A simpler form replaces another one if it fits as well (``is_simpler_form``) and does at least as well in the tests.
    Credited is better than failing significance alone, and that is better than failing another test.
    """

    def passed(one: Ranked) -> tuple[bool, bool]:
        return not one.why_not, one.unsure

    return [
        r
        for r in ranked
        if not any(is_simpler_form(other.found, r.found) and passed(other) >= passed(r) for other in ranked)
    ]


def refused_when_fitted_again(ranked: Sequence[Ranked], chosen: Ranked) -> list[Ranked]:
    """A round whose chosen candidate was not credited: it and its twins are marked as failing the significance test.

    The candidates of a round are fitted with the noise that free runs show; the chosen one again with that of the log.
    """
    words = "may be chance: it passes with the noise that the refit leaves, but not with the noise of the log"
    same = _same_motion(chosen.found)
    return [
        replace(r, why_not=words, unsure=True) if not r.why_not and (r is chosen or _is_one_of(r.found, same)) else r
        for r in ranked
    ]


def ties(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that neither free runs nor force residual tell from the best, its twins left out."""
    return [other for other in _tied(search, ranked[0], ranked) if not _preferred(ranked[0], other)]


def _tied(search: Search, best: Ranked, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that free runs do not tell from one of them, each of several twins once and its own left out.

    Far from the noise every difference becomes significant: candidates that are nearly alike tie there as well.
    """
    same, tied = _same_motion(best.found), []
    for other in ranked:
        if other is best or (other.why_not and not other.unsure) or _is_one_of(other.found, same):
            continue
        if not leaves_as_little(other, best) or _only_extends(other, best):
            continue
        if is_no_better_form(other.found, best.found, best.found.part):
            continue
        if runs_do_not_tell(search, best, other):
            tied.append(other)
            same |= _same_motion(other.found)
    return tied


def runs_do_not_tell(search: Search, best: Ranked, other: Ranked) -> bool:
    """Whether free runs do not tell a candidate from another one: no significant gain or, far from the noise, where
    every difference is significant, nearly the same share of the squared residual.
    """
    return (is_far(best.found) and _nearly_alike(best, other)) or not runs_prefer(search, best.found, other.found)


def runs_prefer(search: Search, best: Fit, other: Fit) -> bool:
    """Whether free runs tell a fit from another one, neither of which contains the other (``Evidence.p_of_rivals``)."""
    gained, at_noise = evidence_of(other, best, floored=False), dispersion(search, best) <= ALONE
    return gained.p_of_rivals(whiteness(search, best), at_noise) <= credit.TIE_LEVEL


def leaves_as_little(one: Ranked, best: Ranked) -> bool:
    """Whether a candidate leaves at most ``TIE_RATIO`` times the squared residual of the best."""
    return 1 - one.evidence.share <= credit.TIE_RATIO * (1 - best.evidence.share)


def _only_extends(other: Ranked, best: Ranked) -> bool:
    """Whether a candidate is the best one with a parameter more, which does not make it better."""
    same_place = other.found.part.on == best.found.part.on
    extended = CATALOGUE[other.found.part.kind].extends == best.found.part.kind
    return same_place and extended and other.found.cost >= best.found.cost


def is_no_better_form(found: Fit, best: Fit, part: Part) -> bool:
    """Whether a candidate has a special form, ``part`` of the best fit its kind's usual one, and it is not clearly
    better.
    """
    return is_usual_form(part) and not is_usual_form(found.part) and found.cost > best.cost - FORM_GAIN


def usual_form_first(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, led by one of a usual form where the best has a special form and is not clearly better."""
    best = ranked[0]
    if is_usual_form(best.found.part):
        return list(ranked)
    tied = [r for r in _tied(search, best, ranked) if not r.why_not]
    others = [r for r in tied if is_no_better_form(best.found, r.found, r.found.part)]
    best = min(others, key=lambda r: r.found.cost, default=best)
    return led_by(best, ranked)


def ordered_by_force(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, led by the one that the force residual prefers among the best and those that tie with it."""
    best = ranked[0]
    for other in _tied(search, best, ranked):
        if _preferred(other, best):
            best = other
    return led_by(best, ranked)


def nearest_twin_first(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, led by that of several twins whose friction levels are nearest to the declared ones.

    Twins are one motion with other levels: a larger mass under the declared friction, or a weaker drive under less.
    """
    best = ranked[0]
    same = twins(best.found.part, best.found)
    alike = [
        r
        for r in ranked
        if (r.found.part.kind, r.found.part.on) in same and not r.why_not and r.found.cost <= best.found.cost + EQUAL
    ]
    return led_by(min([best, *alike], key=lambda r: _from_declared(search, r)), ranked)


def led_by(best: Ranked, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, this one first."""
    return [best, *(r for r in ranked if r is not best)]


def _from_declared(search: Search, one: Ranked) -> float:
    """Squared logarithms of friction levels over the declared ones, summed; a hundredth counts for a level of zero."""
    moved = one.found.values[0]
    levels = [k for k, s in enumerate(search.moved) if s in search.problem.levels]
    least = 1e-2 * np.abs(search.declared[levels]) + 1e-300
    fitted, declared = (np.maximum(values[levels], least) for values in (moved, search.declared))
    return float(np.sum(np.log(fitted / declared) ** 2))


def _preferred(one: Ranked, other: Ranked) -> bool:
    if one.force_criterion is None or other.force_criterion is None:
        return False
    against = _nats_against(one, other)
    if against > CONTRARY:  # each criterion is evidence against what the other one prefers: the pair ties
        return False
    return force_prefers(one.force_criterion, other.force_criterion, most_left(one.found), against)


def _nats_against(one: Ranked, other: Ranked) -> float:
    """Nats on held-out segments by which free runs prefer another candidate, where that leaves the noise; else 0."""
    nats = float(one.found.held_out_losses.sum() - other.found.held_out_losses.sum())
    return nats if nats > 0 and credit.near_noise(other.found) else 0.0


def force_prefers(one: ForceCriterion, other: ForceCriterion, most: float = 1.0, against: float = 0.0) -> bool:
    """Whether the force residual tells a model from another one, and leaves less than a share of its square.

    It does not tell two loads behind springs apart, with play or without: their motion is not measured, and what it
    shows of them is differentiated noise.

    Args:
        against: nats by which free runs prefer the other one; the likelihoods of both criteria are multiplied.
    """
    if adds_load(one) and adds_load(other):
        return False
    a, b = one.fit.trial, other.fit.trial
    gain, more = one.over(other), max(added_parameters(b, a) - added_parameters(a, b), 0)
    return gain.left < most and gain.p_of_rivals(more, against) <= credit.TIE_LEVEL


def adds_load(one: ForceCriterion) -> bool:
    """Whether a model has a load behind a spring that the declared one has not."""
    return len(one.fit.model.transmissions) > len(one.search.system.transmissions)


def _nearly_alike(best: Ranked, other: Ranked) -> bool:
    """Whether both what two candidates remove of the squared residual and what they leave differ by little."""
    most, less = best.evidence.share, other.evidence.share
    return 1 - less <= CLOSE * (1 - most) and most <= CLOSE * less


def is_far(found: Fit) -> bool:
    """Whether a model leaves far more than the noise, so that it is not all that is missing."""
    return noise_ratio(found) > credit.NEAR_NOISE


def most_left(found: Fit) -> float:
    """Largest share of a rival's squared force residual that a preferred fit leaves: 1, far from the noise 1/CLOSE."""
    return 1 / CLOSE if is_far(found) else 1.0


def twins(part: Part, found: Fit) -> list[tuple[str, str]]:
    """(kind, on) of effects with the same motion."""
    effect = CATALOGUE[part.kind]
    return effect.twins(found.trial.system, part.place)


def _same_motion(found: Fit) -> set[tuple[str, str]]:
    return {(found.part.kind, found.part.on), *twins(found.part, found)}


def _is_one_of(found: Fit, known: Collection[tuple[str, str]]) -> bool:
    """Whether a candidate is one of these effects (kind, on), also under a user's own name."""
    part, system = found.part, found.trial.system
    kinds = [kind for kind, on in known if on == part.on]
    return any(part.kind == k or is_identical(part.effect, CATALOGUE[k], system, part.place) for k in kinds)


def hypotheses(parts: Sequence[Part]) -> int:
    """Number of candidates for Bonferroni's correction: forms of one effect, each contained in the next, are one."""
    return len({(p.kind, p.on) for p in parts})


def tried(search: Search, before: Fit, after: Fit, candidates: int) -> float:
    """Number of hypotheses among which the effects that a model has more than another were chosen.

    Of so many candidates, every set of as many; of an effect with an unknown period, each that the log can resolve.
    """
    known = {(p.kind, p.on) for p in before.trial.parts}
    added = [
        (p, values) for p, values in zip(after.trial.parts, after.values[1], strict=True) if (p.kind, p.on) not in known
    ]
    sets = comb(max(candidates, len(added)), len(added))
    return sets * prod(resolvable_periods(search.system, search.motion, p, values) for p, values in added)


def chance(search: Search, fit: Fit, e: Evidence, candidates: float) -> float:
    """Probability of such a gain without an effect, for any of so many candidates (Bonferroni)."""
    return min(1.0, candidates * e.p(whiteness(search, fit), dispersion(search, fit) <= ALONE))


def combined_p(p: float, before: ForceCriterion, after: ForceCriterion, candidates: float) -> float:
    """Probability by free runs, or by the force residual where free runs leave doubt (weighted Bonferroni)."""
    few = len(after.search.record.start) < credit.SIGNED
    share = FORCE_SHARE_OF_FEW if few else FORCE_SHARE
    free = min(1.0, p / (1 - share))
    if free <= credit.ALPHA:
        return free
    gain = after.added_to(before)
    if gain.left > 1 - credit.LEAST_SHARE:
        return free
    return min(free, candidates * gain.p_added(added_parameters(before.fit.trial, after.fit.trial)) / share)


def whiteness(search: Search, fit: Fit) -> float:
    """Share of the residuals that count as independent; 0 far from the noise, where no likelihood holds.

    A wrong model form leaves one error in a segment, however many samples the segment spans. So only the noise's share
    of the squared residual counts: at three times the noise a ninth of the residuals, and the likelihood gain must be
    nine times as large. This is a cautious count and no quasi-likelihood, whose dispersion `segment_losses` holds.
    """
    near = near_noise(fit, _noise_assumed(search, fit))
    return independent_share(fit) / dispersion(search, fit) if near else 0.0


def dispersion(search: Search, fit: Fit) -> float:
    """Squared ratio of residual to noise in the median segment, at least 1."""
    return max(1.0, (_noise_assumed(search, fit) * noise_ratio(fit)) ** 2)


def _noise_assumed(search: Search, fit: Fit) -> float:
    """Noise that a fit assumes over that of the measurement."""
    return float(fit.runner.record.noise[0] / search.record.noise[0])


def credible(search: Search, before: Fit, after: Fit, candidates: int) -> bool:
    """Whether a model with more effects is credited over one with fewer, each chosen among so many candidates.

    Each effect may have passed its tests beside another one that was dropped since, so the drive that they leave
    together is asked for too.
    """
    soft, base = search.with_noise_floor(before)
    richer = soft.fitted_again(after)
    one = nested_evidence_of(base, richer) if contains(after.trial, before.trial) else evidence_of(base, richer)
    if one.share < credit.LEAST_SHARE:
        return False
    many = tried(search, before, after, candidates)
    p = chance(search, richer, one, many)
    plain, found = ForceCriterion(search, before), ForceCriterion(search, after)
    return combined_p(p, plain, found, many) <= credit.ALPHA and not only_reduces_drive(plain, found, one)


def relative_size(search: Search, found: Fit, base: Fit) -> float:
    """Force of the effect over the drive force along the motion; where not defined, its change of the prediction."""
    part = found.part
    if found.trial.adds_states or not part.effect.admissible(search.system, part.place, found.parameters):
        return size_of(found, base)
    return force_share(search, found.part, found.parameters)


def force_share(search: Search, part: Part, values: Mapping[str, float]) -> float:
    """Force of an effect over the drive force along the motion."""
    richer = with_effects(search.system, [FoundEffect(part.kind, part.on, values, {})])
    return search.drive.share(inverse_dynamics_residual(richer, search.motion) - search.drive.residual)


def absorbed_by_refit(before: ForceCriterion, after: ForceCriterion) -> str:
    """Why not, where refitted values explain the effect's force to within ``LEAST_NET``; else empty."""
    if after.fit.trial.adds_states:
        return ""
    net = before.search.drive.share(after.residual - before.residual)
    if net >= credit.LEAST_NET:
        return ""
    return f"is absorbed by refitted values: beside them it changes the force by {in_percent(net)} of the drive force"


def corrects_a_form(before: ForceCriterion, after: ForceCriterion) -> str:
    """Why not, where a candidate adds little to another effect that acts on the same coordinate and is seen over the
    same variable: so little may be a misfit of the other's form; else empty.
    """
    *others, part = after.fit.trial.parts
    *values, _ = after.fit.values[1]
    system = before.search.system
    here = part.effect.coordinate(system, part.place), part.effect.seen_over
    acting = ((p.effect.coordinate(system, p.place), p.effect.seen_over) for p in others)
    alike = [(p, v) for p, v, on in zip(others, values, acting, strict=True) if on == here]
    if not alike or after.fit.trial.adds_states:
        return ""
    net = before.search.drive.share(after.without_levels - before.without_levels)
    sizes = [(force_share(before.search, p, v), p) for p, v in alike]
    most, larger = max(sizes, key=lambda one: one[0])
    if net >= FORM_ERROR * most:
        return ""
    return (
        f"adds only {in_percent(net)} of the drive force to the {in_percent(most)} of {larger.kind}: no "
        "more than a misfit of that curve's form may leave"
    )


def contradicted_by_force(before: ForceCriterion, after: ForceCriterion, share: float = 0.0) -> str:
    """Why not, where a candidate makes the force residual significantly larger; else empty.

    Short free runs without drive, as of an inertia a thousand times too large, go on at the measured start speed; where
    friction levels are wrong they beat any model that moves by its forces.

    Args:
        share: of the squared free-run residual that the candidate removes on held-out segments.
    """
    times = after.over(before).left
    if times < CONTRADICTED or before.over(after).p > credit.ALPHA:
        return ""
    if credit.free_runs_settle(after.fit, share, times):
        return ""
    return f"makes the squared residual force {times:.2g} times as large"


def contradicted_by_acceleration(before: ForceCriterion, after: ForceCriterion) -> str:
    """Why not, where a load behind a spring makes the acceleration error of free runs larger; else empty.

    Not tested near the noise, where the acceleration error is noise.
    """
    search, found = after.search, after.fit
    more = len(found.model.transmissions) > len(before.fit.model.transmissions)
    if not more or noise_ratio(found) * _noise_assumed(search, found) <= credit.NEAR_NOISE:
        return ""
    here = found.part.effect.coordinate(search.system, found.part.place)
    return larger_acceleration_error(before.fit, found, here, search.motion.cutoff_hz)


def same_signature(one: Part, other: Part) -> bool:
    """Whether two effects act at the same place and are seen over the same variable."""
    effects = CATALOGUE[one.kind], CATALOGUE[other.kind]
    return one.on == other.on and effects[0].seen_over == effects[1].seen_over


def _why_not(before: ForceCriterion, after: ForceCriterion, e: Evidence, size: float) -> str:
    """The first test that a candidate fails, in words; empty where it passes all but that of significance."""
    search, found = after.search, after.fit
    if e.gain <= 0:
        return "does not reduce the simulation error on held-out parts of the log"
    if e.share < credit.LEAST_SHARE:
        needed = in_percent(credit.LEAST_SHARE)
        return f"removes {in_percent(e.share)} of the squared simulation error on held-out parts; {needed} is needed"
    if size < _least_size(found):
        return f"is too small to matter: {in_percent(size)} of the drive force"
    if not admissible(search, found):
        return "fits only with unphysical values"
    here = found.part.effect.coordinate(search.system, found.part.place)
    return (
        unseen_shape(search, found)
        or acts_as_its_limit(search, found)
        or takes_the_level(search.problem, before.fit.model, found.model)
        or found.part.effect.unseen(found.parameters, float(search.record.noise[here]))
        or absorbed_by_refit(before, after)
        or only_reduces_drive(before, after, e)
        or corrects_a_form(before, after)
        or contradicted_by_force(before, after, e.share)
        or contradicted_by_acceleration(before, after)
    )


def unseen_shape(search: Search, found: Fit) -> str:
    """Why the log cannot show an effect's shape: that it repeats, or where it bends; else empty."""
    if never_passed(search.system, search.motion, found.part, found.parameters):
        return "has a period longer than the distance that the log covers, so nothing shows that it repeats"
    if passed_too_fast(search.system, search.motion, found.part, found.parameters):
        return "has a period that the motion passes too fast: its force lies above the cutoff of the filter"
    if shows_no_bend(search.system, search.motion, found.part, found.parameters):
        return "bends outside the speeds of the log, where it is a level or a line and no curve"
    return ""


def only_reduces_drive(before: ForceCriterion, after: ForceCriterion, e: Evidence) -> str:
    """Reason to refuse an effect that gains only by a reduction of the drive force; empty if there is none.

    Let p be the constant factor by which the effect scales the drive force of a coordinate (a gain, friction in
    proportion to the drive), and q the remaining share of the drive force apart from p (dead zone, saturation). The
    tests with q skip coordinates whose drive force the effect does not reduce. Refused are

    - less than ``LEAST_DRIVE`` of the drive force: with a dead zone wider than the commands only inertia is left to
      explain, which slow motion hardly shows;
    - r² > ``CONTRADICTED`` (q² r₀² + (1 − q²) n²), with r and r₀ the RMS force residual with and without the effect and
      n the noise of M a. With a saturation far below the commands the free runs of a heavy machine end near the noise
      although almost no force is left: they continue at their start speed;
    - far from the noise, an effect with which neither r² nor the squared free-run error is ``LEAST_SHARE`` below what
      the factor q² alone gives;
    - an effect with which neither is that much below what p² alone gives, since p scales noise and structure alike.
    """
    motion = before.search.motion
    acting = drive_shares(after.fit.model, before.fit.model, motion, before.search.problem.used)
    least = float(np.min(acting))
    if least < LEAST_DRIVE:
        return f"weakens the drive force to {in_percent(least)}: too little to move the machine"
    left, had = drive_left(after.fit.model, motion), drive_left(before.fit.model, motion)
    scales = left / had  # p
    remaining = acting / scales  # q
    if _leaves_more(before, after, remaining, CONTRADICTED):
        return f"weakens the drive force to {in_percent(least)}, of which a larger share stays unexplained"
    small, far = 1 - credit.LEAST_SHARE, noise_ratio(after.fit) > credit.NEAR_NOISE
    by_runs = 1 - e.share > small * float(np.min(remaining)) ** 2
    if far and by_runs and _leaves_more(before, after, remaining, small):
        return f"weakens the drive force to {in_percent(least)}, of which it explains no larger share"
    scale = float(np.min(scales))
    if scale >= 1 - credit.LEAST_SHARE or 1 - e.share <= (1 - credit.LEAST_SHARE) * scale**2:
        return ""
    if after.over(before).left <= 1 - credit.LEAST_SHARE:
        return ""
    return f"weakens the drive force for the motion to {in_percent(left.min())}, of which it explains no larger share"


def _leaves_more(before: ForceCriterion, after: ForceCriterion, remaining: Array, times: float) -> bool:
    """Whether r² > times (q² r₀² + (1 − q²) min(n², r₀²)) on some coordinate whose drive force the effect reduces.

    ``remaining``: (n,) q; symbols of ``only_reduces_drive``.
    """
    search = before.search
    for i, used in enumerate(search.problem.used.T):
        if used.any() and remaining[i] < 1 - credit.LEAST_SHARE:
            without, with_effect = (float(np.mean(c.without_levels[used, i] ** 2)) for c in (before, after))
            noise, share = inertia_noise(search.system, search.motion, i), float(remaining[i]) ** 2
            if with_effect > times * (share * without + (1 - share) * min(noise, without)):
                return True
    return False


def matters(search: Search, found: Fit, base: Fit) -> bool:
    """Whether a candidate is large enough, compared with the drive force, to be an effect."""
    return relative_size(search, found, base) >= _least_size(found)


def _least_size(found: Fit) -> float:
    return credit.LEAST_NET if found.trial.adds_states else credit.LEAST_SIZE


def is_possible(search: Search, found: Fit) -> bool:
    """Whether the fitted values lie within the effect's bounds, and the log can show its period and friction's part."""
    if not admissible(search, found) or unseen_shape(search, found) or acts_as_its_limit(search, found):
        return False
    return not takes_the_level(search.problem, search.system, found.model)


def admissible(search: Search, found: Fit) -> bool:
    """Whether the fitted values lie within the effect's bounds, in the system with the refitted ones."""
    values = found.parameters
    if not all(np.isfinite(v) for v in values.values()):
        return False
    return found.part.effect.admissible(_refitted(search, found), found.part.place, values)


def _refitted(search: Search, found: Fit) -> System:
    """The declared system with the refitted values of a fit."""
    moved = found.values[0].tolist()
    return with_values(search.system, dict(zip((s.name for s in found.trial.moved), moved, strict=True)))


def acts_as_its_limit(search: Search, found: Fit) -> str:
    """Why not, where the force of the last effect is that of a simpler one to within ``credit.LEAST_SIZE``; else empty.

    A load behind a spring too soft to move it is an inertia error, and two parameters too many.
    """
    part, refitted = found.part, _refitted(search, found)
    limit = part.effect.limit(refitted, part.place, found.parameters)
    if limit is None:
        return ""
    kind, values = limit
    *others, _ = [FoundEffect(p.kind, p.on, v, {}) for p, v in zip(found.trial.parts, found.values[1], strict=True)]
    simpler = with_effects(refitted, [*others, FoundEffect(kind, part.on, values, {})])
    motion = search.motion
    own = search.drive.share(
        inverse_dynamics_residual(found.model, motion) - inverse_dynamics_residual(simpler, motion)
    )
    if own >= credit.LEAST_SIZE:
        return ""
    return f"acts as {kind}: what it adds to that is {in_percent(own)} of the drive force"
