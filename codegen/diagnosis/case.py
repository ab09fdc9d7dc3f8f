"""The case of a diagnosis: log and spec prepared for the fits.

It has the preflight's findings, the inputs as they act between rows, the filtered motion, the held-out part of the
data, and the parameters that a fit may change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.base.progress import begin
from codegen.diagnosis.evidence.residual_regression import events_of, inertia_noise
from codegen.diagnosis.evidence.timing import acting_earlier, input_leads
from codegen.diagnosis.fit.force_rows import force_rows, information, residual_sizes
from codegen.diagnosis.fit.linear import inverse
from codegen.diagnosis.fit.measure import drive_force
from codegen.diagnosis.fit.record import LEAST_SAMPLES, LEAST_SEGMENTS, PERIODS, SHORTENED, TooFewStretches, record_of
from codegen.diagnosis.fit.residual import Problem, slip_velocities
from codegen.diagnosis.fit.signals import (
    CUTOFFS_HZ,
    FASTER_HZ,
    MOSTLY_FASTER,
    NOISE_SHARE,
    SHORTEST_TEST_S,
    TRIM_S,
    Motion,
    is_within_rate,
    smooth_motion,
)
from codegen.diagnosis.fit.trial import in_unit
from codegen.effects.declare import add_declared_effects, effect_deviations
from codegen.logs import Finding, Log, excerpt, preflight
from codegen.logs.excerpt import since
from codegen.logs.motion import measured_motion, steady_speeds
from codegen.mechanics import build_system
from codegen.mechanics.base_parameters import LinkParameter, link_parameters
from codegen.mechanics.system import System
from codegen.simulate.simulable import is_simulable
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree
from codegen.spec.numerics import numerical

HELD_OUT_SHARE = 0.3
"""Share of a log at its end that is held out if there is no test log."""
KNOWN = 0.1
"""Largest ratio of a refitted parameter's variance to its declared one; above it, free runs would be biased more."""
Findings = Mapping[str, tuple[str, ...]]
"""Log, "train" or "test" → findings of the preflight, in words."""


@dataclass(frozen=True, eq=False)
class Case:
    """Log and spec, prepared for the fits.

    Attributes:
        log, test_log: with inputs as they act between rows; test_log is None if the end of the log is held out.
        problem: the declared system on the training part of the motion.
        test: the declared system on the motion whose part ``window`` is held out.
        leads: index of an input → rows by which it was taken earlier than it was logged.
    """

    spec: Spec
    log: Log
    test_log: Log | None
    motion: Motion
    problem: Problem
    test: Problem
    window: slice
    findings: Mapping[str, tuple[Finding, ...]]
    leads: Mapping[int, float] = field(default_factory=dict)

    @property
    def material(self) -> float:
        """Share of the RMS drive force from which on a force matters."""
        return self.problem.material

    @property
    def log_of_test(self) -> Log:
        """The log that has the held-out data."""
        return self.log if self.test_log is None else self.test_log

    @cached_property
    def events(self) -> tuple[int, ...]:
        """Samples of the training log in single events (``events_of``)."""
        return events_of(self.problem)

    @cached_property
    def steady(self) -> bool:
        """Whether every coordinate runs at constant speed."""
        return _is_steady(self.log, self.motion)

    @property
    def faults(self) -> bool:
        """Whether the preflight found a problem, so that no effect is tried."""
        return any(f.severity == "problem" for f in self.findings["train"])

    @property
    def unfit(self) -> BadInput | None:
        """The preflight's problem as an error, for where it prevents a fit; None without a problem."""
        problems = [f.words for f in self.findings["train"] if f.severity == "problem"]
        if not problems:
            return None
        # The finding ends with the remedy, and what was found would be cut to fewer characters than what is expected.
        return BadInput(self.log.where, "it contradicts the spec", f"a log that fits it. {problems[0]}", code="LOG012")

    def with_leads(self, leads: Mapping[int, float], found: Sequence[Finding]) -> Case:
        """The case with other leads of some inputs, and findings on them in place of those on the same topics."""
        topics = {f.topic for f in found}
        kept = (f for f in self.findings["train"] if f.topic not in topics)
        case = replace(self, leads={**self.leads, **leads}, findings={**self.findings, "train": (*kept, *found)})
        further = {k: rows - self.leads.get(k, 0.0) for k, rows in leads.items()}
        if not any(further.values()):
            return case
        log, test_log = acting_earlier(self.log, further), self.test_log and acting_earlier(self.test_log, further)
        motion = smoothed(log, self.problem.system)
        part = _restrict(motion, len(self.problem.motion.time))
        return replace(
            case,
            log=log,
            test_log=test_log,
            motion=motion,
            problem=replace(self.problem, motion=part),
            test=replace(self.test, motion=_test_motion(motion, test_log)),
        )

    @property
    def findings_in_words(self) -> Findings:
        """Log → its findings in words, each after its severity."""
        return {name: tuple(f"{f.severity}: {f.words}" for f in some) for name, some in self.findings.items()}


