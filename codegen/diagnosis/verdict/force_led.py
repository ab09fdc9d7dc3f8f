"""The answer by effects that the force residual selects, for logs that free runs do not follow.

A free run integrates everything that the model lacks. Its error may be dominated by something that is not an effect,
such as jitter of the time stamps or a drift, and then no effect is accepted by free runs. The force residual at one
time does not depend on earlier times. Effects that it selects and free runs confirm are examined as others are. On an
arm an effect may be shown by the forces of all joints (``accepted_across_joints``).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from codegen.diagnosis.evidence.force_gain import force_gain
from codegen.diagnosis.evidence.residual_regression import remainders
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import evidence_of, random_signs
from codegen.diagnosis.fit.drive import residual_without_levels
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Fact, Verdict, worded
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import ForceSelection, judged_in_addition, selected_by_force
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, twins, with_first
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict.admission import Measured
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.examination import with_estimate

Examined = Callable[[Outcome], tuple[Answer, Outcome]]
"""The answer from an outcome of the selection by free runs, and the outcome that it belongs to."""


def accepted_by_force(
    search: Search,
    outcome: Outcome,
    answer: Answer,
    measured: Measured,
    checked: Callable[[Answer, Fit], Answer],
) -> tuple[Answer, Outcome]:
    """The answer with effects that the force residual accepts and free runs confirm; unchanged if there are none.

    Args:
        outcome: of the selection by free runs. answer: the answer from that outcome.
        measured: the errors of a model on held-out data.
        checked: the answer after the last check on held-out data (``FinalCheck``). What it refuses must not replace
            effects that pass.
    """
    if answer.verdict != "unknown":
        return answer, outcome
    found = selected_by_force(search, outcome.base)
    if not isinstance(found, ForceSelection):
        return (answer if found is None else answer.noted(found)), outcome
    # Values and intervals are those of the fit to the force residual, examined as others are.
    led = replace(
        outcome,
        final=found.run,
        first=_with_first(outcome.first, found.rounds[0].ranked),
        later=found.rounds[1:],
        rivals=found.rivals,
        explained=found.explained,
    )
    verdict: Verdict = "ambiguous" if found.rivals else "effect"
    plain = replace(answer, verdict=verdict, effects=(), augmented=answer.refit, against=())
    plain = replace(plain, figures=(*answer.figures[:2], answer.figures[1]))
    second = checked(with_estimate(search, led, plain, measured, found.fit), led.final)
    if second.verdict != verdict:
        return answer.noted(*_refused(answer, second)), outcome
    return second.noted(Fact.worded("evidence", "by force")), led


def _refused(answer: Answer, by_force: Answer) -> tuple[Fact, ...]:
    """Why effects of the force residual are refused, where the verdict is `unknown` and the answer has others."""
    shown = [e.title for e in by_force.effects]
    if answer.verdict != "unknown" or shown == [e.title for e in answer.effects]:
        return ()
    given = {"named": " and ".join(shown), "one": len(shown) == 1}
    return tuple(replace(f, words=worded("refused by force", why=f.words, **given)) for f in by_force.against[:1])


def _with_first(first: Sequence[Ranked], named: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """The table of candidates, with ``named`` in place of its entries for the same effects."""
    known = {(*r.part.key, r.part.names) for r in named}
    others = [r for r in first if (*r.part.key, r.part.names) not in known]
    return (*named, *others)


def accepted_across_joints(
    search: Search,
    outcome: Outcome,
    answer: Answer,
    examined: Examined,
    material: float,
) -> tuple[Answer, Outcome]:
    """The answer with the effect of ``found_across_joints``; unchanged if there is none, or if a check refuses it.

    Candidates are judged at the joint on which they act. There the refitted friction and the masses of the links may
    take the effect: a drive gain on its joint's torque is nearly a change of its inertia, gravity and friction. The
    links' values then fit worse at another joint, whose forces contain the same masses.

    Free runs of all joints together must accept it too, and it is examined as other effects are: by its interval, and
    by held-out data on all joints and on its own. A machine that is simulated as a whole has no joints to be judged
    apart, so nothing is tried there. It takes the place of effects on single joints that were refused.
    """
    if search.rigid is None or search.system.degrees_of_freedom < 2:
        return answer, outcome
    found = found_across_joints(search, outcome.base, material)
    if found is None:
        return answer, outcome
    refitted_values, values = found.found.values
    final = search.with_parts(outcome.base, refitted_values, found.found.trial.parts, values)
    if not _accepted_by_runs(search, outcome.base, final):
        return answer, outcome
    led = replace(outcome.with_final(search, final, ()), first=tuple(with_first(found, outcome.first)))
    second, led = examined(led)
    if second.verdict != "effect":
        return answer, outcome
    return second.noted(Fact.worded("evidence", "across joints", share=found.evidence.share)), led


def _accepted_by_runs(search: Search, base: Fit, final: Fit) -> bool:
    """Whether free runs of all joints together accept the fit, by a sign test for all candidates (Bonferroni)."""
    soft, before = search.with_noise_floor(base)
    shown = evidence_of(before, soft.fitted_again(final))
    many = hypotheses(every_part(search, ()))
    return shown.share >= acceptance.LEAST_SHARE and many * random_signs(shown.t) <= acceptance.ALPHA


def found_across_joints(search: Search, base: Fit, material: float) -> Ranked | None:
    """The effect that the forces of all joints accept, clearly better than every rival on any joint; None if none.

    Only effects with one parameter are tried, since a curve on one joint can imitate a wrong mass at the others. They
    are tried on all joints, also those with little misfit: there the refit may hide the effect best. The p-value counts
    all candidates on all joints (Bonferroni).

    Args:
        base: the refit of the declared structure by free runs, of an arm that is simulated joint by joint.
        material: share of the RMS of the drive force from which on a force matters.
    """
    fits = ForceFits(search, base)
    alone = [part for part in fits.parts if len(part.names) == 1]
    ranked = judged_in_addition(fits, fits.plain, alone, hypotheses(fits.parts), everywhere=True)
    ranked.sort(key=lambda r: (bool(r.why_not), r.found.cost))
    if not ranked or ranked[0].why_not:
        return None
    best = ranked[0].found
    same = {best.part.key, *twins(best.part, best)}
    others = (r.found for r in ranked[1:] if r.grade)
    rivals = [other for other in others if other.part.key not in same]
    if not all(_is_better(search, best, rival) for rival in rivals):
        return None
    # A long log prefers one of two incomplete models by any small difference, which says nothing of the truth.
    alike = any(fits.nearly_alike(rival, best) for rival in rivals)
    return None if alike and not _is_complete(search, best, material) else ranked[0]


def _is_better(search: Search, best: Fit, rival: Fit) -> bool:
    """Whether the forces of all joints prefer a fit to a rival's by more than chance, each joint with its own noise."""
    shown = evidence_of(rival, best, floored=False)
    if random_signs(shown.t) > acceptance.TIE_LEVEL:
        return False
    one, other = (residual_without_levels(search.problem, fit.model) for fit in (best, rival))
    return force_gain(search.problem, other, one).p_of_rivals() <= acceptance.TIE_LEVEL


def _is_complete(search: Search, fit: Fit, material: float) -> bool:
    """Whether the motion and the time explain no material part of the force that a fit leaves on any joint."""
    left = remainders(fit.model, search.motion, search.problem.used)
    return not any(r.nature(material) == "structured" or r.is_changing(material) for r in left)
