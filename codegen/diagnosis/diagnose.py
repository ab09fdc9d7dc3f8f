"""Diagnosis of a log: the effects that the model lacks, its errors before and after, and the augmented spec.

    log → case → search → answer → diagnosis

The preflight and two filters prepare the case. A search fits effects to it by free-run simulation; for records at one
steady speed each, by the means of the records. The answer has the effects that held-out data and the force residual do
not refuse.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from codegen.base.errors import BadInput
from codegen.base.parallel import in_another_process
from codegen.base.progress import steps_to
from codegen.diagnosis import steady_runs
from codegen.diagnosis.case import HELD_OUT_SHARE, Case, Findings, case_of
from codegen.diagnosis.evidence.residual_regression import acting_force, half_of_squares, remainders
from codegen.diagnosis.experiments.separation import separate, tied_fits
from codegen.diagnosis.fit.credit import ALPHA, is_far, near_noise, noise_ratio, share_far
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.measure import RESTART_S, force_errors, measure, restart_within_reach
from codegen.diagnosis.fit.output_error import BLOCKS, Fit, levels_at_zero
from codegen.diagnosis.fit.record import is_shortened, position_noise, record_of
from codegen.diagnosis.fit.residual import Problem, residual_at_drive
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.reliability import reliability_of
from codegen.diagnosis.results import MATERIAL, Diagnosis, ErrorFigures, Fact, FoundEffect, Remainder
from codegen.diagnosis.selection.candidate_fits import start_compiling
from codegen.diagnosis.selection.forward_selection import Outcome, common_effects, find_effects, within_reach
from codegen.diagnosis.selection.refusals import admissible
from codegen.diagnosis.verdict import wrong_values
from codegen.diagnosis.verdict.across_joints import credited_across_joints
from codegen.diagnosis.verdict.answer import Answer, by_remainder, is_small, verdict_of
from codegen.diagnosis.verdict.augment import augmented_text
from codegen.diagnosis.verdict.examination import examine, refused_at_limit, settled
from codegen.diagnosis.verdict.final_check import FinalCheck
from codegen.diagnosis.verdict.force_led import credited_by_force
from codegen.diagnosis.verdict.harmonics import with_harmonics
from codegen.diagnosis.verdict.held_out import HeldOut, within
from codegen.diagnosis.verdict.hidden_effects import hidden_effects
from codegen.diagnosis.verdict.late_inputs import corrected_for_leads
from codegen.diagnosis.verdict.nameless import nameless_rival, without_name
from codegen.diagnosis.verdict.proposal import propose_terms, refuse_without_pysindy
from codegen.diagnosis.verdict.replay import compare_residuals
from codegen.diagnosis.verdict.statement import interval_in_words, statement
from codegen.diagnosis.verdict.table import candidates, in_no_round, rivals_of, rounds
from codegen.diagnosis.verdict.uncovered import better_than_a_sum, better_than_refused, not_determined
from codegen.logs import Log
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.numerics import is_numerical, numerical

HELD_OUT_EVERY = 3
"""Every third record at steady speed is held out, since records are ordered by speed and not by time."""
Progress = Callable[[str, float], None]
"""Called with (station, share done)."""


@dataclass(frozen=True, eq=False)
class Models:
    """The three compared models, and the data for training and test, which may be of the same motion.

    Attributes:
        window: the held-out part of ``test``.
        restart_s: seconds between restarts of free-run simulations there.
        excitation: text of the file with the discriminating motion, or None.
    """

    declared: System
    refit: System
    augmented: System
    train: Problem
    test: Problem
    window: slice
    spec_text: str
    named: tuple[FoundEffect, ...]
    restart_s: float = RESTART_S
    excitation: str | None = None


@numerical("the fit of the model to the log", given=False)
def diagnose_log(
    spec: Spec,
    system: System,
    log: Log,
    test_log: Log | None = None,
    progress: Progress | None = None,
    propose: bool = False,
    material: float = MATERIAL,
    tell: Callable[[Findings], None] = lambda found: None,
) -> tuple[Diagnosis, Models]:
    """Diagnose one log.

    Args:
        log: to train on; without ``test_log`` its last 30 % is held out.
        material: share of the RMS of the drive force from which on a force matters.
        tell: called with what the preflight found, before anything is fitted.

    Raises:
        BadInput: if a log is too short or has too little motion; for a proposal without PySINDy.
    """
    if propose:
        refuse_without_pysindy()
    report = progress or (lambda station, share: None)
    with steps_to(progress):
        case = case_of(spec, system, log, test_log, material)
    means = steady_runs.means_of(case.log) if steady_runs.is_static(case.problem.system) and not case.faults else None
    if means is None:
        search = search_on(case.problem, lambda share: record_of(case.problem.motion, case.log, share))
        if not case.faults:  # of which no effect is tried
            start_compiling(search)
        tell(case.findings_in_words)  # after the checks that refuse a short log
        diagnosis, models = _by_free_runs(case, search, report, propose, tell)
    else:
        tell(case.findings_in_words)
        report("means of steady records", 0.2)
        diagnosis, models = _by_means(case, means)
    return diagnosis, models


@dataclass(frozen=True, eq=False)
class _FreeRuns:
    """Stages of a diagnosis by free-run simulation of short segments; ``base``: the refit."""

    case: Case
    search: Search
    base: Fit

    @cached_property
    def restart_s(self) -> float:
        case = self.case
        longest = (case.test_log or case.log).description.evaluation.restart_s or RESTART_S
        return restart_within_reach(case.problem.system, case.test.motion, case.window, longest)

    def measured(self, model: System) -> ErrorFigures:
        """Errors of a model on held-out data."""
        case = self.case
        return measure(model, case.test.motion, case.test.used, case.window, self.restart_s)

    @cached_property
    def held_out(self) -> HeldOut:
        problem = Problem(self.case.problem.system, within(self.case.test.motion, self.case.window), {})
        return HeldOut(problem, self.measured)

    def checked(self, answer: Answer, final: Fit) -> Answer:
        """The answer without what held-out data refuse at last; ``final``: the fit with its effects."""
        return FinalCheck(self.held_out, near_noise(final), self.case.material).passed(answer)

    def examined(self, last: Search, found: Outcome) -> tuple[Answer, Outcome]:
        """The answer from an outcome, and the outcome that it belongs to; ``last``: the search of its last fit."""
        verdict = verdict_of(found, self.case.faults)
        search = replace(self.search, within=last.within)
        return examine(search, last, found, verdict, self.held_out)

    def left_by(self, answer: Answer) -> tuple[Remainder, ...]:
        """The remainder of the model that is written."""
        problem = self.case.problem
        return remainders(answer.adopted or answer.refit, problem.motion, problem.used)

    def without_tied(self, last: Search, outcome: Outcome, far: bool) -> tuple[Answer, Outcome] | None:
        """The answer with the effects that all tied models have in common; None if they leave too much."""
        common = common_effects(last, outcome)
        if common is None:
            return None
        answer, found = self.examined(*common)
        # Near the noise, only an immaterial remainder may be left.
        if answer.verdict != "effect" or not (far or is_small(self.left_by(answer), self.case.material)):
            return None
        return answer.noted(_left_out(outcome, answer)), found

    def remarks(self, outcome: Outcome, answer: Answer, in_place: Sequence[Part]) -> Iterator[Fact]:
        """Further facts on an answer; ``in_place``: effects that were replaced by wrong parameter values."""
        case, problem = self.case, self.case.problem
        lacks = answer.verdict == "effect"
        yield from answer.remarks
        if answer.verdict == "unknown":
            yield from wrong_values.explaining_values(case.spec, answer.refit, problem)
        for name in levels_at_zero(problem.system, (answer.refit, answer.augmented), problem.levels):
            yield Fact("declared value", f"The fit reduces the friction level {name} to zero, its lowest value")
        if answer.verdict == "none" and not answer.errors:
            yield from hidden_effects(self.search, answer.refit, case.material)
        yield from wrong_values.wrong_links_in_words(self.search, answer)
        yield from _in_place(in_place, answer)
        yield from wrong_values.turned_terms(answer, problem)
        if lacks and not answer.errors:
            yield from wrong_values.equal_parameters(self.search, self.base, outcome)
        yield from wrong_values.moved_values(answer, outcome.final if lacks else self.base, problem, case.material)
        yield from _once_on_held_out(answer, case)


def _by_free_runs(
    case: Case, search: Search, report: Progress, propose: bool, tell: Callable[[Findings], None]
) -> tuple[Diagnosis, Models]:
    """The diagnosis by free-run simulation and force residual."""
    system = case.problem.system

    def effects(turn: int, share: float) -> None:
        report(f"effect {turn + 1}", 0.1 + 0.25 * min(turn + share, 2.7))

    report("refit", 0.05)
    # Asked of the log's own segments: a later search may be on shorter ones.
    uncounted = not case.log.joints and is_shortened(search.record, case.problem.motion)
    search, base = _refit(case.spec, search, case)
    search, outcome, in_place = _sought(search, base, effects, case)
    corrected = corrected_for_leads(case, search, outcome.final)
    if corrected is not None:
        known = case.findings_in_words["train"]
        tell({"train": tuple(words for words in corrected.findings_in_words["train"] if words not in known)})
        case, compiled = corrected, search.compiled
        search = search_on(case.problem, lambda share: record_of(case.problem.motion, case.log, share))
        search = replace(search, compiled=compiled)
        search, base = _refit(case.spec, search, case)
        search, outcome, in_place = _sought(search, base, effects, case)
    problem = case.problem
    tried = outcome
    outcome, last = with_harmonics(search, outcome) if not case.faults else (outcome, search)

    agreement = in_another_process(compare_residuals, case.spec, system, problem.motion)
    report("values and held-out error", 0.78)
    runs = _FreeRuns(case, search, base)
    leader = outcome.parts[0] if outcome.rivals else None
    answer, outcome = runs.examined(last, outcome)
    far = is_far(outcome.final if answer.verdict in ("effect", "ambiguous") else base)
    if answer.verdict != "none" and far and not case.faults:
        # Free runs may choose values of the right effect that held-out data refuse; those by the force are then tried.
        lasting = runs.checked(answer, outcome.final) if answer.verdict == "effect" else answer
        answer, outcome = credited_by_force(
            search,
            outcome,
            lasting,
            runs.held_out,
            case.steady,
            lambda found: runs.examined(last, found),
            runs.checked,
            lambda done: report("effects by the force residual", 0.8 + 0.05 * done),
            leader,
        )
    if answer.verdict in ("none", "unknown") and not case.faults:
        answer, outcome = credited_across_joints(
            search, outcome, answer, lambda found: runs.examined(last, found), case.material
        )
    tied: list[Fit] = []
    experiment, excitation = None, None
    open_, named = None, ""
    if answer.verdict in ("effect", "ambiguous"):
        open_ = better_than_a_sum(search, tried, outcome)
    if open_ is not None:
        named = " and ".join(f"{e.kind} on {e.on}" for e in answer.effects)
        answer, outcome = runs.examined(search, replace(tried, final=tried.base, rivals=(), explained=0.0))
    if answer.verdict == "ambiguous":
        report("experiment that separates", 0.85)
        tied = tied_fits(search, outcome)

        def separation_report(what: str, share: float) -> None:
            report(f"experiment that separates: {what}", 0.85 + 0.08 * share)

        experiment, excitation = separate(search, outcome, tied, case.log, case.spec.envelope, separation_report)
        answer, outcome = runs.without_tied(last, outcome, far) or (answer, outcome)
    nameless = None
    if answer.verdict == "effect":
        own = last if len(outcome.final.offsets) == len(last.record.at_rest) else search
        nameless = nameless_rival(own, outcome.final)
    answer = answer if nameless is None else without_name(answer, nameless)
    answer = wrong_values.refused_for_a_value(case.spec, answer, problem, runs.measured)
    answer = refused_at_limit(answer, runs.left_by, case.material)
    answer = settled(replace(search, within=last.within), outcome, answer, runs.measured)
    answer = runs.checked(answer, outcome.final)
    left = runs.left_by(answer)
    if nameless is None:  # that force is there, however much of it a curve over the motion predicts
        answer = replace(answer, verdict=by_remainder(answer.verdict, left, case.material))
    if open_ is None and nameless is None and answer.verdict in ("none", "unknown"):
        open_ = better_than_refused(search, tried, outcome, case.material)
    answer = not_determined(answer, open_, problem, named) if open_ is not None else answer
    answer = replace(answer, remarks=tuple(runs.remarks(outcome, answer, in_place)))

    report("tracking observer", 0.93)
    unknown = propose and answer.verdict == "unknown"
    models = _models(case, problem, answer, case.window, runs.restart_s, excitation)
    diagnosis = _diagnosis(
        case,
        answer,
        models,
        rivals_of(outcome, tied, answer.refit),
        lambda model: force_errors(model, problem.motion, problem.used)[2],
        outcome,
        remainder=left,
        data=_data(case, problem, runs.restart_s) | _search_data(search, outcome),
        separation=experiment,
        candidates=candidates(outcome, system, answer.verdict),
        agreement=agreement(),
        later_rounds=rounds(outcome),
        in_no_round=in_no_round(last, outcome),
        reliability=None if uncounted else reliability_of(answer.verdict, not is_far(outcome.final)),
        proposal=propose_terms(answer.refit, problem, case.test, case.window) if unknown else None,
    )
    return diagnosis, models


def _by_means(case: Case, means: steady_runs.Means) -> tuple[Diagnosis, Models]:
    """The diagnosis of records at one steady speed each, by their means."""
    problem, count = replace(case.problem, motion=case.motion), len(means)
    data = _data(case, problem, RESTART_S)
    if case.test_log is not None:
        held = steady_runs.means_of(case.test_log)
    else:
        apart = np.arange(count) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        held, means = means.of(apart), means.of(~apart)
        data |= {"test": f"{data['train']}, one record in {HELD_OUT_EVERY}"}
    window = slice(0, len(case.test.motion.time))
    test = case.test.motion
    if held is not None:
        test = steady_runs.with_mean_inputs(test, case.test_log or case.log)
        data |= {"simulated_by": "the mean inputs of each record"}

    def measured(model: System) -> ErrorFigures:
        plain = measure(model, test, case.test.used, window)
        return plain if held is None else steady_runs.figures_of(model, held, plain)

    steady = steady_runs.SteadySearch(problem, means, position_noise(case.motion, case.log))
    answer, found = steady_runs.answer_of(steady, measured)
    left = steady_runs.remainders_of(answer.adopted or answer.refit, means)
    if answer.verdict == "none" and any(r.nature(case.material) == "structured" for r in left):
        answer = replace(answer, verdict="unknown")
    first, *later = found.rounds
    models = _models(case, problem, answer, window)
    diagnosis = _diagnosis(
        case,
        answer,
        models,
        [steady_runs.effects_of(one.fit, answer.refit)[0] for one in found.rivals],
        lambda model: steady_runs.figures_of(model, means, answer.figures[0]).relative_force,
        records=len(means),
        remainder=left,
        data=data | {"segments": len(means), "alpha": ALPHA},
        candidates=first.candidates,
        later_rounds=tuple(later),
    )
    return diagnosis, models


def _models(
    case: Case,
    train: Problem,
    answer: Answer,
    window: slice,
    restart_s: float = RESTART_S,
    excitation: str | None = None,
) -> Models:
    """The models of an answer, with the augmented spec; arguments as of ``Models``."""
    system, written = train.system, answer.adopted
    named = answer.effects if answer.verdict == "effect" else ()
    values = {} if written is None else {s.name: float(written.values[s]) for s in train.moved}
    text = augmented_text(case.spec, named, values, system)
    three = (system, answer.refit, answer.augmented)
    return Models(*three, train, case.test, window, text, answer.effects, restart_s, excitation)


def _diagnosis(
    case: Case,
    answer: Answer,
    models: Models,
    rivals: Sequence[FoundEffect],
    relative_error: Callable[[System], float],
    outcome: Outcome | None = None,
    records: int = 0,
    **found: Any,
) -> Diagnosis:
    """The diagnosis of an answer; ``relative_error``: of a model on the training log; ``found``: further fields."""
    system, moved, three = models.declared, models.train.moved, (models.declared, models.refit, models.augmented)
    answer = replace(answer, effects=_with_possible_twins(answer.effects, outcome, system))
    rivals = _with_possible_twins(rivals, outcome, system)
    declared, refit, augmented = answer.figures
    refitted = {
        s.name: (float(system.values[s]), float(answer.refit.values[s]), float(answer.augmented.values[s]))
        for s in moved
    }
    training = (relative_error(three[0]), relative_error(three[1]), relative_error(three[2]))
    left, experiment = found["remainder"], found.get("separation")
    return Diagnosis(
        verdict=answer.verdict,
        statement=statement(case, answer, left, rivals, refitted, outcome, experiment, records, training),
        effects=answer.effects if answer.verdict == "effect" else (),
        declared=declared,
        refit=refit,
        augmented=augmented,
        training=training,
        refitted=refitted,
        findings=case.findings_in_words,
        rivals=rivals if answer.verdict == "ambiguous" else (),
        parameter_errors=answer.errors,
        at_limit=levels_at_zero(system, three[1:], models.train.levels),
        material=case.material,
        units={s.name: system.units.get(s, "1") for s in moved},
        **found,
    )


def _with_possible_twins(
    effects: Sequence[FoundEffect], outcome: Outcome | None, system: System
) -> tuple[FoundEffect, ...]:
    """The effects without the twins that fit the log only with values that they cannot have.

    A constant force above the friction level, for example, is an offset and no asymmetry of friction.
    """
    tried = () if outcome is None else outcome.first
    impossible = {(r.found.part.kind, r.found.part.on) for r in tried if not admissible(system, r.found)}
    return tuple(replace(e, also=tuple(place for place in e.also if place not in impossible)) for e in effects)


def _left_out(outcome: Outcome, answer: Answer) -> Fact:
    """The fact on the tied effects, if the answer names those that all tied models have in common."""
    parts = (outcome.parts[0], *(r.found.part for r in outcome.rivals))
    tied = " or ".join(dict.fromkeys(f"{p.kind} on {p.on}" for p in parts))
    if answer.errors:
        return Fact("declared value", f"{_kept(answer)}, {tied} would be named in addition")
    return Fact("unexplained", f"{tied} explains part of what is left; this log cannot tell which")


def _in_place(parts: Sequence[Part], answer: Answer) -> list[Fact]:
    """The fact on effects that would be named if wrong parameter values were kept as declared."""
    found = {(e.kind, e.on) for e in answer.effects}
    named = " and ".join(f"{p.kind} on {p.on}" for p in parts if (p.kind, p.on) not in found)
    if not named or not answer.errors:
        return []
    return [Fact("declared value", f"{_kept(answer)}, {named} would be named in place of a wrong value")]


def _kept(answer: Answer) -> str:
    return f"With {', '.join(e.name for e in answer.errors)} kept within three tolerances"


def _sought(
    search: Search, base: Fit, progress: Callable[[int, float], None], case: Case
) -> tuple[Search, Outcome, tuple[Part, ...]]:
    """Search, outcome of forward selection, and the effects that were replaced by wrong values of parameters.

    At constant speed parameters keep their limits, since inertia acts only on noise and ripple there.
    """
    outcome = find_effects(search, base, progress, case.faults)
    free = None if case.faults or case.steady else wrong_values.released(search, base, outcome)
    if free is not None:
        without_limits = find_effects(*free, progress, case.faults)
        if wrong_values.is_better(free[0], without_limits.final, search, outcome.final):
            return free[0], without_limits, outcome.parts
    return search, outcome, ()


@numerical("the fit of the model to the log")
def _refit(spec: Spec, search: Search, case: Case) -> tuple[Search, Fit]:
    """``within_reach``; raises BadInput with the preflight's problem if the refit cannot be computed."""
    try:
        return within_reach(search)
    except (ArithmeticError, RuntimeError, ValueError) as error:
        problems = [f.words for f in case.findings["train"] if f.severity == "problem"]
        if not problems or not is_numerical(error):
            raise
        raise BadInput(case.log.where, problems[0], "a log that fits the spec", code="LOG012") from error


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
    log, facts = case.log if case.test_log is None else case.test_log, list[Fact]()
    for i, x in enumerate(answer.adopted.positions):
        rows = case.test.used[:, i] & within
        found = half_of_squares(residual[:, i], rows)
        if found is None or rms(residual[rows, i]) < case.material * rms(acting[rows, i]):
            continue
        start, stop = (float(motion.time[k]) for k in found)
        about = np.abs(motion.time - 0.5 * (start + stop)) <= 0.5 * (stop - start) + 1 / motion.cutoff_hz
        if np.ptp(np.sign(motion.velocities[about, i])) > 0:
            continue
        where, when = f" on {x.name}" if residual.shape[1] > 1 else "", interval_in_words(start, stop, log)
        facts.append(
            Fact(
                "log",
                f"Half of the squared residual force on held-out data{where} lies within {stop - start:.2g} s, {when}. "
                "A push, or another event outside the inputs, may decide what these data refuse",
            )
        )
    return tuple(facts)


