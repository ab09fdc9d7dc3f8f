"""Candidates that a log refuses only since it covers less than their period.

Nothing shows that such a wave repeats, so it is not credited. But the force is there, and effects that explain it worse
are not what is missing. The verdict is then ``unknown``, with the candidate and the stroke that would show its period.
"""

from __future__ import annotations

from dataclasses import replace

from codegen.diagnosis.evidence.estimate import effect_of, estimate
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.reservations import objections
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.crediting import BETTER
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, force_prefers, same_signature
from codegen.diagnosis.verdict.answer import Answer

SURE = 0.05
"""Half width of the 95 % interval of a period, over the period, up to which the stroke that shows it is known. Of three
waves that imitated springs and weights within their period it was 8, 45 and 780 %; of two true ones 0.2 and 0.3 %."""


def better_than_a_sum(search: Search, tried: Outcome, outcome: Outcome) -> Ranked | None:
    """The uncovered candidate that explains more than several effects of its place and variable together, or None.

    Args:
        tried: of the selection by free runs. outcome: that of the answer, whose effects are compared.
    """
    every = (*tried.first, *(r for later in tried.later for r in later.ranked))
    return next((r for r in every if r.uncovered and _explains_more(search, tried, r, outcome, least=2)), None)


def better_than_refused(search: Search, tried: Outcome, outcome: Outcome, material: float) -> Ranked | None:
    """The uncovered candidate of material size that explains more than all refused effects together, or None."""
    shown = [r for r in tried.first if r.uncovered and r.size >= material]
    best = min(shown, key=lambda r: r.found.cost, default=None)
    return best if best is not None and _explains_more(search, tried, best, outcome) else None


def _explains_more(search: Search, tried: Outcome, one: Ranked, outcome: Outcome, least: int = 0) -> bool:
    """Whether a candidate fits free runs better, as a replacement must, the force prefers it, and its period is sure.

    It is fitted in place of all effects; with ``least`` of those of its place and variable, if they are as many.
    """
    (moved, values), parts, part = outcome.final.values, outcome.final.trial.parts, one.part
    kept = [k for k, p in enumerate(parts) if least and not same_signature(p, part)]
    if len(parts) - len(kept) < least:
        return False
    whole = search.with_parts(tried.base, moved, parts, values) if parts else tried.base
    others, known = [parts[k] for k in kept], [values[k] for k in kept]
    wave = search.with_parts(tried.base, moved, [*others, part], [*known, one.found.parameters])
    if wave.cost > whole.cost - BETTER:
        return False
    if not force_prefers(ForceCriterion(search, wave), ForceCriterion(search, whole)):
        return False
    period, (low, high) = estimate(*search.polished(wave)).effects[-1]["period"]
    return high - low <= 2 * SURE * period


def not_determined(answer: Answer, one: Ranked, problem: Problem, named: str = "") -> Answer:
    """The verdict ``unknown`` with an uncovered candidate; ``named``: the effects that explain less, in words."""
    part = one.part
    found = effect_of(part, one.found.parameters, problem.system)
    reason = Fact("not credited", "; ".join(objections(found, part, problem, one.found.model)))
    less = (Fact("not credited", f"It explains more than {named} together"),) if named else ()
    stroke = f"{found.parameters['period']:.3g} {found.units['period']} on {found.on}"
    return replace(answer.unknown((found,), (reason, *less)), stroke=stroke)
