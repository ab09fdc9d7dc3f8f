"""Diagnosis by free-run simulation and force residual: the stages from the search to the answer.

    case → selection → acceptance → ties → refusals → conclusion

Forward selection finds effects that explain the training log. They are then tested on held-out data and by the
force residual, compared with effects that explain it as well, and by further checks that can only refuse. The last
ones examine the residual that is left.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from codegen.base.progress import shares_to
from codegen.diagnosis.case import Case, Findings
from codegen.diagnosis.evidence.residual_regression import acting_force, at_once, remainders
from codegen.diagnosis.fit.acceptance import is_far, near_noise
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.measure import RESTART_S, measure, restart_within_reach
from codegen.diagnosis.fit.output_error import Fit, levels_at_zero
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import ErrorFigures, Fact, ParameterError, Remainder, Separation, titles
from codegen.diagnosis.selection.forward_selection import Outcome, common_effects, find_effects, within_reach
from codegen.diagnosis.verdict import wrong_values
from codegen.diagnosis.verdict.against_regression import changes_beside, unrepeated, varying
from codegen.diagnosis.verdict.answer import (
    Answer,
    by_remainder,
    is_small,
    unknown_above_drive,
    unknown_for_a_candidate,
    verdict_of,
)
from codegen.diagnosis.verdict.examination import examine
from codegen.diagnosis.verdict.force_led import accepted_across_joints, accepted_by_force
from codegen.diagnosis.verdict.harmonics import with_harmonics
from codegen.diagnosis.verdict.held_out import FinalCheck, HeldOut, within
from codegen.diagnosis.verdict.in_place import (
    as_unknown,
    better_than_named,
    better_than_refused,
    nameless_rival,
    not_determined,
)
from codegen.diagnosis.verdict.late_inputs import adds_states, corrected_for_leads
from codegen.diagnosis.verdict.over_positions import arc_of_a_curve, missing_curve
from codegen.diagnosis.verdict.separation import MOST_RIVALS, separate, tied_fits
from codegen.diagnosis.verdict.statement import interval_in_words
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.numerics import is_numerical, numerical

MOST_CORRECTIONS = 2
"""How often the lead of inputs is corrected and the effects are sought again."""
Report = Callable[[str, float], None]
"""Called with (name of the step, share done of the diagnosis)."""


@dataclass(frozen=True, eq=False)
class Selection:
    """Effects that explain the training log, before they are tested on held-out data.

    Attributes:
        case: with the inputs shifted in time to when they act (``late_inputs.py``).
        search: on the record of ``case``.
        base: the refit without effects.
        tried: the outcome of forward selection.
        outcome: the same, with a sum of harmonics in place of a single sine where that is better.
        last: the search of the last fit of ``outcome``.
        replaced: effects in place of which wrong values of parameters are reported.
    """

    case: Case
    search: Search
    base: Fit
    tried: Outcome
    outcome: Outcome
    last: Search
    replaced: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class Conclusion:
    """The answer of a diagnosis by free runs.

    Attributes:
        outcome: of forward selection, for the effects of the answer.
        left: the remainder of the model that is written.
        tied: fits that the log does not discriminate.
        separation: the experiment that discriminates them.
        excitation: text of the file with the motion of that experiment.
    """

    answer: Answer
    outcome: Outcome
    left: tuple[Remainder, ...]
    tied: Sequence[Fit] = ()
    separation: Separation | None = None
    excitation: str | None = None


def select(case: Case, search: Search, report: Report, on_findings: Callable[[Findings], None]) -> Selection:
    """Refit and forward selection; both again with inputs taken earlier if that explains the effects found as well."""

    def effects(turn: int, share: float) -> None:
        report(f"effect {turn + 1}", 0.1 + 0.25 * min(turn + share, 2.7))

    report("refit", 0.05)
    search, base = _refit(case.spec, search, case)
    for turn in range(MOST_CORRECTIONS + 1):
        search, outcome, replaced = _selected(search, base, effects, case, may_be_late=turn < MOST_CORRECTIONS)
        late = corrected_for_leads(case, search, outcome.final) if turn < MOST_CORRECTIONS else None
        if late is None:
            break
        known = case.findings_in_words["train"]
        on_findings({"train": tuple(words for words in late.findings_in_words["train"] if words not in known)})
        case, (search, base) = late, _refitted_late(late, search)
    with_sums, last = with_harmonics(search, outcome) if not case.faults else (outcome, search)
    return Selection(case, search, base, outcome, with_sums, last, replaced)


@dataclass(frozen=True, eq=False)
class SelectionChecks:
    """The checks of a selection by held-out data and the force residual, with the answer (``conclude``)."""

    selection: Selection

    @property
    def case(self) -> Case:
        return self.selection.case

    @cached_property
    def restart_s(self) -> float:
        """Seconds between restarts of free runs on held-out data."""
        case = self.case
        longest = case.log_of_test.description.evaluation.restart_s or RESTART_S
        return restart_within_reach(case.problem.system, case.test.motion, case.window, longest)

    def measured(self, model: System) -> ErrorFigures:
        """Errors of a model on held-out data."""
        case = self.case
        return measure(model, case.test.motion, case.test.used, case.window, self.restart_s)

    @cached_property
    def held_out(self) -> HeldOut:
        problem = Problem(self.case.problem.system, within(self.case.test.motion, self.case.window), {})
        return HeldOut(problem, self.measured)

    def conclude(self, report: Report) -> Conclusion:
        """The answer after all checks.

        The selected effects are judged on held-out data; a wave whose period the log does not cover replaces effects
        that explain less. Tied effects are compared, and those that all of them have in common are named. Further
        checks can only refuse effects, and the residual that is left decides between ``unknown`` and ``none``.
        """
        chosen, case = self.selection, self.case
        answer, outcome = self._accepted(report)
        wave, explaining_less = None, answer.effects
        if answer.verdict in ("effect", "ambiguous"):
            wave = better_than_named(chosen.search, chosen.tried, outcome)
        if wave is not None:
            tried = chosen.tried
            answer, outcome = self._examined(chosen.search, replace(tried, final=tried.base, rivals=(), explained=0.0))
        tied: Sequence[Fit] = ()
        separation, excitation = None, None
        if answer.verdict == "ambiguous":
            tied, separation, excitation = self._compared(outcome, report)
            answer, outcome = self._in_common(outcome) or (answer, outcome)
        answer, left, refused = self._last_checks(answer, outcome)
        if wave is None and answer.verdict == "unknown" and answer.against and len(outcome.parts) == 1:
            second = self._next_candidate(answer)
            if second is not None:
                answer, outcome, left, refused = second
                tied, separation, excitation = (), None, None  # these were of the refused candidate
        if not refused:  # else a force is missing, however little of it the motion predicts
            answer = replace(answer, verdict=by_remainder(answer.verdict, left, case.material))
            answer = unknown_above_drive(answer, left, case.problem)
            answer = unknown_for_a_candidate(answer, chosen.tried.first, case.material)
        if wave is None and not refused and answer.verdict in ("none", "unknown"):
            wave, explaining_less = better_than_refused(chosen.search, chosen.tried, outcome, case.material), ()
        if wave is not None:
            answer = not_determined(answer, wave, case.problem, explaining_less)
        answer = replace(answer, remarks=tuple(self._remarks(outcome, answer)))
        return Conclusion(answer, outcome, left, tied, separation, excitation)

    def _last_checks(self, answer: Answer, outcome: Outcome) -> tuple[Answer, tuple[Remainder, ...], bool]:
        """The answer after the checks that can only refuse, what its model leaves, and whether a law refused it."""
        case = self.case
        another = self._another_law(answer, outcome) if answer.verdict == "effect" else None
        answer = answer if another is None else another
        answer = wrong_values.refused_for_a_value(case.spec, answer, case.problem, self.measured)
        answer = self._checked(answer, outcome.final)
        left = self._left_by(answer)
        changing = changes_beside(case.problem, answer, left, case.material) if answer.verdict == "effect" else ""
        if changing:
            answer = answer.refused(changing)
            left = self._left_by(answer)
        return answer, left, another is not None or bool(changing)

    def _next_candidate(self, refused: Answer) -> tuple[Answer, Outcome, tuple[Remainder, ...], bool] | None:
        """The answer with another candidate of the first round that passed every test, after the best one is refused.

        It must pass all checks too, and nothing material may be left: what a wrong law leaves is material where a
        better one was refused, as of a force outside the catalogue. At most ``MOST_RIVALS`` are examined. None if there
        is no such candidate.
        """
        search, tried = self.selection.search, self.selection.tried
        passed = {one.part.key: one for one in reversed(tried.first) if not one.why_not}  # the best form of each
        known = {effect.key for effect in refused.effects}
        others = [one for one in tried.first if one is passed.get(one.part.key) and one.part.key not in known]
        for one in others[:MOST_RIVALS]:
            (refitted_values, values), parts = one.found.values, one.found.trial.parts
            final = search.with_parts(tried.base, refitted_values, parts, values)
            answer, outcome = self._examined(search, tried.with_final(search, final, ()))
            answer, left, _ = self._last_checks(answer, outcome)
            changing = any(r.is_changing(self.case.material) for r in left)
            if answer.verdict == "effect" and is_small(left, self.case.material) and not changing:
                given = {"named": titles(refused.effects), "why": refused.against[0].words}
                return answer.noted(Fact.worded("not accepted", "refused better", **given)), outcome, left, False
        return None

    def _accepted(self, report: Report) -> tuple[Answer, Outcome]:
        """The answer by free runs, else by the force residual if these end far from the data, or across joints."""
        chosen, case, search = self.selection, self.case, self.selection.search
        answer, outcome = self._examined(chosen.last, chosen.outcome)
        far = is_far(outcome.final if answer.verdict in ("effect", "ambiguous") else chosen.base)

        def examined(found: Outcome) -> tuple[Answer, Outcome]:
            return self._examined(chosen.last, found)

        if answer.verdict != "none" and far and not case.faults:
            # Free runs may choose values of the right effect that held-out data refuse; those by force are then tried.
            lasting = self._checked(answer, outcome.final) if answer.verdict == "effect" else answer
            with shares_to(lambda done: report("effects by the force residual", 0.8 + 0.05 * done)):
                answer, outcome = accepted_by_force(search, outcome, lasting, self.measured, self._checked)
        if answer.verdict in ("none", "unknown") and not case.faults:
            answer, outcome = accepted_across_joints(search, outcome, answer, examined, case.material)
        return answer, outcome

    def _examined(self, last: Search, found: Outcome, complete: bool = True) -> tuple[Answer, Outcome]:
        """The answer from an outcome, and the outcome that it belongs to; arguments as of ``examine``."""
        verdict = verdict_of(found, self.case.faults)
        search = replace(self.selection.search, within=last.within)
        return examine(search, last, found, verdict, self.held_out, complete)

    def _compared(self, outcome: Outcome, report: Report) -> tuple[Sequence[Fit], Separation, str | None]:
        """The fits of tied effects, the experiment that tells them apart, and the text of the file with its motion."""
        report("experiment that separates", 0.85)
        tied = tied_fits(self.selection.search, outcome)

        def progress(what: str, share: float) -> None:
            report(f"experiment that separates: {what}", 0.85 + 0.08 * share)

        case = self.case
        return tied, *separate(self.selection.search, outcome, tied, case.log, case.spec.envelope, progress)

    def _in_common(self, outcome: Outcome) -> tuple[Answer, Outcome] | None:
        """The answer with the effects that all tied models have in common; None if they leave too much."""
        common = common_effects(self.selection.last, outcome)
        if common is None:
            return None
        answer, found = self._examined(*common, complete=False)
        if answer.verdict != "effect":
            return None
        # Near the noise, only an immaterial remainder may be left.
        if not (is_far(outcome.final) or is_small(self._left_by(answer), self.case.material)):
            return None
        return answer.noted(_left_out(outcome, answer)), found

    def _another_law(self, answer: Answer, outcome: Outcome) -> Answer | None:
        """The answer ``unknown`` if a law that the catalogue lacks explains the log as well as an effect; else None."""
        final, last = outcome.final, self.selection.last
        own = last if len(final.offsets) == len(last.record.at_rest) else self.selection.search
        nameless = nameless_rival(own, final)
        if nameless is not None:
            return as_unknown(answer, nameless)
        varies = varying(self.case.problem, answer.augmented, answer.effects, self.case.material)
        if varies is not None:
            return answer.refused(varies.words)
        no_wave = unrepeated(self.case.problem, answer.augmented, answer.effects, self.case.material)
        if no_wave:
            return answer.refused(no_wave)
        arc = arc_of_a_curve(self.case.problem, answer.refit, answer.augmented, answer.effects)
        return None if arc is None else answer.refused(arc[0].words).noted(arc[1])

    def _checked(self, answer: Answer, final: Fit) -> Answer:
        """The answer without what held-out data refuse at last; ``final``: the fit with its effects."""
        return FinalCheck(self.held_out, near_noise(final), self.case.material).passed(answer)

    def _left_by(self, answer: Answer) -> tuple[Remainder, ...]:
        """The remainder of the model that is written."""
        problem = self.case.problem
        return remainders(answer.adopted or answer.refit, problem.motion, problem.used)

    def _remarks(self, outcome: Outcome, answer: Answer) -> Iterator[Fact]:
        """Further facts on an answer."""
        chosen, case, problem = self.selection, self.case, self.case.problem
        lacks = answer.verdict == "effect"
        yield from answer.remarks
        if answer.verdict == "unknown":
            curve = missing_curve(problem, answer.refit)
            if curve is not None:
                yield curve.fact
            yield from wrong_values.explaining_values(case.spec, answer.refit, problem, curve.share if curve else 0.0)
        for name in levels_at_zero(problem.system, (answer.refit, answer.augmented), problem.levels):
            yield Fact.worded("declared value", "level at zero", name=name)
        yield from wrong_values.wrong_links_in_words(chosen.search, answer)
        yield from _in_place_of_a_value(chosen.replaced, answer)
        yield from wrong_values.turned_terms(answer, problem)
        if lacks and not answer.errors:
            yield from wrong_values.equal_parameters(chosen.search, chosen.base, outcome)
        yield from wrong_values.moved_values(answer, outcome.final if lacks else chosen.base, problem, case.material)
        yield from _once_on_held_out(answer, case)


def _refitted_late(late: Case, before: Search) -> tuple[Search, Fit]:
    """Search and refit with inputs taken earlier; ``before``: the search whose compiled models are taken."""
    search = search_on(late.problem, lambda share: record_of(late.problem.motion, late.log, share, late.events))
    return _refit(late.spec, replace(search, compiled=before.compiled), late)


@numerical("the fit of the model to the log")
def _refit(spec: Spec, search: Search, case: Case) -> tuple[Search, Fit]:
    """``within_reach``; raises BadInput with the preflight's problem if the refit cannot be computed."""
    try:
        return within_reach(search)
    except (ArithmeticError, RuntimeError, ValueError) as error:
        if case.unfit is None or not is_numerical(error):
            raise
        raise case.unfit from error