@numerical("the force balance on the log")
def case_of(spec: Spec, system: System, log: Log, test_log: Log | None, material: float) -> Case:
    """Prepare log and spec; ``material`` as of ``Case``."""
    system, deviations, changes = uncertain_values(spec, system, log)
    start = log.description.evaluation.from_s
    begin("preflight")
    log, cut = excerpt(log if log.records or start is None else since(log, start))
    findings = {
        "train": (
            *cut,
            *([_warning("from_s", "log", start=start)] if log.records and start is not None else ()),
            *preflight(log, spec),
            *_steady_laws(system),
            *values_of_zero(spec),
            *unknown_starts(system, log),
        )
    }
    if test_log is not None:
        test_log, cut = excerpt(test_log)
        findings["test"] = (*cut, *preflight(test_log, spec), *unknown_starts(system, test_log))
    motion = smoothed(log, system)
    split = len(motion.time) if test_log is not None else round(len(motion.time) * (1 - HELD_OUT_SHARE))
    cutoff = None if _is_steady(log, motion) else cutoff_with_segments(log, motion, split)
    if cutoff is not None:
        findings["train"] += (_warning("cutoff", "cutoff", cutoff=cutoff, quiet=motion.cutoff_hz),)
        log = replace(log, cutoff_hz=cutoff)
        motion = smoothed(log, system)
    problem = Problem(system, _restrict(motion, split), deviations, changes, material)
    if _is_steady(log, motion) or moves_one_way(problem):
        unseen = unseen_inertias(problem)
        findings["train"] += not_refitted(problem, unseen)
        deviations = {s: size for s, size in deviations.items() if s not in unseen}
        problem = replace(problem, deviation=deviations)
    other = _test_motion(motion, test_log)
    window = slice(split if test_log is None else 0, len(other.time))
    case = Case(spec, log, test_log, motion, problem, Problem(system, other, {}), window, findings)
    return case.with_leads(*input_leads(problem, log))


def _test_motion(motion: Motion, test_log: Log | None) -> Motion:
    """The motion of the test log, or without one that of the whole log."""
    return motion if test_log is None else smooth_motion(test_log, motion.cutoff_hz, SHORTEST_TEST_S)


def smoothed(log: Log, system: System) -> Motion:
    """The smoothed motion of a log, with a higher cutoff if its inputs act mostly above the usual one.

    The noise of M a must then be at most ``NOISE_SHARE`` of the drive force, and most of the input must pass.
    """
    motion = smooth_motion(log)
    fast = _above(log, motion) > MOSTLY_FASTER
    if log.cutoff_hz or not fast.any():
        return motion
    for cutoff in (hz for hz in FASTER_HZ if motion.cutoff_hz < hz and is_within_rate(hz, log.sample_time)):
        faster = smooth_motion(log, cutoff)
        if np.all(_above(log, faster)[fast] <= MOSTLY_FASTER) and _is_quiet(system, faster):
            return faster
    return motion


def cutoff_with_segments(log: Log, motion: Motion, split: int) -> float | None:
    """The lowest default cutoff above the motion's at which its first ``split`` samples hold enough segments.

    A segment is so many periods of the cutoff; free runs are compared with the unfiltered positions, so more noise in
    the filtered ones is no bias. None if the motion holds enough, none would help, or the log states its cutoff.
    """
    if log.cutoff_hz or holds_segments(log, motion, split):
        return None
    higher = (hz for hz in reversed(CUTOFFS_HZ) if motion.cutoff_hz < hz and is_within_rate(hz, log.sample_time))
    return next((hz for hz in higher if holds_segments(log, smooth_motion(log, hz), split)), None)


def holds_segments(log: Log, motion: Motion, split: int) -> bool:
    """Whether the first ``split`` samples of a motion hold enough segments for free runs."""
    try:
        record_of(_restrict(motion, split), log)
    except BadInput:
        return False
    return True


def _warning(say: str, topic: str, **given: Any) -> Finding:
    """A warning in the words of its template, of which ``say`` and ``given`` are the arguments."""
    return Finding.worded("warning", topic, "case", say, {}, **given)


