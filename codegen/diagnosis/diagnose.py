"""Diagnosis of a log: the effects that the model lacks, its errors before and after, and the augmented spec.

    log → case → search → answer → diagnosis

The preflight and two filters prepare the case. A search fits effects to it by free-run simulation; for records at one
steady speed each, by the means of the records. The answer has the effects that held-out data and the force residual do
not refuse.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from codegen.base.errors import BadInput
from codegen.base.parallel import in_another_process
from codegen.base.progress import steps_to
from codegen.diagnosis.case import HELD_OUT_SHARE, Case, Findings, case_of, few_stretches
from codegen.diagnosis.fit.acceptance import ALPHA, is_far, noise_ratio, share_far
from codegen.diagnosis.fit.measure import RESTART_S, driving_force_name, force_errors, measure
from codegen.diagnosis.fit.output_error import BLOCKS, levels_at_zero
from codegen.diagnosis.fit.record import TooFewStretches, is_shortened, position_noise, record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.free_runs import SelectionChecks, select
from codegen.diagnosis.reliability import reliability_of
from codegen.diagnosis.results import MATERIAL, Diagnosis, ErrorFigures, FoundEffect
from codegen.diagnosis.selection.candidate_fits import start_compiling
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.refusals import admissible
from codegen.diagnosis.steady import (
    Means,
    SteadySearch,
    answer_of,
    by_force_alone,
    effects_of,
    figures_of,
    is_static,
    means_of,
    remainders_of,
    with_mean_inputs,
)
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.augment import augmented_text
from codegen.diagnosis.verdict.proposal import propose_terms, refuse_without_pysindy
from codegen.diagnosis.verdict.replay import compare_residuals
from codegen.diagnosis.verdict.statement import statement
from codegen.diagnosis.verdict.table import candidates, in_no_round, rivals_of, rounds
from codegen.logs import Log
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

HELD_OUT_EVERY = 3
"""Every third record at steady speed is held out, since records are ordered by speed and not by time."""
Progress = Callable[[str, float], None]
"""Called with (name of the step, share done of the diagnosis)."""


@dataclass(frozen=True, eq=False)
class Models:
    """The three compared models, and the data for training and test, which may be of the same motion.

    Attributes:
        declared: the model with the values of the spec.
        refit: the same model with refitted values.
        augmented: the refit with the effects that were found.
        train, test: the equation-of-motion problems of the training log and of the log with the held-out data.
        window: the held-out part of ``test``.
        spec_text: text of the augmented spec.
        named: the effects in ``augmented``, also where the verdict adds none of them to the spec.
        restart_s: seconds between restarts of free-run simulations in the window.
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
    on_findings: Callable[[Findings], None] = lambda found: None,
) -> tuple[Diagnosis, Models]:
    """Diagnose one log.

    Args:
        log: to train on; without ``test_log`` its last 30 % is held out.
        progress: called as each step begins.
        propose: whether terms are proposed for an unknown verdict (``verdict/proposal.py``).
        material: share of the RMS of the drive force from which on a force matters.
        on_findings: called with what the preflight found, before anything is fitted.

    Returns:
        The diagnosis, and the models that it compares, for the report.

    Raises:
        BadInput: if a log is too short or has too little motion; for a proposal without PySINDy.
    """
    if propose:
        refuse_without_pysindy()
    report = progress or (lambda step, share: None)
    with steps_to(progress):
        case = case_of(spec, system, log, test_log, material)
    means = means_of(case.log) if is_static(case.problem.system) and not case.faults else None
    if means is not None:
        on_findings(case.findings_in_words)
        report("means of steady records", 0.2)
        return _by_means(case, means)
    search = _search_of(case)  # refuses a log that is too short, before its findings are told
    if not case.faults:  # with a fault, no effect is tried
        start_compiling(search)
    on_findings(case.findings_in_words)
    return _by_free_runs(case, search, report, propose, on_findings)


def _search_of(case: Case) -> Search:
    """The search by free runs. Raises BadInput if the log has too few stretches in motion."""
    try:
        search = search_on(case.problem, lambda share: record_of(case.problem.motion, case.log, share, case.events))
    except BadInput as error:
        if case.unfit is not None:  # the preflight's fault may be the reason for too few stretches
            raise case.unfit from error
        if not isinstance(error, TooFewStretches):
            raise
        raise few_stretches(case, error) from error
    if not case.faults and not case.problem.used.any():
        found = "no motion long enough away from standstill, so that the residual force shows no friction in slip"
        raise BadInput(case.log.where, found, "a record with larger inputs or fewer pauses", code="LOG009")
    return search


