"""One round of forward selection: each candidate is fitted, tested and ranked, with the first test that it fails."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from codegen.diagnosis.evidence.force_gain import (
    ForceCriterion,
    contains,
    nested_evidence_of,
)
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import Evidence, evidence_of, noise_ratio, random_signs
from codegen.diagnosis.fit.output_error import Fit, at_limit
from codegen.diagnosis.fit.search import Search, where_they_differ
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.attenuated_noise import only_attenuates_noise
from codegen.diagnosis.selection.candidate_fits import fit_candidates, is_simpler_form
from codegen.diagnosis.selection.refusals import (
    contradicted_by_force,
    is_too_small,
    least_force,
    only_reduces_drive,
    relative_size,
    too_small_in_words,
    uncovered,
    why_refused,
)
from codegen.diagnosis.selection.significance import (
    chance_in_words,
    combined_p,
    hypotheses,
    hypotheses_tried,
    p_by_free_runs,
)
from codegen.effects import CATALOGUE
from codegen.effects.register import is_identical, twins_of


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate of one round with its evidence.

    Attributes:
        found: the fit with the candidate, whose last effect it is.
        ratio: median free-run error over that of the model without it.
        size: change of the prediction, or force, over that of the drive force.
        why_not: the test that it fails, in words; empty if it passes all.
        insignificant: whether it fails only the test of significance, which it may pass in addition to another effect.
        p: nominal probability of such gains without an effect, for any candidate of the round; compared with α.
        force_criterion: its force residual.
        uncovered: whether it fails only because the log covers less than its period, which is not at its limit.
        contradicted: whether it fails only because the force residual contradicts it.
    """

    found: Fit
    evidence: Evidence
    ratio: float
    size: float
    why_not: str
    insignificant: bool = False
    p: float = 1.0
    force_criterion: ForceCriterion | None = None
    uncovered: bool = False
    contradicted: bool = False

    @property
    def part(self) -> Part:
        return self.found.part

    @property
    def grade(self) -> int:
        """2 if it passes all tests, 1 if all but that of significance, else 0."""
        return int(self.insignificant) if self.why_not else 2

    @property
    def for_table(self) -> Ranked:
        """The candidate without the data that only its own round uses, to save memory: an arm has dozens of rounds."""
        return replace(self, found=self.found.for_table, force_criterion=None)


def run_round(search: Search, current: Fit, parts: Sequence[Part], leading: bool = False) -> list[Ranked]:
    """Fit and rank every candidate in addition to the current effects: those that pass every test first.

    Of forms of one effect that fit equally well, the simplest is kept, unless it is refused and another one is not.

    Args:
        current: the fit with the effects accepted so far.
        leading: whether only those candidates are fitted on all segments that may be the best (``fit_candidates``).
    """
    with_floor, base = search.with_noise_floor(current)
    before, count, ranked = ForceCriterion(search, base), hypotheses(parts), []
    for found in fit_candidates(with_floor, base, parts, leading=leading):
        ranked.append(_tested(search, base, before, found, count))
    ranked = [_refused_beside_small_force(search, r, ranked) for r in ranked]
    ranked = _without_extensions_not_shown(search, ranked)
    # Where one form of an effect passes, none that may be chance leads: refused later, it would take the effect along.
    passed = {r.part.key for r in ranked if not r.why_not}
    ranked = [replace(r, insignificant=False) if r.insignificant and r.part.key in passed else r for r in ranked]
    return sorted(in_simplest_admitted_forms(ranked), key=lambda r: (not r.grade, r.found.cost))


def _tested(search: Search, base: Fit, before: ForceCriterion, found: Fit, count: int) -> Ranked:
    """A candidate with its evidence and the first test that it fails; significance is tested last.

    Args:
        base: the fit without the candidate; ``before`` is its force residual.
        found: the fit with the candidate.
        count: number of candidates of the round, for Bonferroni's correction.
    """
    without, with_it = where_they_differ(search, base, found)
    evidence, after = nested_evidence_of(without, with_it), ForceCriterion(search, found)
    size = relative_size(search, found, base)

    why_not = why_refused(before, after, evidence, size)
    contradicted = "" if why_not else contradicted_by_force(before, after, evidence.share)
    why_not = why_not or contradicted or only_attenuates_noise(search, without, with_it)
    too_short = "" if why_not else uncovered(search, found.part, found.parameters)
    why_not = why_not or too_short

    many = hypotheses_tried(search, base, found, count)
    p = p_by_free_runs(search, with_it, evidence, many)
    p = p if why_not else combined_p(p, before, after, many)
    insignificant = not why_not and p > acceptance.ALPHA
    if insignificant:
        better_on = f"it is better on {evidence.won} of {evidence.blocks} held-out parts"
        why_not = f"may be chance: {better_on}, but {chance_in_words(p, many)}"
    return Ranked(
        found,
        evidence,
        ratio=noise_ratio(with_it) / noise_ratio(without),
        size=size,
        why_not=why_not,
        insignificant=insignificant,
        p=p,
        force_criterion=after,
        uncovered=bool(too_short) and p <= acceptance.ALPHA and "period" not in at_limit(found)[-1],
        contradicted=bool(contradicted),
    )


