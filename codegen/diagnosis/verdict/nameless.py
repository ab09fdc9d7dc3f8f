"""Forces over position without a name as alternatives to a named effect.

A force over position is named by one log as long as that shows what it is in proportion to. Where friction takes most
of the drive force, a force in proportion to the drive force, such as a torque ripple that grows with the current, has
nearly the shape of friction over position. The two differ where the machine accelerates, carries a load or changes its
speed. So these forces (``effects/nameless.py``) are fitted in place of the effect, and it is named only if the log
prefers it to each of them.
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

EXPERIMENT = (
    "To tell them apart, log the same motion under another load, slow motion against a load, and accelerations several "
    "times as large at the same speeds: friction and cogging stay as they are, and a force in proportion to the drive "
    "force grows with it"
)


@dataclass(frozen=True)
class Nameless:
    """A force without a name that explains a log as well as an effect does.

    Attributes:
        part: the effect. rival: the fit with the force in its place. better: whether free runs prefer that.
    """

    part: Part
    rival: Fit
    better: bool


def nameless_rival(search: Search, final: Fit) -> Nameless | None:
    """The first effect of a fit that the log does not prefer to a force without a name, and the best of those; or None.

    An effect is preferred by the rules for rivals: by free runs at ``TIE_LEVEL``, or by the force residual at
    this level where free runs do not contradict. Far from the noise, forces that are nearly alike tie.
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
            if tied_by_free_runs(search, named, other) and not preferred_by_force(named, other):
                return Nameless(part, other.found, runs_prefer(search, other.found, final))
    return None


def _rivals(search: Search, part: Part) -> list[Part]:
    """The forces without a name that look like an effect, at its place, in all their forms."""
    system, place = search.system, part.place
    effects = (NAMELESS[kind] for kind in part.effect.nameless)
    return [part_of(form, place, system) for e in effects if e.applies(system, place) for form in e.forms]


def without_name(answer: Answer, found: Nameless) -> Answer:
    """The verdict ``unknown`` with the reason, and the experiment that tells the force and the effect apart."""
    part, values = found.rival.part, found.rival.parameters
    unit = unit_words(part.effect, part.place, answer.refit)["period"]
    share, period = in_percent(values["amplitude"]), f"{values['period']:.3g} {unit}"
    force = f"{part.effect.signature} (amplitude {share} of that, period {period})"
    compared = "better than" if found.better else "as well as"
    named = f"{found.part.kind} on {found.part.on}"
    level = in_percent(TIE_LEVEL)
    why = f"no force of the catalogue, explains the log {compared} {named}, compared at the {level} level"
    refused = answer.refused(f"{force}, {why}")
    return refused.noted(Fact("next", EXPERIMENT))
