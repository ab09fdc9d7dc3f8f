"""Log × Spec → Diagnosis: which effect the model lacks, the error before and after, and the augmented spec."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy

from codegen.diagnosis.augment import augmented_text
from codegen.diagnosis.candidates import Fit, all_places, fit_effect
from codegen.diagnosis.measure import Window, force_errors, free_run_errors, measure
from codegen.diagnosis.models import with_effect, with_effects, with_values
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.replay import compare_residuals
from codegen.diagnosis.results import Diagnosis, ErrorFigures, FoundEffect, Verdict
from codegen.diagnosis.selection import Ranked, rank, rivals
from codegen.diagnosis.signals import Motion, smooth_motion
from codegen.effects.declare import unit_words
from codegen.errors import BadInput
from codegen.logs import Finding, Log, preflight
from codegen.mechanics.system import System
from codegen.simulate.simulable import is_simulable
from codegen.spec.model import Spec
from codegen.text import render

MOST_EFFECTS = 3
HELD_OUT_SHARE = 0.3
TABLE_SIZE = 12

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Models:
    """The three models that are compared, and what they were found on.

    Attributes:
        declared, refit, augmented: the systems.
        train, test: motions; the same object when one log serves for both.
        window: the held-out part of ``test``.
        spec_text: the augmented spec.
    """

    declared: System
    refit: System
    augmented: System
    train: Problem
    test: Problem
    window: Window
    spec_text: str


def diagnose_log(
    spec: Spec, system: System, log: Log, test_log: Log | None = None, progress: Progress | None = None
) -> tuple[Diagnosis, Models]:
    """Diagnose one log.

    Args:
        system: of the spec, with its declared effects.
        log: to train on; without ``test_log`` its last 30 % is held out.
        progress: told (station, share done).

    Raises:
        BadInput: if a log is too short or moves too little to say anything.
    """
    tell = progress or (lambda station, share: None)
    tell("preflight", 0.0)
    findings = {"train": (*preflight(log, spec), *_steady_laws(system))}
    if test_log is not None:
        findings["test"] = preflight(test_log, spec)
    motion = smooth_motion(log)
    split = len(motion.time) if test_log is not None else round(len(motion.time) * (1 - HELD_OUT_SHARE))
    training = _restrict(motion, 0, split)
    other = smooth_motion(test_log, motion.cutoff_hz) if test_log is not None else motion
    window = Window(0, len(other.time)) if test_log is not None else Window(split, len(motion.time))
    tolerance = _tolerances(spec, log)

    tell("refit", 0.05)
    problem = Problem(system, training, tolerance)
    _refuse_still(problem, log)
    refit = with_values(system, problem.refitted(problem.base.fit()))
    faults = [f.words for f in findings["train"] if f.severity == "problem"]
    found, first = ([], []) if faults else _search(problem, refit, log.tolerance or 0.0, tell)
    tell("held-out error", 0.85)
    augmented = with_values(with_effects(system, found), found[-1].refitted) if found else refit
    judge = Problem(system, other, {})
    figures = [measure(s, other, judge.masks, window) for s in (system, refit, augmented)]
    tell("tracking observer", 0.93)
    agreement = compare_residuals(spec, system, training)

    verdict, named, rival = _verdict(first, found, refit)
    moved = [*problem.levels, *problem.uncertain]
    values = {s.name: (float(system.values[s]), float(refit.values[s]), float(augmented.values[s])) for s in moved}
    adopted = {name: after if verdict == "effect" else before for name, (_, before, after) in values.items()}
    text = augmented_text(spec, named if verdict == "effect" else [], adopted, system)
    diagnosis = Diagnosis(
        verdict=verdict,
        sentence=_sentence(system, verdict, named, rival, figures, faults),
        effects=tuple(named) if verdict == "effect" else (),
        candidates=tuple(r.evidence for r in first[:TABLE_SIZE]),
        declared=figures[0],
        refit=figures[1],
        augmented=figures[2],
        training=_training(problem, (system, refit, augmented)),
        refitted=values,
        data=_data(log, test_log, motion, window, problem),
        agreement=agreement,
        findings={name: tuple(_words(f) for f in some) for name, some in findings.items()},
        certificate=None,
    )
    tell("done", 1.0)
    return diagnosis, Models(system, refit, augmented, problem, judge, window, text)


def _sentence(
    system: System,
    verdict: Verdict,
    named: list[FoundEffect],
    rival: list[FoundEffect],
    figures: list[ErrorFigures],
    faults: list[str],
) -> str:
    units = {system.force_unit(i) for i in range(system.degrees_of_freedom)}
    unit = " " + units.pop() if len(units) == 1 else ""
    words = render(
        "text/verdict.j2",
        verdict=verdict,
        effects=named,
        rivals=rival,
        before=figures[1],
        after=figures[2],
        unit=unit,
        faults=faults,
    )
    return words.strip()


def _search(problem: Problem, refit: System, tolerance: float, tell: Progress) -> tuple[list[Fit], list[Ranked]]:
    """Add the best effect while the data credit one; the first round's ranking is the table that is shown."""
    found: list[Fit] = []
    first: list[Ranked] = []
    current = problem
    base_system = refit
    for turn in range(MOST_EFFECTS):
        ranked = _round(current, base_system, found, tolerance, _told(tell, turn))
        first = first or ranked
        if not ranked or not ranked[0].evidence.accepted:
            break
        if rivals(ranked):
            if not found:
                found.append(ranked[0].fit)
            break
        found.append(ranked[0].fit)
        found = _polish(problem, found)
        base_system = with_values(with_effects(problem.system, found), found[-1].refitted)
        current = replace(problem, system=with_effects(problem.system, found))
    return found, first