def _refused_beside_small_force(search: Search, one: Ranked, ranked: Sequence[Ranked]) -> Ranked:
    """A candidate with states, refused if a force at its coordinate explains more but is too small to matter.

    The size of an effect with states is the change of the prediction, and its threshold is lower than that of a force.
    Example: in a plant whose friction is simulated by tanh(v/v_s), friction falls smoothly below 2 mrad/s. A Stribeck
    curve of 0.3 % of the drive force explains this best, and is too small; without this test a load behind a spring,
    which explains it less well, would be named.
    """
    if one.why_not or one.size >= least_force(search.problem) or not one.found.trial.adds_states:
        return one
    for other in ranked:
        part, found = other.part, other.found
        small_force = not found.trial.adds_states and is_too_small(search, found, other.size)
        better = other.evidence.share > one.evidence.share and other.p <= acceptance.ALPHA
        if small_force and better and _coordinate(search, other) == _coordinate(search, one):
            words = f"explains less than {part.title}, which {too_small_in_words(search, found, other.size)}"
            return replace(one, why_not=words)
    return one


def _coordinate(search: Search, one: Ranked) -> int:
    part = one.part
    return part.effect.coordinate(search.system, part.place)


def credible(search: Search, before: Fit, after: Fit, candidates: int) -> bool:
    """Whether a model with more effects is accepted over one with fewer, each chosen among so many candidates.

    An effect may have passed its tests together with another one that was removed since, so the drive force that the
    effects leave together is tested too.
    """
    with_floor, base = search.with_noise_floor(before)
    base, richer = where_they_differ(search, base, with_floor.fitted_again(after))
    nested = contains(after.trial, before.trial)
    evidence = nested_evidence_of(base, richer) if nested else evidence_of(base, richer)
    if evidence.share < acceptance.LEAST_SHARE:
        return False
    many = hypotheses_tried(search, before, after, candidates)
    p = p_by_free_runs(search, richer, evidence, many)
    plain, found = ForceCriterion(search, before), ForceCriterion(search, after)
    if combined_p(p, plain, found, many) > acceptance.ALPHA or only_reduces_drive(plain, found, evidence):
        return False
    return not only_attenuates_noise(search, base, richer)


def in_simplest_admitted_forms(ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates without those forms of an effect that a simpler form replaces."""
    return [
        r
        for r in ranked
        if not any(is_simpler_form(other.found, r.found) and other.grade >= r.grade for other in ranked)
    ]


def _without_extensions_not_shown(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates without those that extend another candidate, if free runs do not show what they add.

    They stay if the other candidate fails a test that they pass.
    """
    plain = {r.part.key: r for r in ranked}

    def is_kept(r: Ranked) -> bool:
        other = plain.get((r.part.effect.extends, r.part.on))
        return other is None or other.grade < r.grade or extension_is_shown(search, other.found, r.found)

    return [r for r in ranked if is_kept(r)]


def extension_is_shown(search: Search, plain: Fit, found: Fit) -> bool:
    """Whether free runs show what a kind adds to the one that it extends, as a backlash adds a gap to a compliance.

    As any further effect, it must remove the share ``acceptance.LEAST_SHARE`` of the squared error that the other
    leaves on held-out parts, or else these must agree on it. Nats alone do not show it: residuals are correlated, and a
    few segments gave 54 nats to a gap that was not there, with 4 of 8 held-out parts better.
    """
    gained = evidence_of(*where_they_differ(search, plain, found))
    return gained.share >= acceptance.LEAST_SHARE or random_signs(gained.t) <= acceptance.TIE_LEVEL


def refused_when_fitted_again(ranked: Sequence[Ranked], chosen: Ranked) -> list[Ranked]:
    """A round whose chosen candidate, with its twins, fails if fitted with the noise of the log."""
    words = "may be chance: it passes with the noise that the refit leaves, but not with the noise of the log"
    same = same_motion(chosen.found)
    return [
        replace(r, why_not=words, insignificant=True)
        if not r.why_not and (r is chosen or is_one_of(r.found, same))
        else r
        for r in ranked
    ]


def with_first(best: Ranked, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates, this one first."""
    return [best, *(r for r in ranked if r is not best)]


def twins(part: Part, found: Fit) -> list[tuple[str, str]]:
    """(kind, on) of effects with the same motion."""
    return twins_of(CATALOGUE[part.kind], found.trial.system, part.place)


def same_motion(found: Fit) -> set[tuple[str, str]]:
    """(kind, on) of a fit's last effect and of its twins."""
    return {found.part.key, *twins(found.part, found)}


def is_one_of(found: Fit, known: Collection[tuple[str, str]]) -> bool:
    """Whether a candidate is one of these effects (kind, on), also under a user's own name."""
    part, system = found.part, found.trial.system
    kinds = [kind for kind, on in known if on == part.on]
    return any(part.kind == k or is_identical(part.effect, CATALOGUE[k], system, part.place) for k in kinds)