def _above(log: Log, motion: Motion) -> Array:
    """(m,) share of each input's square that lies above the cutoff; 0 for an input that is always zero."""
    square = np.mean(log.inputs**2, axis=0)
    above = np.mean((log.inputs - motion.low_pass(log.inputs)) ** 2, axis=0)
    return np.asarray(above / np.where(square > 0, square, 1.0))


def _is_quiet(system: System, motion: Motion) -> bool:
    """Whether noise is at most ``NOISE_SHARE`` of the drive force, or without drive of the acceleration."""
    drive = np.mean(motion.low_pass(drive_force(system, motion))[motion.usable] ** 2, axis=0)
    noise = np.array([inertia_noise(system, motion, i) for i in range(len(drive))])
    acceleration = np.std(motion.low_pass(motion.accelerations)[motion.usable], axis=0)
    idle = motion.noise_after(motion.cutoff_hz, 2) <= NOISE_SHARE * acceleration
    return bool(np.all(np.where(drive > 0, noise <= NOISE_SHARE**2 * drive, idle)))


def _is_steady(log: Log, motion: Motion) -> bool:
    """Whether every coordinate runs at constant speed."""
    return len(steady_speeds(log, motion.velocities, motion.usable)) == len(motion.velocities[0])


def uncertain_values(
    spec: Spec, system: System, log: Log
) -> tuple[System, Mapping[sympy.Symbol, float], Mapping[sympy.Symbol, Array]]:
    """The system with all uncertain quantities as parameters, their deviations in SI, and ``LinkParameter.changes``."""
    deviations: dict[sympy.Symbol, float] = {}
    for p in spec.parameters:
        share, symbol = p.tolerance if p.tolerance is not None else log.tolerance or 0.0, spec.symbol(p.name)
        size = p.deviation if p.deviation is not None else share * abs(float(system.values[symbol]))
        if size:
            deviations[symbol] = size
    links: tuple[LinkParameter, ...] = ()
    if isinstance(spec.form, KinematicTree) and spec.form.tolerance is not None:
        begin("building the model with uncertain links")
        links = link_parameters(spec, spec.form)
        system = add_declared_effects(build_system(spec, links), spec)
        deviations |= {spec.symbol(p.name): p.deviation for p in links}
    changes = {spec.symbol(p.name): p.changes for p in links}
    return system, deviations | effect_deviations(system, spec), changes


def _restrict(motion: Motion, stop: int) -> Motion:
    """The part of a motion before a sample, for training."""
    rows = ("time", "positions", "velocities", "accelerations", "inputs", "commands", "usable", "measured", "counted")
    cut = {name: getattr(motion, name)[:stop] for name in rows if getattr(motion, name) is not None}
    if stop < len(motion.time):
        cut["usable"] = cut["usable"].copy()
        cut["usable"][-round(1 / (motion.cutoff_hz * motion.sample_time)) :] = False
    return replace(motion, **cut)


def _steady_laws(system: System) -> tuple[Finding, ...]:
    """Warnings for contacts whose law cannot be simulated and is replaced by its steady-sliding level."""
    return tuple(_warning("law", "law", law=c.law.name, contact=c.name) for c in system.contacts if not is_simulable(c))


def values_of_zero(spec: Spec) -> tuple[Finding, ...]:
    """Warnings for values of zero, whose relative tolerance allows no change."""
    declared = [(p.name, p.value, p.tolerance) for p in spec.parameters]
    for e in spec.effects:
        declared += [(f"{name} of {e.kind} on {', '.join(e.on)}", v, e.tolerance) for name, v in e.parameters.items()]
    return tuple(
        _warning("zero", f"tolerance of {name}", name=name, tolerance=tolerance)
        for name, value, tolerance in declared
        if tolerance and value == 0
    )


def unknown_starts(system: System, log: Log) -> tuple[Finding, ...]:
    """Warnings for positions that are integrated from a speed, from zero, if a force depends on them."""
    integrated = log.raw_data.integrated or (False,) * len(system.positions)
    return tuple(
        _warning("start", f"start of {x.name}", x=x.name, several=bool(log.records))
        for x, unknown in zip(system.positions, integrated, strict=True)
        if unknown and system.equation_error.has(x)
    )


