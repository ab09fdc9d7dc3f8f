"""Laws that are tried in place of effects: waves of which the log covers a part, and forces outside the catalogue.

A periodic candidate of which the log covers less than one period is refused for that alone. Nothing shows that such a
wave repeats, so it is not accepted. But the force is there, and effects that explain it worse are not what is missing.
The verdict is then ``unknown``, with the candidate and the stroke that would show its period.

A weight on a turning axis is a wave with the period of a turn, and is accepted on any stroke. Where another period
explains more, no weight is there, although nothing shows that this period is the true one either: within a part of its
period a wave follows many smooth curves.

Laws outside the catalogue (``effects/nameless.py``) resemble some effects. Where friction takes most of the drive
force, a force in proportion to the drive force and periodic in position, such as a torque ripple that grows with the
current, has nearly the shape of friction that depends on position. The two differ where the machine accelerates,
carries a load or changes its speed. So each such law is fitted in place of the effect, and the effect is named only if
the log prefers it to each of them.

A load that slips, such as that of a belt, moves nearly as one behind a spring and a strong damper, and is fitted in
place of ``compliance`` and ``backlash``. These stay named where the two fit alike, and only a better fit of the load
that slips prevents it (``if_better``): for a load that a damper drags along, the load that slips always fits as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.estimate import effect_of, estimate
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.reservations import objections
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, TIE_LEVEL
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.results import Fact, FoundEffect, titles
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.diagnosis.selection.comparison import (
    force_prefers,
    preferred_by_force,
    runs_prefer,
    same_signature,
    tied_by_free_runs,
)
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.parsimony import BETTER, as_replacement
from codegen.diagnosis.selection.ranking import Ranked
from codegen.diagnosis.selection.refusals import is_possible
from codegen.diagnosis.verdict.answer import Answer
from codegen.effects.declare import unit_words
from codegen.effects.nameless import NAMELESS

SURE = 0.05
"""Half width of the 95 % interval of a period, over the period, up to which the stroke that shows it is known. Of three
waves that imitated springs and weights within their period it was 8, 45 and 780 %; of two true ones 0.2 and 0.3 %."""


@dataclass(frozen=True, eq=False)
class Longer:
    """An uncovered candidate that explains more than the effects in whose place it is fitted.

    Attributes:
        is_sure: whether its period is, by ``SURE``. is_extension: whether it is that one effect with a free period.
    """

    wave: Ranked
    is_sure: bool
    is_extension: bool = False


def better_than_named(search: Search, tried: Outcome, outcome: Outcome) -> Longer | None:
    """The uncovered candidate that explains more than all effects of its place and variable together, or None.

    In place of several effects its period must be sure: two laws may add up to what a wave imitates. In place of one it
    need not be, but that one must be the wave with a fixed period (``Effect.limit``).

    Args:
        tried: of the selection by free runs. outcome: that of the answer, whose effects are compared.
    """
    every = (*tried.first, *(r for later in tried.later for r in later.ranked))
    found = (_as_replacement(search, tried, r, outcome, of_its_variable=True) for r in every if r.uncovered)
    return next((one for one in found if one is not None and (one.is_sure or one.is_extension)), None)


def better_than_refused(search: Search, tried: Outcome, outcome: Outcome, material: float) -> Longer | None:
    """The uncovered candidate of material size that explains more than all refused effects together, or None."""
    shown = [r for r in tried.first if r.uncovered and r.size >= material]
    best = min(shown, key=lambda r: r.found.cost, default=None)
    found = None if best is None else _as_replacement(search, tried, best, outcome)
    return found if found is not None and found.is_sure else None


def _as_replacement(
    search: Search, tried: Outcome, one: Ranked, outcome: Outcome, of_its_variable: bool = False
) -> Longer | None:
    """The candidate in place of all effects, if better by ``BETTER`` nats and by force residual; else None.

    With ``of_its_variable`` it replaces those of its place and variable only; None if there are none.
    """
    (refitted_values, values), parts, part = outcome.final.values, outcome.final.trial.parts, one.part
    kept = [k for k, p in enumerate(parts) if of_its_variable and not same_signature(p, part)]
    replaced = [p for k, p in enumerate(parts) if k not in kept]
    if of_its_variable and not replaced:
        return None
    extends = of_its_variable and len(replaced) == 1
    if extends and not _is_special_case(search, one, replaced[0]):
        return None
    whole = search.with_parts(tried.base, refitted_values, parts, values) if parts else tried.base
    others, known = [parts[k] for k in kept], [values[k] for k in kept]
    wave = search.with_parts(tried.base, refitted_values, [*others, part], [*known, one.found.parameters])
    if wave.cost > whole.cost - BETTER:
        return None
    here, there = ForceCriterion(search, wave), ForceCriterion(search, whole)
    if not (_shows_its_period(here, there) if extends else force_prefers(here, there)):
        return None
    period, (low, high) = estimate(*search.polished(wave)).effects[-1]["period"]
    return Longer(one, high - low <= 2 * SURE * period, extends)


def _is_special_case(search: Search, one: Ranked, law: Part) -> bool:
    """Whether a law is the wave with a fixed period, as a weight on a turning axis is with the period of a turn."""
    limit = one.part.effect.limit(search.system, one.part.place, one.found.parameters)
    return limit is not None and limit[0] == law.kind


def _shows_its_period(wave: ForceCriterion, law: ForceCriterion) -> bool:
    """Whether the force residual shows the period of a wave, the one parameter that the law does not have."""
    gain = wave.added_to(law)
    return gain.left <= 1 - LEAST_SHARE and gain.p_added(1) <= TIE_LEVEL


def not_determined(answer: Answer, longer: Longer, problem: Problem, named: Sequence[FoundEffect] = ()) -> Answer:
    """The verdict ``unknown`` with an uncovered candidate; ``named``: the effects that explain less."""
    one = longer.wave
    part = one.part
    found = effect_of(part, one.found.parameters, problem.system)
    reason = Fact("not accepted", "; ".join(objections(found, part, problem, one.found.model)))
    together = " together" if len(named) > 1 else ""
    less = (Fact("not accepted", f"It explains more than {titles(named)}{together}"),) if named else ()
    unknown = answer.unknown((found,), (reason, *less))
    if not longer.is_sure:
        return unknown.noted(Fact.worded("next", "longer stroke", on=found.on))
    stroke = f"{found.parameters['period']:.3g} {found.units['period']} on {found.on}"
    return replace(unknown, stroke=stroke)


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
