"""Diagnosis of a log: which effect the model lacks, its errors before and after, and the augmented spec."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.diagnosis.answer import Answer
from codegen.diagnosis.augment import augmented_text
from codegen.diagnosis.conclusion import (
    TABLE_SIZE,
    as_effect,
    candidates,
    first_effect,
    is_small,
    rounds,
    sentence,
    verdict_of,
)
from codegen.diagnosis.credit import ALPHA, BLOCKS, NEAR_NOISE, noise_ratio, share_far
from codegen.diagnosis.examination import examine
from codegen.diagnosis.fixed_values import explaining_values
from codegen.diagnosis.force_led import credited_by_force
from codegen.diagnosis.forward_selection import Outcome, common_effects, find_effects, within_reach
from codegen.diagnosis.harmonics import with_harmonics
from codegen.diagnosis.input_timing import acting_between_rows, measured_inputs
from codegen.diagnosis.measure import RESTART_S, Window, force_errors, measure, restart_within_reach
from codegen.diagnosis.moved_values import moved_values
from codegen.diagnosis.output_error import Fit, levels_at_zero
from codegen.diagnosis.proposal import propose_terms, refuse_without_pysindy
from codegen.diagnosis.record import position_noise, record_of
from codegen.diagnosis.released import equal_parameter, is_better, released
from codegen.diagnosis.reliability import reliability_of
from codegen.diagnosis.replay import compare_residuals
from codegen.diagnosis.residual import Problem
from codegen.diagnosis.residual_regression import remainders
from codegen.diagnosis.results import MATERIAL, Diagnosis, ErrorFigures, FoundEffect, Remainder, Round
from codegen.diagnosis.search import Search, search_on
from codegen.diagnosis.separation import separate, tied_fits
from codegen.diagnosis.signals import SHORTEST_TEST_S, Motion, smooth_motion
from codegen.diagnosis.steady_runs import (
    SteadySearch,
    answer_of,
    candidate_of,
    effects_of,
    figures_of,
    is_static,
    means_of,
    remainders_of,
)
from codegen.diagnosis.trial import Part
from codegen.diagnosis.unlisted import effects_in_no_round
from codegen.effects.declare import add_declared_effects
from codegen.logs import Finding, Log, excerpt, preflight
from codegen.mechanics import build_system
from codegen.mechanics.link_parameters import link_parameters
from codegen.mechanics.system import System
from codegen.simulate.simulable import is_simulable
from codegen.spec.kinematics import KinematicTree
from codegen.spec.model import Spec
from codegen.spec.numerics import is_numerical, numerical

HELD_OUT_SHARE = 0.3
HELD_OUT_EVERY = 3
"""Of records at steady speed, every third one is held out: their order is by speed, not by time."""
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Models:
    """The three models that are compared, and their data.

    Attributes:
        declared, refit, augmented: the systems.
        train, test: problems; on the same motion when one log serves for both.
        window: the held-out part of ``test``.
        spec_text: the augmented spec.
        excitation: text of the file with the discriminating motion; None where there is none.
        restart_s: between restarts of free-run simulations on ``test``.
        named: effects of the augmented model.
    """

    declared: System
    refit: System
    augmented: System
    train: Problem
    test: Problem
    window: Window
    spec_text: str
    excitation: str | None = None
    restart_s: float = RESTART_S
    named: tuple[FoundEffect, ...] = ()


@numerical("the fit of the model to the log")
def diagnose_log(
    spec: Spec,
    system: System,
    log: Log,
    test_log: Log | None = None,
    progress: Progress | None = None,
    propose: bool = False,
    material: float = MATERIAL,
) -> tuple[Diagnosis, Models]:
    """Diagnose one log.

    Args:
        system: of the spec, with its declared effects.
        log: to train on; without ``test_log`` its last 30 % is held out.
        progress: called with (station, share done).
        propose: whether to propose terms for an unknown residual.
        material: share of the RMS of the drive force from which on a force matters.

    Raises:
        BadInput: if a log is too short or moves too little to say anything; for a proposal without PySINDy.
    """
    if propose:
        refuse_without_pysindy()
    report_progress = progress or (lambda station, share: None)
    report_progress("preflight", 0.0)
    system, deviations = _uncertain(spec, system, log)
    log, cut = excerpt(log)
    findings = {"train": (*cut, *preflight(log, spec), *_steady_laws(system))}
    if test_log is not None:
        test_log, cut = excerpt(test_log)
        findings["test"] = (*cut, *preflight(test_log, spec))
    motion = smooth_motion(log)
    split = len(motion.time) if test_log is not None else round(len(motion.time) * (1 - HELD_OUT_SHARE))
    training = _restrict(motion, 0, split)
    measured = measured_inputs(Problem(system, training, deviations), log)
    if measured:
        findings["train"] += tuple(measured.values())
        log = acting_between_rows(log, measured)
        test_log = None if test_log is None else acting_between_rows(test_log, measured)
        motion = smooth_motion(log)
        training = _restrict(motion, 0, split)
    other = motion if test_log is None else smooth_motion(test_log, motion.cutoff_hz, SHORTEST_TEST_S)
    window = Window(0, len(other.time)) if test_log is not None else Window(split, len(motion.time))

    problem = Problem(system, training, deviations)
    faults = any(f.severity == "problem" for f in findings["train"])
    means = means_of(log) if is_static(system) and not faults else None
    if means is not None:
        report_progress("means of steady records", 0.2)
        whole = Problem(system, motion, deviations)
        there = Problem(system, other, {})
        data = _data(log, test_log, motion, window, whole)
        return _of_steady_records(
            spec, SteadySearch(whole, means, position_noise(motion, log)), test_log, there, data, findings, material
        )
    search = search_on(problem, lambda share: record_of(training, log, share))
    report_progress("refit", 0.05)
    search, base = _refit(search, log, findings["train"])
    search, outcome, in_place = _sought(search, base, partial(_effect_progress, report_progress), faults)
    outcome, final_search = with_harmonics(search, outcome, problem) if not faults else (outcome, search)
    report_progress("values and held-out error", 0.78)
    test_problem = Problem(system, other, {})
    restart = restart_within_reach(system, other, window)

    def examined(last: Search, found: Outcome) -> tuple[Answer, Outcome]:
        kind = verdict_of(found, faults)
        held_out = partial(measure, motion=other, used=test_problem.masks, window=window, restart_s=restart)
        return examine(replace(search, within=last.within), last, found, problem, kind, held_out)

    def left_by(found: Answer) -> tuple[Remainder, ...]:
        return remainders(found.adopted or found.refit, training, problem.masks)

    answer, outcome = examined(final_search, outcome)
    credited = answer.verdict in ("effect", "ambiguous")
    far = noise_ratio(outcome.final if credited else base) > NEAR_NOISE
    if answer.verdict != "none" and far and not faults:
        held_out = partial(measure, motion=other, used=test_problem.masks, window=window, restart_s=restart)
        report_force = partial(_force_progress, report_progress)
        answer, outcome = credited_by_force(search, outcome, problem, answer, held_out, report_force)
    tied, experiment, excitation = [], None, None
    if answer.verdict == "ambiguous":
        report_progress("experiment that separates", 0.85)
        tied = tied_fits(search, outcome)
        experiment, excitation = separate(
            search, outcome, tied, log, spec.envelope, partial(_separation_progress, report_progress)
        )
        common = common_effects(final_search, outcome)
        other_answer, other_outcome = (answer, outcome) if common is None else examined(*common)
        if other_answer.verdict == "effect" and is_small(left_by(other_answer), material):
            told = (*other_answer.remarks, _left_out(outcome, other_answer))
            answer, outcome = replace(other_answer, remarks=told), other_outcome
    verdict, refit, augmented = answer.verdict, answer.refit, answer.augmented
    left = left_by(answer)
    if verdict == "unknown" and is_small(left, material):
        verdict, answer = "none", replace(answer, verdict="none")
    elif verdict == "none" and any(r.is_changing(material) for r in left):
        verdict, answer = "unknown", replace(answer, verdict="unknown")
    if verdict == "unknown":
        answer = replace(answer, remarks=(*answer.remarks, *explaining_values(spec, refit, problem)))
    report_progress("tracking observer", 0.93)
    agreement = compare_residuals(spec, system, training)

    moved = [*problem.levels, *problem.uncertain]
    values = {s.name: (float(system.values[s]), float(refit.values[s]), float(augmented.values[s])) for s in moved}
    at_zero = levels_at_zero(system, (refit, augmented), problem.levels)
    words = (f"the fit reduces the friction level {name} to zero, its lowest value" for name in at_zero)
    answer = replace(answer, remarks=(*answer.remarks, *words, *_in_place(in_place, answer)))
    same = equal_parameter(search, base, outcome) if verdict == "effect" and not answer.errors else ""
    answer = replace(answer, remarks=(*answer.remarks, *([same] if same else [])))
    fit = outcome.final if verdict == "effect" else base
    answer = replace(answer, remarks=(*answer.remarks, *moved_values(answer, fit, problem, material)))
    adopted = {} if answer.adopted is None else {s.name: float(answer.adopted.values[s]) for s in moved}
    text = augmented_text(spec, answer.effects if verdict == "effect" else [], adopted, system)
    rivals = [as_effect(r, refit) for r in outcome.rivals]
    rivals[: len(tied[1:])] = [first_effect(fit, refit) for fit in tied[1:]]
    diagnosis = Diagnosis(
        verdict=verdict,
        sentence=sentence(system, answer, rivals, findings["train"], outcome, left, material, experiment),
        effects=answer.effects if verdict == "effect" else (),
        candidates=candidates(outcome, system, verdict),
        declared=answer.figures[0],
        refit=answer.figures[1],
        augmented=answer.figures[2],
        training=_training(problem, (system, refit, augmented)),
        refitted=values,
        data=_data(log, test_log, motion, window, problem, restart) | _search_data(search, outcome),
        agreement=agreement,
        findings={name: tuple(_words(f) for f in some) for name, some in findings.items()},
        certificate=None,
        later_rounds=rounds(outcome),
        standing=effects_in_no_round(final_search, outcome),
        rivals=tuple(rivals) if verdict == "ambiguous" else (),
        separation=experiment,
        parameter_errors=answer.errors,
        remarks=answer.remarks,
        at_limit=at_zero,
        remainder=left,
        material=material,
        units=_units_of(system, values),
        reliability=reliability_of(verdict, noise_ratio(outcome.final) <= NEAR_NOISE),
        proposal=propose_terms(refit, problem, test_problem, window) if propose and verdict == "unknown" else None,
    )
    report_progress("done", 1.0)
    return diagnosis, Models(
        system, refit, augmented, problem, test_problem, window, text, excitation, restart, answer.effects
    )


def _of_steady_records(
    spec: Spec,
    steady: SteadySearch,
    test_log: Log | None,
    there: Problem,
    data: dict[str, Any],
    findings: Mapping[str, Sequence[Finding]],
    material: float,
) -> tuple[Diagnosis, Models]:
    """The diagnosis of records at one steady speed each, by their means.

    Args:
        there: the declared system on the motion on which free runs are measured.
    """
    system, held, count = steady.system, None, len(steady.means)
    if test_log is not None:
        held = means_of(test_log)
    else:
        apart = np.arange(count) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        held, steady = steady.means.of(apart), replace(steady, means=steady.means.of(~apart))
        data |= {"test": f"{data['train']}, one record in {HELD_OUT_EVERY}"}
    window = Window(0, len(there.motion.time))

    def measured(model: System) -> ErrorFigures:
        plain = measure(model, there.motion, there.masks, window)
        return plain if held is None else figures_of(model, held, plain)

    answer, found = answer_of(steady, measured, by_means=held is not None)
    left = remainders_of(answer.adopted or answer.refit, steady.means)
    if answer.verdict == "none" and any(r.nature(material) == "structured" for r in left):
        answer = replace(answer, verdict="unknown")
    named = [(parts, [candidate_of(a, system) for a in tried]) for parts, tried in found.rounds]
    rivals = tuple(effects_of(a.fit, answer.refit)[0] for a in found.rivals) if answer.verdict == "ambiguous" else ()
    moved = {
        s.name: (float(system.values[s]), float(answer.refit.values[s]), float(answer.augmented.values[s]))
        for s in steady.moved
    }
    effects = answer.effects if answer.verdict == "effect" else ()
    adopted = {name: value for name, (_, _, value) in moved.items()}
    train = Problem(system, steady.problem.motion, steady.problem.deviation)
    three = (system, answer.refit, answer.augmented)
    training = tuple(figures_of(model, steady.means, answer.figures[0]).relative_force for model in three)
    diagnosis = Diagnosis(
        verdict=answer.verdict,
        sentence=sentence(system, answer, rivals, findings["train"], None, left, material, records=len(steady.means)),
        effects=effects,
        candidates=tuple(named[0][1][:TABLE_SIZE]),
        declared=answer.figures[0],
        refit=answer.figures[1],
        augmented=answer.figures[2],
        training=(training[0], training[1], training[2]),
        refitted=moved,
        data=data | {"segments": len(steady.means), "alpha": ALPHA},
        agreement=None,
        findings={name: tuple(_words(f) for f in some) for name, some in findings.items()},
        certificate=None,
        later_rounds=tuple(
            Round(tuple((p.kind, p.on) for p in parts), tuple(tried[:TABLE_SIZE])) for parts, tried in named[1:]
        ),
        rivals=rivals,
        remarks=answer.remarks,
        at_limit=levels_at_zero(system, (answer.refit, answer.augmented), steady.problem.levels),
        remainder=left,
        material=material,
        units=_units_of(system, moved),
    )
    text = augmented_text(spec, list(effects), adopted, system)
    return diagnosis, Models(*three, train, there, window, text, named=answer.effects)


def _units_of(system: System, names: Iterable[str]) -> dict[str, str]:
    units = {s.name: unit for s, unit in system.units.items()}
    return {name: units.get(name, "1") for name in names}


def _left_out(outcome: Outcome, answer: Answer) -> str:
    """What is told of the effects that tie, where the answer names those that all tied models have in common."""
    parts = (outcome.parts[0], *(r.found.part for r in outcome.rivals))
    tied = " or ".join(dict.fromkeys(f"{p.kind} on {p.on}" for p in parts))
    if answer.errors:
        errors = ", ".join(e.name for e in answer.errors)
        return f"with {errors} kept within three tolerances, {tied} would be named in addition"
    return f"in addition {tied} explains part of what is left; this log does not tell which"


def _in_place(parts: Sequence[Part], answer: Answer) -> tuple[str, ...]:
    """Which effects the log would name if the parameters that are wrong were kept near their declared values.

    Without those that it names in any case.
    """
    found = {(e.kind, e.on) for e in answer.effects}
    named = " and ".join(f"{p.kind} on {p.on}" for p in parts if (p.kind, p.on) not in found)
    if not named or not answer.errors:
        return ()
    errors = ", ".join(e.name for e in answer.errors)
    return (f"with {errors} kept within three tolerances, {named} would be named in place of the parameter error",)


def _sought(
    search: Search, base: Fit, progress: Callable[[int, float], None], faults: bool
) -> tuple[Search, Outcome, tuple[Part, ...]]:
    """Forward selection, with toleranced parameters free where that explains the log better.

    Args:
        faults: log and spec do not fit together, and no effect is tried.

    Returns:
        The search, its outcome, and the effects in whose place parameters were found wrong.
    """
    outcome = find_effects(search, base, progress, faults)
    free = None if faults else released(search, base, outcome)
    if free is not None:
        without_limits = find_effects(*free, progress, faults)
        if is_better(free[0], without_limits.final, search, outcome.final):
            return free[0], without_limits, outcome.parts
    return search, outcome, ()


def _effect_progress(report_progress: Progress, turn: int, share: float) -> None:
    report_progress(f"effect {turn + 1}", 0.1 + 0.25 * (turn + share))


def _force_progress(report_progress: Progress, share: float) -> None:
    report_progress("effects by the force residual", 0.8 + 0.05 * share)


def _separation_progress(report_progress: Progress, what: str, share: float) -> None:
    report_progress(f"experiment that separates: {what}", 0.85 + 0.08 * share)


def _refit(search: Search, log: Log, findings: Sequence[Finding]) -> tuple[Search, Fit]:
    """``within_reach``; where log and spec fit so little that it cannot be computed, what the preflight says."""
    try:
        return within_reach(search)
    except (ArithmeticError, RuntimeError, ValueError) as error:
        problems = [f.words for f in findings if f.severity == "problem"]
        if not problems or not is_numerical(error):
            raise
        raise BadInput(log.where, problems[0], "a log that fits the spec", code="LOG012") from error


def _uncertain(spec: Spec, system: System, log: Log) -> tuple[System, Mapping[sympy.Symbol, float]]:
    """The system with all uncertain quantities as parameters, and their standard deviations in SI."""
    own = {spec.symbol(p.name): p.tolerance if p.tolerance is not None else log.tolerance for p in spec.parameters}
    deviations = {s: share * abs(float(system.values[s])) for s, share in own.items() if share}
    if isinstance(spec.form, KinematicTree) and spec.form.tolerance is not None:
        links = link_parameters(spec, spec.form)
        system = add_declared_effects(build_system(spec, links), spec)
        deviations |= {spec.symbol(p.name): p.deviation for p in links}
    return system, deviations


def _restrict(motion: Motion, start: int, stop: int) -> Motion:
    """The part of a motion that is used for training."""
    cut = {
        name: getattr(motion, name)[start:stop]
        for name in ("time", "positions", "velocities", "accelerations", "inputs", "commands", "usable", "measured")
    }
    if motion.counted is not None:
        cut["counted"] = motion.counted[start:stop]
    if stop < len(motion.time):
        cut["usable"] = cut["usable"].copy()
        cut["usable"][-round(1 / (motion.cutoff_hz * motion.sample_time)) :] = False
    return replace(motion, **cut)


def _steady_laws(system: System) -> tuple[Finding, ...]:
    """Warnings for contacts whose law cannot be simulated and is replaced by its steady-sliding level."""
    words = "its steady-sliding level is used instead, in the force residual and in free-run simulation"
    return tuple(
        Finding("warning", "law", f"the law {c.law.name} at {c.name} is not simulated: {words}")
        for c in system.contacts
        if not is_simulable(c)
    )


def _training(problem: Problem, models: tuple[System, System, System]) -> tuple[float, float, float]:
    window = Window(0, len(problem.motion.time))
    declared, refit, augmented = (force_errors(s, problem.motion, problem.masks, window)[2] for s in models)
    return declared, refit, augmented


def _data(
    log: Log, test: Log | None, motion: Motion, window: Window, problem: Problem, restart_s: float = RESTART_S
) -> dict[str, Any]:
    h = motion.sample_time
    return {
        "train": log.files,
        "test": test.files if test is not None else f"{log.files}, its last {100 * HELD_OUT_SHARE:.0f} %",
        "held_out_seconds": round((window.stop - window.start) * (test.sample_time if test is not None else h), 3),
        "train_samples": len(problem.motion.time),
        "sample_time_s": h,
        "cutoff_hz": motion.cutoff_hz,
        "restart_s": restart_s,
        "coordinates": [
            {"name": x.name, "unit": unit, "force_unit": problem.system.force_unit(i)}
            for i, (x, unit) in enumerate(zip(problem.system.positions, problem.system.position_units, strict=True))
        ],
        "blocks": BLOCKS,
    }


def _search_data(search: Search, outcome: Outcome) -> dict[str, Any]:
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


def _words(finding: Finding) -> str:
    return f"{finding.severity}: {finding.words}"
