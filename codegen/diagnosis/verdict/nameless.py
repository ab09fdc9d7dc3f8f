"""Test of a named effect against force laws outside the catalogue (``effects/nameless.py``).

Where friction takes most of the drive force, a force in proportion to the drive force and periodic in position, such as
a torque ripple that grows with the current, has nearly the shape of friction that depends on position. The two differ
where the machine accelerates, carries a load or changes its speed. So each such law is fitted in place of the effect,
and the effect is named only if the log prefers it to each of them.

A load that slips, such as that of a belt, moves nearly as one behind a spring and a strong damper, and is fitted in
place of ``compliance`` and ``backlash``. These stay named where the two fit alike, and only a better fit of the load
that slips prevents it (``if_better``): for a load that a damper drags along, the load that slips always fits as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.fit.acceptance import TIE_LEVEL
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.diagnosis.selection.parsimony import as_replacement
from codegen.diagnosis.selection.ranking import Ranked, preferred_by_force, runs_prefer, tied_by_free_runs
from codegen.diagnosis.selection.refusals import is_possible
from codegen.diagnosis.verdict.answer import Answer
from codegen.effects.declare import unit_words
from codegen.effects.nameless import NAMELESS


@dataclass(frozen=True)
class Rival:
    """A law outside the catalogue that explains a log as well as an effect does.

    Attributes:
        part: the effect. rival: the fit with the law in its place. better: whether free runs prefer that.
    """

    part: Part
    rival: Fit
    better: bool


def nameless_rival(search: Search, final: Fit) -> Rival | None:
    """The first effect of a fit that the log does not prefer to every law outside the catalogue, and the best such law.

    An effect is preferred by the rules for rivals: by free runs at ``TIE_LEVEL``, or by the force residual at
    this level where free runs do not contradict. Far from the noise, forces that are nearly alike tie. Some laws count
    only where free runs prefer them (``if_better``). The effect may have values by the force residual, while the laws
    are fitted to free runs, so it is compared with values by these too.
    """
    for k, part in enumerate(final.trial.parts):
        rivals = _rivals(search, part)
        if not rivals:
            continue
        without = search.without(final, k)
        found = [f for f in fit_candidates(search, without, rivals, final) if is_possible(search, f)]
        named, *others = (_compared(search, f, without) for f in (final, *found))
        for other in others:
            if not _counts(search, other, named):
                continue
            again = _compared(search, search.fitted_again(final), without)
            if _counts(search, other, again):
                return Rival(part, other.found, runs_prefer(search, other.found, again.found))
    return None


def _compared(search: Search, found: Fit, without: Fit) -> Ranked:
    """A fit with its evidence over the one without the effect, by both criteria."""
    return replace(as_replacement(search, found, without), force_criterion=ForceCriterion(search, found))


def _counts(search: Search, rival: Ranked, named: Ranked) -> bool:
    """Whether a law keeps an effect from being named: the log does not prefer the effect, or must prefer the law."""
    if not tied_by_free_runs(search, named, rival) or preferred_by_force(named, rival):
        return False
    return not NAMELESS[rival.part.kind].if_better or runs_prefer(search, rival.found, named.found)


def _rivals(search: Search, part: Part) -> list[Part]:
    """The laws outside the catalogue that resemble an effect, at its place, in all their forms."""
    system, place = search.system, part.place
    effects = (NAMELESS[kind] for kind in part.effect.nameless)
    return [part_of(form, place, system) for e in effects if e.applies(system, place) for form in e.forms]


def as_unknown(answer: Answer, found: Rival) -> Answer:
    """The verdict ``unknown`` with the reason, and the experiment that discriminates the law from the effect."""
    part = found.rival.part
    law = NAMELESS[part.kind]
    force = law.in_words(found.rival.parameters, unit_words(law, part.place, answer.refit))
    compared = "better than" if found.better else "as well as"
    named = found.part.title
    level = in_percent(TIE_LEVEL)
    why = f"a force outside the catalogue explains the log {compared} {named}, compared at the {level} level"
    refused = answer.refused(f"{why}: {force}")
    return refused.noted(Fact("next", law.discriminating_experiment))
