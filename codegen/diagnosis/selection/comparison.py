"""Comparison of two candidates by free runs, force residual, tolerances and form; ties in a round, and its order.

Free runs decide first. Candidates that they do not distinguish tie, unless the force residual or the prior density of
the values prefers one. Among equals the usual form, and the friction levels nearest to the declared ones, come first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import takewhile

import numpy as np

from codegen.diagnosis.evidence.force_gain import (
    ForceCriterion,
    added_parameters,
    beyond,
    extends,
    nested_evidence_of,
)
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import evidence_of, is_far
from codegen.diagnosis.fit.output_error import Fit, resolution
from codegen.diagnosis.fit.search import Search, where_they_differ
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.candidate_fits import FORM_GAIN, is_usual_form
from codegen.diagnosis.selection.ranking import Ranked, is_one_of, same_motion, twins, with_first
from codegen.diagnosis.selection.significance import dispersion, whiteness
from codegen.effects import CATALOGUE

CLOSE = 1.1
"""Largest ratio of remaining and of removed squared residuals at which two models far from the noise tie."""
CONTRARY = 10.0
"""Nats on held-out segments by which free runs at the noise must prefer one of two candidates to overrule the force."""
EQUAL = 2.0
"""Largest difference in nats between fits of one motion, such as those of twins."""


def ties(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that free runs, force residual and tolerances do not distinguish from the best, without its twins."""
    alike = [other for other in _tied(search, ranked[0], ranked) if not preferred_by_force(ranked[0], other)]
    return [other for other in alike if not tolerances_prefer(search, ranked[0].found, other.found)]


