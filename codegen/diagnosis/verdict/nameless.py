"""Laws without a name as alternatives to a named effect.

A force over position is named by one log as long as that shows what it is in proportion to. Where friction takes most
of the drive force, a force in proportion to the drive force, such as a torque ripple that grows with the current, has
nearly the shape of friction over position. The two differ where the machine accelerates, carries a load or changes its
speed. So these forces (``effects/nameless.py``) are fitted in place of the effect, and it is named only if the log
prefers it to each of them.

A load that slips, such as that of a belt, is nearly one behind a spring and a strong damper. It is fitted in place of
these too. A spring is not named only if the log prefers the load that slips: that one is always there for a load that a
damper drags along.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.fit.credit import TIE_LEVEL
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.diagnosis.selection.forward_selection import as_replacement
from codegen.diagnosis.selection.ranking import preferred_by_force, runs_prefer, tied_by_free_runs
from codegen.diagnosis.selection.refusals import is_possible
from codegen.diagnosis.verdict.answer import Answer
from codegen.effects.declare import unit_words
from codegen.effects.nameless import NAMELESS


@dataclass(frozen=True)
class Rival:
    """A law without a name that explains a log as well as an effect does.

    Attributes:
        part: the effect. rival: the fit with the law in its place. better: whether free runs prefer that.
    """

    part: Part
    rival: Fit
    better: bool


def nameless_rival(search: Search, final: Fit) -> Rival | None:
    """The first effect of a fit that the log does not prefer to a law without a name, and the best of those; or None.

    An effect is preferred by the rules for rivals: by free runs at ``TIE_LEVEL``, or by the force residual at
    this level where free runs do not contradict. Far from the noise, forces that are nearly alike tie. Some laws count
    only where free runs prefer them (``if_better``).
    """
    for k, part in enumerate(final.trial.parts):
        rivals = _rivals(search, part)
        if not rivals:
            continue
        without = search.without(final, k)
        found = [
            f for f in fit_candidates(search, without, rivals, lambda share: None, final) if is_possible(search, f)
        ]
        named, *others = (
            replace(as_replacement(search, f, without), force_criterion=ForceCriterion(search, f))
            for f in (final, *found)
        )
        for other in others:
            if not tied_by_free_runs(search, named, other) or preferred_by_force(named, other):
                continue
            better = runs_prefer(search, other.found, final)
            if better or not NAMELESS[other.found.part.kind].if_better:
                return Rival(part, other.found, better)
    return None


def _rivals(search: Search, part: Part) -> list[Part]:
    """The laws without a name that look like an effect, at its place, in all their forms."""
    system, place = search.system, part.place
    effects = (NAMELESS[kind] for kind in part.effect.nameless)
    return [part_of(form, place, system) for e in effects if e.applies(system, place) for form in e.forms]


def without_name(answer: Answer, found: Rival) -> Answer:
    """The verdict ``unknown`` with the reason, and the experiment that tells the law and the effect apart."""
    part = found.rival.part
    law = NAMELESS[part.kind]
    force = law.in_words(found.rival.parameters, unit_words(law, part.place, answer.refit))
    compared = "better than" if found.better else "as well as"
    named = f"{found.part.kind} on {found.part.on}"
    level = in_percent(TIE_LEVEL)
    why = f"no effect of the catalogue, explains the log {compared} {named}, compared at the {level} level"
    refused = answer.refused(f"{force}, {why}")
    return refused.noted(Fact("next", law.told_apart))