def _data(case: Case, problem: Problem, restart_s: float) -> dict[str, Any]:
    """Figures on the logs, for diagnosis.json."""
    log, test, system = case.log, case.test_log, problem.system
    h = case.motion.sample_time if test is None else test.sample_time
    return {
        "train": log.files,
        "test": f"{log.files}, its last {100 * HELD_OUT_SHARE:.0f} %" if test is None else test.files,
        "held_out_seconds": round((case.window.stop - case.window.start) * h, 3),
        "train_samples": len(problem.motion.time),
        "sample_time_s": case.motion.sample_time,
        "cutoff_hz": case.motion.cutoff_hz,
        "restart_s": restart_s,
        "coordinates": [
            {"name": x.name, "unit": unit, "force_unit": system.force_unit(i)}
            for i, (x, unit) in enumerate(zip(system.positions, system.position_units, strict=True))
        ],
        "blocks": BLOCKS,
    }


def _search_data(search: Search, outcome: Outcome) -> dict[str, Any]:
    """Figures on the record and on the fits, for diagnosis.json."""
    return {
        "segments": outcome.segments,
        "segment_s": round(search.record.length * search.record.sample_time, 6),
        "position_noise": [float(f"{v:.6g}") for v in search.record.noise],
        "alpha": ALPHA,
        "explained": round(outcome.explained, 4),
        "level_refit": round(noise_ratio(outcome.base), 3),
        "share_far": round(share_far(outcome.base), 4),
        "level_final": round(noise_ratio(outcome.final), 3),
    }