def _selected(
    search: Search, base: Fit, progress: Callable[[int, float], None], case: Case, may_be_late: bool = False
) -> tuple[Search, Outcome, tuple[Part, ...]]:
    """Forward selection, and once more without limits on the parameters where these may stand for an effect.

    Args:
        may_be_late: whether effects are compared with inputs that act earlier. A selection whose effects these explain
            is repeated by the caller, so it ends early: on an arm, whose joints are judged independently, with the
            first such effect; the selection without limits, if the one with limits found such effects as well.

    Returns:
        the search, the outcome, and the effects that were replaced by wrong values of parameters.
    """

    def are_late_inputs(search: Search, found: Fit) -> bool:
        return may_be_late and corrected_for_leads(case, search, found) is not None

    def ends_early(found: Fit) -> bool:
        return search.rigid is not None or not adds_states(found)

    outcome = find_effects(
        search, base, progress, case.faults, lambda found: ends_early(found) and are_late_inputs(search, found)
    )
    is_late = are_late_inputs(search, outcome.final)
    # At constant speed parameters keep their limits, since inertia acts only on noise and ripple there.
    if case.faults or case.steady or (is_late and ends_early(outcome.final)):
        return search, outcome, ()
    without_limits = wrong_values.released(search, base, outcome)
    if without_limits is None:
        return search, outcome, ()
    free_search, free_base = without_limits

    def are_late_too(found: Fit) -> bool:
        return is_late and are_late_inputs(free_search, found)

    free_outcome = find_effects(free_search, free_base, progress, case.faults, are_late_too)
    if are_late_too(free_outcome.final):
        return search, outcome, ()
    if wrong_values.is_better(free_search, free_outcome.final, search, outcome.final):
        return free_search, free_outcome, outcome.parts
    return search, outcome, ()