def unseen_inertias(problem: Problem) -> list[sympy.Symbol]:
    """The uncertain parameters that act through inertia alone and that the force residual hardly determines.

    At constant speed the noise of a logged input changes an inertia in free runs (errors in variables). So a parameter
    is undetermined if its variance by the force residual, H⁻¹, exceeds ``KNOWN`` times that of its tolerance: H = Σ s
    s'/σ² + ``Problem.prior_information``, with the slopes s and RMS residual σ over independent samples.
    """
    still = problem.system.equation_error.subs(dict.fromkeys(problem.system.accelerations, 0))
    inertias = [s for s in problem.uncertain if s not in still.free_symbols]
    if not inertias:
        return []
    prior, rows = problem.prior_information, force_rows(problem.system, problem, problem.refitted_symbols)
    variance = np.diag(inverse(information(rows, residual_sizes(rows, prior), prior)))
    kept = dict(zip(problem.refitted_symbols, variance * problem.prior_precision, strict=True))
    return [s for s in inertias if kept[s] > KNOWN]


def moves_one_way(problem: Problem) -> bool:
    """Whether some contact slips and none ever reverses."""
    slip = slip_velocities(problem.system, problem.motion)[problem.motion.usable]
    return slip.shape[1] > 0 and bool(np.all(np.all(slip > 0, axis=0) | np.all(slip < 0, axis=0)))


def not_refitted(problem: Problem, symbols: list[sympy.Symbol]) -> tuple[Finding, ...]:
    """The warning that these parameters keep their declared values."""
    system = problem.system
    kept = [f"{s.name} at {float(system.values[s]):.6g}{in_unit(system, s)}" for s in symbols]
    names = [s.name for s in symbols]
    return (_warning("unseen", "unseen inertia", names=names, kept=kept),) if symbols else ()


MOSTLY_AT_REST = 0.5
"""Share of the time at rest from which on it is named as the cause."""


def few_stretches(case: Case, refused: TooFewStretches) -> BadInput:
    """The refusal by ``record_of``, with the time at rest, what to record, and an idle start to leave out."""
    found, expected = refused.found, refused.expected
    resting = [f"{name} rests in {share:.0%} of the time" for name, share in _at_rest(case) if share > MOSTLY_AT_REST]
    if resting:
        found += f" ({', '.join(resting)})"
        expected += f": record about {_enough_s(case):.0f} s to and fro without pauses"
    else:
        expected += f": record about {_enough_s(case, refused.count):.0f} s of such motion"
    idle = _idle_start(case)
    if idle is not None:
        line = f"`evaluation: {{from_s: {idle:.3f}}}` in meta.yaml beside the log"
        expected += f"; it rests until {idle + TRIM_S:.3f} s, which {line} leaves out"
    usual, rate = case.motion.cutoff_hz, 1 / case.log.sample_time
    higher = next((hz for hz in reversed(CUTOFFS_HZ) if hz > usual), usual)
    if not case.log.cutoff_hz and not is_within_rate(higher, case.log.sample_time):
        expected += f"; or sample faster than {rate:.4g} Hz, of which the cutoff is at most a tenth"
    return BadInput(refused.place, found, expected, code="LOG009")


def _idle_start(case: Case) -> float | None:
    """Time in s until which a log rests at its beginning, if without that it holds enough stretches; else None."""
    log, motion = case.log, measured_motion(case.log)
    moving = np.any(np.abs(motion.velocities) > motion.threshold, axis=1)
    end = float(log.time[np.argmax(moving)]) - TRIM_S
    if log.records or end <= log.time[0]:
        return None
    rest = since(log, end)
    split = round(rest.size * (1 - HELD_OUT_SHARE)) if case.test_log is None else rest.size
    try:
        return end if holds_segments(rest, smoothed(rest, case.problem.system), split) else None
    except BadInput:  # too short
        return None


def _at_rest(case: Case) -> list[tuple[str, float]]:
    """Each coordinate and its share of the time at rest, by the preflight."""
    shares = {f.topic: f.figures["standstill"] for f in case.findings["train"] if "standstill" in f.figures}
    topics = ((c.name, f"motion of {c.name}") for c in case.spec.coordinates)
    return [(name, shares[topic]) for name, topic in topics if topic in shares]


def _enough_s(case: Case, found: int = 0) -> float:
    """Seconds of motion that hold enough of the shortest stretches, with the ends and the held-out part.

    Args:
        found: stretches in the log, of whose time slow motion and gaps take as large a share as of a longer one's; 0
            for a motion without pauses.
    """
    shortest = max(SHORTENED[-1] * PERIODS / case.motion.cutoff_hz, LEAST_SAMPLES * case.log.sample_time)
    ideal = 2 * TRIM_S + LEAST_SEGMENTS * shortest / (1 - HELD_OUT_SHARE if case.test_log is None else 1)
    alike = case.log.size * case.log.sample_time * LEAST_SEGMENTS / found if found else 0.0
    return max(ideal, alike)
