"""Log × Spec → Diagnosis: which effect the model lacks, the error before and after, and the augmented spec."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import sympy

from codegen.diagnosis.augment import augmented_text
from codegen.diagnosis.conclusion import as_effect, candidates, force_agrees, named_effects, sentence, verdict_of
from codegen.diagnosis.credit import ALPHA, BLOCKS, level, share_far
from codegen.diagnosis.estimate import Estimate, estimate
from codegen.diagnosis.harmonics import with_harmonics
from codegen.diagnosis.measure import RESTART_S, Window, force_errors, measure
from codegen.diagnosis.models import with_effects, with_values
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.proposal import propose_terms, refuse_without_pysindy
from codegen.diagnosis.record import record_of
from codegen.diagnosis.replay import compare_residuals
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.rounds import Outcome, find_effects
from codegen.diagnosis.search import Search, search_on
from codegen.diagnosis.separation import separate
from codegen.diagnosis.signals import Motion, smooth_motion
from codegen.logs import Finding, Log, excerpt, preflight
from codegen.mechanics.system import System
from codegen.simulate.simulable import is_simulable
from codegen.spec.model import Spec

HELD_OUT_SHARE = 0.3

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Models:
    """The three models that are compared, and what they were found on.

    Attributes:
        declared, refit, augmented: the systems.
        train, test: motions; the same object when one log serves for both.
        window: the held-out part of ``test``.
        spec_text: the augmented spec.
        excitation: text of the file of a motion that tells candidates apart; None where there is none.
    """

    declared: System
    refit: System
    augmented: System
    train: Problem
    test: Problem
    window: Window
    spec_text: str
    excitation: str | None = None


def diagnose_log(
    spec: Spec,
    system: System,
    log: Log,
    test_log: Log | None = None,
    progress: Progress | None = None,
    propose: bool = False,
) -> tuple[Diagnosis, Models]:
    """Diagnose one log.

    Args:
        system: of the spec, with its declared effects.
        log: to train on; without ``test_log`` its last 30 % is held out.
        progress: told (station, share done).
        propose: whether to propose terms for an unknown residual.

    Raises:
        BadInput: if a log is too short or moves too little to say anything; for a proposal without PySINDy.
    """
    if propose:
        refuse_without_pysindy()
    tell = progress or (lambda station, share: None)
    tell("preflight", 0.0)
    log, cut = excerpt(log)
    findings = {"train": (*cut, *preflight(log, spec), *_steady_laws(system))}
    if test_log is not None:
        test_log, cut = excerpt(test_log)
        findings["test"] = (*cut, *preflight(test_log, spec))
    motion = smooth_motion(log)
    split = len(motion.time) if test_log is not None else round(len(motion.time) * (1 - HELD_OUT_SHARE))
    training = _restrict(motion, 0, split)
    other = smooth_motion(test_log, motion.cutoff_hz) if test_log is not None else motion
    window = Window(0, len(other.time)) if test_log is not None else Window(split, len(motion.time))
    tolerance = _tolerances(spec, log)

    tell("refit", 0.05)
    problem = Problem(system, training, tolerance)
    search = search_on(problem, lambda share: record_of(training, log, share))
    faults = any(f.severity == "problem" for f in findings["train"])
    outcome = find_effects(search, lambda k, share: tell(f"effect {k + 1}", 0.1 + 0.25 * (k + share)), faults)
    outcome, standing = with_harmonics(search, outcome, problem) if not faults else (outcome, search)
    before = estimate(outcome.base)
    refit = with_values(system, _values(before))
    verdict = verdict_of(outcome, faults)
    after = estimate(*standing.polished(outcome.final)) if outcome.parts else before
    named = named_effects(outcome.parts, after, refit)
    augmented = with_values(with_effects(system, named), _values(after)) if named else refit
    if verdict == "effect" and not force_agrees(problem, refit, augmented):
        verdict = "unknown"
    if verdict == "unknown":
        augmented = refit
    told, excitation = None, None
    if verdict == "ambiguous":
        tell("motion that separates", 0.8)
        told, excitation = separate(search, outcome, log, spec.envelope)
    tell("held-out error", 0.85)
    judge = Problem(system, other, {})
    figures = [measure(s, other, judge.masks, window) for s in (system, refit, augmented)]
    tell("tracking observer", 0.93)
    agreement = compare_residuals(spec, system, training)

    moved = [*problem.levels, *problem.uncertain]
    values = {s.name: (float(system.values[s]), float(refit.values[s]), float(augmented.values[s])) for s in moved}
    adopted = {name: after if verdict == "effect" else before for name, (_, before, after) in values.items()}
    adopted = {} if verdict == "unfit" else adopted
    text = augmented_text(spec, named if verdict == "effect" else [], adopted, system)
    rivals = [as_effect(r, refit) for r in outcome.rivals]
    diagnosis = Diagnosis(
        verdict=verdict,
        sentence=sentence(system, verdict, named, rivals, figures, findings["train"], outcome),
        effects=tuple(named) if verdict == "effect" else (),
        candidates=candidates(outcome, system, verdict),
        declared=figures[0],
        refit=figures[1],
        augmented=figures[2],
        training=_training(problem, (system, refit, augmented)),
        refitted=values,
        data=_data(log, test_log, motion, window, problem) | _search_data(search, outcome),
        agreement=agreement,
        findings={name: tuple(_words(f) for f in some) for name, some in findings.items()},
        certificate=None,
        separation=told,
        proposal=propose_terms(refit, problem, judge, window) if propose and verdict == "unknown" else None,
    )
    tell("done", 1.0)
    return diagnosis, Models(system, refit, augmented, problem, judge, window, text, excitation)


def _values(found: Estimate) -> dict[str, float]:
    return {name: value for name, (value, _) in found.moved.items()}


def _tolerances(spec: Spec, log: Log) -> Mapping[sympy.Symbol, float]:
    own = {spec.symbol(p.name): p.tolerance if p.tolerance is not None else log.tolerance for p in spec.parameters}
    return {s: share for s, share in own.items() if share}


def _restrict(motion: Motion, start: int, stop: int) -> Motion:
    """The part of a motion that may be trained on."""
    cut = {
        name: getattr(motion, name)[start:stop]
        for name in ("time", "positions", "velocities", "accelerations", "inputs", "commands", "usable", "measured")
    }
    if stop < len(motion.time):
        cut["usable"] = cut["usable"].copy()
        cut["usable"][-round(1 / (motion.cutoff_hz * motion.sample_time)) :] = False
    return replace(motion, **cut)


def _steady_laws(system: System) -> tuple[Finding, ...]:
    """What residual and free run cannot tell of a contact whose law they take by its level of steady sliding."""
    words = "its level of steady sliding stands for it, in the residual and in the free run"
    return tuple(
        Finding("warning", "law", f"the law {c.law.name} at {c.name} is not simulated: {words}")
        for c in system.contacts
        if not is_simulable(c)
    )


def _training(problem: Problem, models: tuple[System, System, System]) -> tuple[float, float, float]:
    window = Window(0, len(problem.motion.time))
    declared, refit, augmented = (force_errors(s, problem.motion, problem.masks, window)[2] for s in models)
    return declared, refit, augmented


def _data(log: Log, test: Log | None, motion: Motion, window: Window, problem: Problem) -> dict[str, Any]:
    h = motion.sample_time
    return {
        "train": log.path.name,
        "test": test.path.name if test is not None else f"{log.path.name}, its last {100 * HELD_OUT_SHARE:.0f} %",
        "held_out_seconds": round((window.stop - window.start) * (test.sample_time if test is not None else h), 3),
        "train_samples": len(problem.motion.time),
        "sample_time_s": h,
        "cutoff_hz": motion.cutoff_hz,
        "restart_s": RESTART_S,
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
        "level_refit": round(level(outcome.base), 3),
        "share_far": round(share_far(outcome.base), 4),
        "level_final": round(level(outcome.final), 3),
    }


def _words(finding: Finding) -> str:
    return f"{finding.severity}: {finding.words}"
