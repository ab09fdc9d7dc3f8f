"""Two effects at a time: pairs of the first round's best candidates, and two effects in place of one."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.candidate_fits import every_part, fit_candidates
from codegen.diagnosis.selection.parsimony import BETTER, at_noise
from codegen.diagnosis.selection.ranking import (
    Ranked,
    force_prefers,
    leaves_as_little,
    run_round,
    runs_prefer,
    same_motion,
    same_signature,
)
from codegen.diagnosis.selection.refusals import is_possible
from codegen.effects.register import separating_experiment

BEAM = 3
"""Candidates of the first round that get a second round of their own."""


def best_pair(search: Search, ranked: Sequence[Ranked]) -> tuple[Fit | None, bool]:
    """The best fit with two effects, at least one of them among the best of the first round (a beam search).

    It ends with a pair that leaves only noise, which no other pair explains better.

    Two missing effects bias each other's fit. Effects with nearly as small a residual as the best get a second round of
    all candidates; other pairs are of the best candidates with different signatures. Forms of one effect leave the same
    for a second effect, as effects with the same motion do (``twins``), so only the best one is tried in pairs.

    Returns:
        The fit, None if there is none, and whether its last effect was chosen among all with the first kept.
    """
    best: Fit | None = None
    among_all = False
    for k, one in enumerate(ranked):
        if any(one.part.key in same_motion(r.found) for r in ranked[:k]):
            continue
        every = 0 < k < BEAM and leaves_as_little(one, ranked[0])
        if every:
            others = every_part(search, [one.part])
        else:
            others = [r.part for r in ranked[k + 1 :] if not same_signature(one.part, r.part)]
        own, same = joint_of(search, one.part), same_motion(one.found)
        others = [p for p in others if joint_of(search, p) == own and p.key not in same]
        if others:
            both = run_round(search, search.fitted_again(one.found), others, leading=True)
            for found in [search.fitted_again(r.found) for r in both if not r.why_not][:1]:
                if best is None or found.cost < best.cost:
                    best, among_all = found, every
        if best is not None and at_noise(best):
            break
    return best, among_all


def split_in_two(search: Search, current: Fit) -> Fit | None:
    """The fit with two effects in place of one that is confused with both, if they explain more; else None.

    Only pairs with no more parameters than the one are tried, so that the better fit decides. Example: within a part of
    a turn, a spring and a constant force look like an unbalanced mass.
    """
    here = ForceCriterion(search, current)
    for k, part in enumerate(current.trial.parts):
        if len(part.names) < 2 or at_noise(current):
            continue
        rest = search.without(current, k)
        alike = [p for p in every_part(search, rest.trial.parts) if is_confused(search, part, p)]
        for one, two in combinations(alike, 2):
            if one.key == two.key or len(one.names) + len(two.names) > len(part.names):
                continue
            for first in fit_candidates(search, rest, [one]):
                for both in fit_candidates(search, first, [two]):
                    better = both.cost < current.cost - BETTER and runs_prefer(search, both, current)
                    if better and is_possible(search, both) and not force_prefers(here, ForceCriterion(search, both)):
                        return search.fitted_again(both)
    return None


def is_confused(search: Search, one: Part, other: Part) -> bool:
    """Whether the catalogue lists two effects on the same coordinate as having a similar signature."""
    here, there = (p.effect.coordinate(search.system, p.place) for p in (one, other))
    return here == there and bool(separating_experiment(one.kind, other.kind))