def _once_on_held_out(answer: Answer, case: Case) -> tuple[Fact, ...]:
    """Facts on single events, such as a push, with half of the squared residual force on held-out data.

    Events at a reversal are left out, since friction whose sign changes one sample early leaves the same residual.
    """
    if answer.adopted is None:
        return ()
    motion = case.test.motion
    within = np.zeros(len(motion.time), dtype=bool)
    within[case.window] = True
    residual, acting = residual_at_drive(answer.adopted, motion), acting_force(answer.adopted, motion)
    log, facts = case.log_of_test, list[Fact]()
    for i, x in enumerate(answer.adopted.positions):
        rows = case.test.used[:, i] & within
        found = at_once(residual[:, i], rows)
        if found is None or rms(residual[rows, i]) < case.material * rms(acting[rows, i]):
            continue
        start, stop = (float(motion.time[k]) for k in found)
        about = np.abs(motion.time - 0.5 * (start + stop)) <= 0.5 * (stop - start) + 1 / motion.cutoff_hz
        if np.ptp(np.sign(motion.velocities[about, i])) > 0:
            continue
        on, when = x.name if residual.shape[1] > 1 else "", interval_in_words(start, stop, log)
        facts.append(Fact.worded("log", "half at once", on=on, span=stop - start, when=when))
    return tuple(facts)


def _left_out(outcome: Outcome, answer: Answer) -> Fact:
    """The fact on the tied effects, if the answer names those that all tied models have in common."""
    parts = (outcome.parts[0], *(r.part for r in outcome.rivals))
    tied = " or ".join(dict.fromkeys(p.title for p in parts))
    if answer.errors:
        return Fact.worded("declared value", "in addition", errors=_names(answer.errors), named=tied)
    return Fact.worded("unexplained", "cannot tell which", named=tied)


def _in_place_of_a_value(parts: Sequence[Part], answer: Answer) -> list[Fact]:
    """The fact on effects that would be named if wrong parameter values were kept as declared."""
    found = {e.key for e in answer.effects}
    named = titles(p for p in parts if p.key not in found)
    if not named or not answer.errors:
        return []
    return [Fact.worded("declared value", "in place of a value", errors=_names(answer.errors), named=named)]


def _names(errors: Sequence[ParameterError]) -> str:
    return ", ".join(e.name for e in errors)