def _by_free_runs(
    case: Case, search: Search, report: Progress, propose: bool, on_findings: Callable[[Findings], None]
) -> tuple[Diagnosis, Models]:
    """The diagnosis by free-run simulation and force residual."""
    # The reliability was counted on logs with segments of full length. A later search may be on shorter ones.
    uncounted = not case.log.joints and is_shortened(search.record, case.problem.motion)
    selection = select(case, search, report, on_findings)
    case, problem = selection.case, selection.case.problem
    agreement = in_another_process(compare_residuals, case.spec, problem.system, problem.motion)
    report("values and held-out error", 0.78)
    checks = SelectionChecks(selection)
    found = checks.conclude(report)
    answer, outcome = found.answer, found.outcome

    report("tracking observer", 0.93)
    unknown = propose and answer.verdict == "unknown"
    models = _models(case, problem, answer, case.window, checks.restart_s, found.excitation)
    diagnosis = _diagnosis(
        case,
        answer,
        models,
        rivals_of(outcome, found.tied, answer.refit),
        lambda model: force_errors(model, problem.motion, problem.used)[2],
        outcome,
        remainder=found.left,
        data=_data(case, problem, checks.restart_s) | _search_data(selection.search, outcome),
        separation=found.separation,
        candidates=candidates(outcome, problem.system, answer.verdict),
        agreement=agreement(),
        later_rounds=rounds(outcome),
        in_no_round=in_no_round(selection.last, outcome),
        reliability=None if uncounted else reliability_of(answer.verdict, not is_far(outcome.final)),
        proposal=propose_terms(answer.refit, problem, case.test, case.window) if unknown else None,
    )
    return diagnosis, models


def _by_means(case: Case, means: Means) -> tuple[Diagnosis, Models]:
    """The diagnosis of records at one steady speed each, by their means."""
    problem, count = replace(case.problem, motion=case.motion), len(means)
    data = _data(case, problem, RESTART_S)
    if case.test_log is not None:
        held = means_of(case.test_log)
    else:
        apart = np.arange(count) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        held, means = means.of(apart), means.of(~apart)
        data |= {"test": f"{data['train']}, one record in {HELD_OUT_EVERY}"}
    window = slice(0, len(case.test.motion.time))
    test = case.test.motion
    if held is not None:
        test = with_mean_inputs(test, case.test_log or case.log)
        data |= {"simulated_by": "the mean inputs of each record"}

    def measured(model: System) -> ErrorFigures:
        plain = measure(model, test, case.test.used, window)
        return plain if held is None else figures_of(model, held, plain)

    steady = SteadySearch(problem, means, position_noise(case.motion, case.log))
    by_force = (lambda model: by_force_alone(measured(model))) if held is not None else measured
    answer, found = answer_of(steady, measured, by_force)
    left = remainders_of(answer.adopted or answer.refit, means)
    if answer.verdict == "none" and any(r.nature(case.material) == "structured" for r in left):
        answer = replace(answer, verdict="unknown")
    first, *later = found.rounds
    models = _models(case, problem, answer, window)
    diagnosis = _diagnosis(
        case,
        answer,
        models,
        [effects_of(one.fit, answer.refit)[0] for one in found.rivals],
        lambda model: figures_of(model, means, answer.figures[0]).relative_force,
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
    values = {} if written is None else {s.name: float(written.values[s]) for s in train.refitted_symbols}
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
    system, symbols = models.declared, models.train.refitted_symbols
    three = models.declared, models.refit, models.augmented
    answer = replace(answer, effects=_with_possible_twins(answer.effects, outcome, system))
    rivals = _with_possible_twins(rivals, outcome, system)
    declared, refit, augmented = answer.figures
    refitted = {
        s.name: (float(system.values[s]), float(answer.refit.values[s]), float(answer.augmented.values[s]))
        for s in symbols
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
        tied=(*answer.effects[:1], *rivals) if answer.verdict == "ambiguous" else (),
        parameter_errors=answer.errors,
        at_limit=levels_at_zero(system, three[1:], models.train.levels),
        material=case.material,
        units={s.name: system.units.get(s, "1") for s in symbols},
        **found,
    )


def _with_possible_twins(
    effects: Sequence[FoundEffect], outcome: Outcome | None, system: System
) -> tuple[FoundEffect, ...]:
    """The effects without the twins that fit the log only with values that they cannot have.

    A constant force above the friction level, for example, is an offset and no asymmetry of friction.
    """
    tried = () if outcome is None else outcome.first
    impossible = {r.part.key for r in tried if not admissible(system, r.found)}
    return tuple(replace(e, also=tuple(place for place in e.also if place not in impossible)) for e in effects)


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
        "forces_compared_with": driving_force_name(system),
        "coordinates": [
            {"name": x.name, "unit": unit, "force_unit": system.force_unit(i)}
            for i, (x, unit) in enumerate(zip(system.positions, system.position_units, strict=True))
        ],
        "blocks": BLOCKS,
    }


def _search_data(search: Search, outcome: Outcome) -> dict[str, Any]:
    """Figures on the record and on the fits, for diagnosis.json."""
    return {
        "segments": len(search.record.start),
        "segment_s": round(search.record.length * search.record.sample_time, 6),
        "position_noise": [float(f"{v:.6g}") for v in search.record.noise],
        "alpha": ALPHA,
        "explained": round(outcome.explained, 4),
        "level_refit": round(noise_ratio(outcome.base), 3),
        "share_far": round(share_far(outcome.base), 4),
        "level_final": round(noise_ratio(outcome.final), 3),
    }