def _tied(search: Search, best: Ranked, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that free runs do not distinguish from the best, without its twins, and one of several twins.

    Far from the noise every difference is significant; there, candidates that are nearly alike tie as well.
    """
    same, tied = same_motion(best.found), []
    for other in ranked:
        if other is best or not (other.grade or _is_other_load(other, best)) or is_one_of(other.found, same):
            continue
        if is_no_better_form(other.found, best.found, best.part):
            continue
        if tied_by_free_runs(search, best, other):
            tied.append(other)
            same |= same_motion(other.found)
    return tied


def _is_other_load(other: Ranked, best: Ranked) -> bool:
    """Whether two candidates add a load behind a spring, and only the force residual refuses the first.

    The force residual does not distinguish two loads (``force_prefers``), so the refusal does not make the other one
    more probable.
    """
    both = other.force_criterion, best.force_criterion
    return other.contradicted and all(one is not None and adds_load(one) for one in both)


def tied_by_free_runs(search: Search, best: Ranked, other: Ranked) -> bool:
    """Whether free runs do not distinguish two candidates: no significant gain or, far from noise, nearly alike.

    One that leaves more than ``TIE_RATIO`` times the squared residual of the best does not tie, although p is large
    where few segments show the difference.
    """
    if not leaves_as_little(other, best):
        return False
    return (is_far(best.found) and _nearly_alike(best, other)) or not runs_prefer(search, best.found, other.found)


def runs_prefer(search: Search, best: Fit, other: Fit) -> bool:
    """Whether free runs prefer a fit to another one (``Evidence.p_of_rivals``), or to one that it extends.

    A backlash contains the compliance; it is judged as an effect with a further parameter is, also by the score test,
    and is not preferred where it does not fit the whole log better.
    """
    other, best = where_they_differ(search, other, best)
    if extends(best.trial, other.trial):
        if best.cost >= other.cost:
            return False
        return nested_evidence_of(other, best).p(whiteness(search, best), only_noise=False) <= acceptance.TIE_LEVEL
    gained, at_noise = evidence_of(other, best, floored=False), dispersion(search, best) <= acceptance.ONLY_NOISE
    return gained.p_of_rivals(whiteness(search, best), at_noise) <= acceptance.TIE_LEVEL


def tolerances_prefer(search: Search, best: Fit, other: Fit) -> bool:
    """Whether a fit is preferred to another one, as by ``runs_prefer``, with the prior density of the values included.

    Two models can predict the same motion with different values: a gain with the declared mass, or an inertia error
    with a mass far from it. The ratio of their posterior densities then tells them apart. It is that of fits whose
    priors have the weight of their own residuals. It is used at the noise only, since elsewhere an incomplete model
    moves the values.
    """
    if best.of_forces or dispersion(search, best) > acceptance.ONLY_NOISE or extends(best.trial, other.trial):
        return False
    other, best = where_they_differ(search, *(search.fitted_again(fit) for fit in (other, best)))
    by_prior, gained = other.prior_nats - best.prior_nats, evidence_of(other, best, floored=False)
    at_noise = dispersion(search, best) <= acceptance.ONLY_NOISE
    return by_prior > 0 and gained.p_of_rivals(whiteness(search, best), at_noise, by_prior) <= acceptance.TIE_LEVEL


def leaves_as_little(one: Ranked, best: Ranked) -> bool:
    """Whether a candidate leaves at most ``TIE_RATIO`` times the squared residual of the best."""
    return 1 - one.evidence.share <= acceptance.TIE_RATIO * (1 - best.evidence.share)


def is_no_better_form(found: Fit, best: Fit, part: Part) -> bool:
    """Whether a candidate has a special form, ``part`` of the best fit the usual form, and it is not clearly better."""
    return is_usual_form(part) and not is_usual_form(found.part) and found.cost > best.cost - FORM_GAIN


def leader_first(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates that passed: first the one that is named, then the others in the order of their fits."""
    for reordered in (usual_form_first, ordered_by_force, nearest_twin_first):
        ranked = reordered(search, ranked)
    return list(ranked)


def usual_form_first(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, first one of a usual form if the best has a special form and is not clearly better."""
    best = ranked[0]
    if is_usual_form(best.part):
        return list(ranked)
    tied = [r for r in _tied(search, best, ranked) if not r.why_not]
    others = [r for r in tied if is_no_better_form(best.found, r.found, r.part)]
    best = min(others, key=lambda r: r.found.cost, default=best)
    return with_first(best, ranked)


def ordered_by_force(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, first the one that the force residual prefers among the best and those that tie with it."""
    best = ranked[0]
    for other in _tied(search, best, ranked):
        if preferred_by_force(other, best):
            best = other
    return with_first(best, ranked)


def nearest_twin_first(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, first that of several twins whose friction levels are nearest to the declared ones.

    Twins are one motion with other levels: a larger mass with the declared friction, or a weaker drive with less.
    """
    best = ranked[0]
    same = twins(best.part, best.found)
    alike = [r for r in ranked if r.part.key in same and not r.why_not and r.found.cost <= best.found.cost + EQUAL]
    return with_first(min([best, *alike], key=lambda r: _from_declared(search, r.found)), ranked)


def nearest_of_equal(search: Search, fits: Iterable[Fit]) -> Fit | None:
    """The best fit, or one of as many parameters and the same cost whose friction levels are nearest to the declared.

    Beside a wrong gain, viscous friction and an inertia error can be one motion with other levels; which of the two
    has the smaller cost is then decided by rounding.

    Args:
        fits: the best first; those after the equal ones are not asked for.

    Returns:
        None where there are no fits.
    """
    fits = iter(fits)
    best = next(fits, None)
    if best is None:
        return None
    equal = takewhile(lambda f: f.cost <= best.cost + resolution(best.cost), fits)
    others = [f for f in equal if len(f.part.names) == len(best.part.names)]
    return min([best, *others], key=lambda f: _from_declared(search, f)) if others else best


def _from_declared(search: Search, fit: Fit) -> float:
    """Σ ln²(friction level/declared level); a level of zero counts as a hundredth of the declared one."""
    refitted_values = fit.values[0]
    levels = [k for k, s in enumerate(search.refitted_symbols) if s in search.problem.levels]
    least = 1e-2 * np.abs(search.declared[levels]) + 1e-300
    fitted, declared = (np.maximum(values[levels], least) for values in (refitted_values, search.declared))
    return float(np.sum(np.log(fitted / declared) ** 2))


def preferred_by_force(one: Ranked, other: Ranked) -> bool:
    """Whether the force residual prefers a candidate to another one, and free runs do not contradict."""
    if one.force_criterion is None or other.force_criterion is None:
        return False
    if (
        are_one_motion(one, other)
        and not differ_in_time(one.found, other.found)
        and _force_apart(one, other) < acceptance.LEAST_SIZE
    ):
        return False
    against = _nats_against(one, other)
    if against > CONTRARY:  # the two criteria contradict each other: the pair ties
        return False
    return force_prefers(one.force_criterion, other.force_criterion, most_left(one.found), against)


def are_one_motion(one: Ranked, other: Ranked) -> bool:
    """Whether free runs of both candidates end near the noise and predict held-out segments equally well.

    A small difference of their forces is then no evidence. The low-pass filter leaves an error about starts and stops
    that grows with the friction level: a weaker drive and a friction in proportion to it are one motion where the drive
    never brakes, and differed by 0.4 % of the drive force there. A delay and a lag are compared by frequency
    (``over_in_time``), where such an error does not count.
    """
    nats = float(one.found.held_out_losses.sum() - other.found.held_out_losses.sum())
    return abs(nats) <= EQUAL and acceptance.near_noise(one.found) and acceptance.near_noise(other.found)


def _force_apart(one: Ranked, other: Ranked) -> float:
    """Difference of the force residuals of two candidates over the drive force, in motion."""
    a, b = one.force_criterion, other.force_criterion
    assert a is not None and b is not None
    apart = np.where(a.search.problem.used, a.without_levels - b.without_levels, 0.0)
    return a.search.drive.share(apart)


def _nats_against(one: Ranked, other: Ranked) -> float:
    """Nats on held-out segments by which free runs prefer another candidate that ends near the noise; else 0."""
    nats = float(one.found.held_out_losses.sum() - other.found.held_out_losses.sum())
    return nats if nats > 0 and acceptance.near_noise(other.found) else 0.0


def force_prefers(one: ForceCriterion, other: ForceCriterion, most: float = 1.0, against: float = 0.0) -> bool:
    """Whether the force residual significantly prefers a model, with less than ``most`` times the other's square.

    It does not distinguish two loads behind springs, with play or without, since their motion is not measured and their
    force residual is differentiated noise.

    Args:
        against: nats by which free runs prefer the other model; the likelihoods of both criteria are multiplied.
    """
    if adds_load(one) and adds_load(other):
        return False
    a, b = one.fit.trial, other.fit.trial
    gain = one.over_in_time(other) if differ_in_time(one.fit, other.fit) else one.over(other)
    more = max(added_parameters(b, a) - added_parameters(a, b), 0)
    return gain.left < most and gain.p_of_rivals(more, against) <= acceptance.TIE_LEVEL


def differ_in_time(one: Fit, other: Fit) -> bool:
    """Whether two fits differ by laws of how late an input acts alone, as a delay and a lag of the same input."""
    apart = [beyond(one.trial, other.trial), beyond(other.trial, one.trial)]
    if any(len(own) != 1 for own in apart):
        return False
    (first,), (second,) = apart
    pairs = (one, first), (other, second)
    late = all(f.trial.parts[k].effect.delay(f.values[1][k]) > 0 for f, k in pairs)
    return late and one.trial.parts[first].on == other.trial.parts[second].on


def adds_load(one: ForceCriterion) -> bool:
    """Whether a model has a load behind a spring that the declared one has not."""
    return len(one.fit.model.transmissions) > len(one.search.system.transmissions)


def _nearly_alike(best: Ranked, other: Ranked) -> bool:
    """Whether two candidates differ little in both the removed and the remaining share of the squared residual."""
    most, less = best.evidence.share, other.evidence.share
    return 1 - less <= CLOSE * (1 - most) and most <= CLOSE * less


def most_left(found: Fit) -> float:
    """Largest share of a rival's squared force residual that a preferred fit leaves: 1, far from the noise 1/CLOSE."""
    return 1 / CLOSE if is_far(found) else 1.0


def same_signature(one: Part, other: Part) -> bool:
    """Whether two effects act at the same place and depend on the same variable."""
    effects = CATALOGUE[one.kind], CATALOGUE[other.kind]
    return one.on == other.on and effects[0].seen_over == effects[1].seen_over