def _told(tell: Progress, turn: int) -> Callable[[float], None]:
    return lambda share: tell(f"effect {turn + 1}", 0.1 + 0.25 * (turn + share))


def _round(
    problem: Problem, base_system: System, found: Sequence[Fit], tolerance: float, tell: Callable[[float], None]
) -> list[Ranked]:
    places = [p for p in all_places(problem) if not _already(p, found)]
    fits = []
    for k, (effect, place, on) in enumerate(places):
        fit = fit_effect(problem, effect, place, on)
        if fit is not None:
            fits.append(fit)
        tell((k + 1) / len(places))
    window = Window(0, len(problem.motion.time))
    reference = _pooled(free_run_errors(base_system, problem.motion, window))

    def ratio(fit: Fit) -> float:
        error = _pooled(
            free_run_errors(with_values(with_effect(problem.system, fit), fit.refitted), problem.motion, window)
        )
        return (
            error / reference
            if reference > 0 and np.isfinite(reference)
            else (1.0 if np.isfinite(error) else float("inf"))
        )

    return rank(problem.base.held_out(), fits, ratio, tolerance)


def _already(place: tuple[Any, int, str], found: Sequence[Fit]) -> bool:
    """Whether an effect, or a twin of it, is in the model already."""
    effect, _, on = place
    return any((effect.kind, on) in {(f.kind, f.on), *f.twins} for f in found)


def _polish(problem: Problem, found: list[Fit]) -> list[Fit]:
    """Fit each effect again with the others in place, so that no one carries another's share."""
    if len(found) < 2:
        return found
    polished = list(found)
    for _ in range(2):
        for k, fit in enumerate(polished):
            others = polished[:k] + polished[k + 1 :]
            again = fit_effect(
                replace(problem, system=with_effects(problem.system, others)), fit.effect, fit.place, fit.on
            )
            if again is not None:
                polished[k] = again
    return polished


def _verdict(
    first: list[Ranked], found: list[Fit], refit: System
) -> tuple[Verdict, list[FoundEffect], list[FoundEffect]]:
    if not found:
        return "none", [], []
    tied = rivals(first)
    if tied:
        return "ambiguous", [_named(first[0].fit, refit)], [_named(r.fit, refit) for r in tied]
    return "effect", [_named(f, refit) for f in found], []


def _named(fit: Fit, system: System) -> FoundEffect:
    return FoundEffect(fit.kind, fit.on, fit.parameters, unit_words(fit.effect, fit.place, system), fit.twins)


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


def _refuse_still(problem: Problem, log: Log) -> None:
    moving = min(int((b.index >= 0).sum()) for b in problem.blocks)
    if moving < 60:
        found = f"{moving} independent samples in motion on a coordinate"
        raise BadInput(str(log.path), found, "at least 60, so that friction in slip can be seen")


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
        "restart_s": 0.5,
        "blocks": len(problem.base.products),
        "independent_samples": problem.base.samples // 2,
    }


def _pooled(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def _words(finding: Finding) -> str:
    return f"{finding.severity}: {finding.words}"
