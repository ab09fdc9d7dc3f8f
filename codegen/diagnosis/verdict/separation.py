"""Candidates that tie on one log: their similarity, and the cheapest extra motion that discriminates them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
import sympy
from sympy import sin, tanh

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.diagnosis.fit.acceptance import independent_share
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import LEAST_SEGMENTS, PERIODS, Record, record_of
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import Motion, smooth_motion
from codegen.diagnosis.results import MotionTried, Separation, TiedPair
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.effects.register import separating_experiment
from codegen.logs import Log
from codegen.mechanics.system import TIME, System
from codegen.simulate.controller import Feedback, sampled
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.sensors import Sensors

SEPARATED = 10.0
"""Needed separation in standard deviations of the noise, which is 25 nats; the verdict itself needs about five."""
TRAINED = 0.7
"""Share of the motion that is used for fits; a diagnosis without a second log holds the rest out."""
SEGMENTS = 3 * LEAST_SEGMENTS
"""Segments in the shortest motion: enough for a diagnosis that holds the last part out."""
LENGTHS = (1, 2)
LEAST_PERIODS = 4.0
MARGIN = 0.95
"""Share of a range that is used."""
PACES = 0.87
"""Ratio of the pace of one coordinate to the one before, so that several are not in phase."""
CENTRED = 0.02
"""A range whose middle is this near to zero, over its half width, is centred at zero."""
SLOW, SLOW_TURNS = 0.06, 3
DIGITS = 4
MOST_RIVALS = 2
MOST_SIMULATED = 5_000_000
"""Samples of all motions that are tried, times the cube of the number of coordinates: of an arm few, or none."""
LOOP_SHARE, LOOP_SAMPLES = 0.4, 60
"""Bandwidth of the loop over the coarse cutoff, and least number of samples in its period."""


def tied_fits(search: Search, outcome: Outcome) -> list[Fit]:
    """The best fit, and the fits with each rival in place of its first effect."""
    return [outcome.final, *(search.with_first_effect(r.found, outcome.final) for r in outcome.rivals[:MOST_RIVALS])]


def without_leader(search: Search, outcome: Outcome) -> Iterator[Outcome]:
    """The outcome with each rival in turn in place of its first effect, and the later ones as its rivals."""
    for k, rival in enumerate(outcome.rivals[:MOST_RIVALS]):
        yield outcome.with_final(search, search.with_first_effect(rival.found, outcome.final), outcome.rivals[k + 1 :])


def separate(
    search: Search,
    outcome: Outcome,
    tied: Sequence[Fit],
    log: Log,
    envelope: Mapping[str, tuple[Any, Any]],
    progress: Callable[[str, float], None] | None = None,
) -> tuple[Separation, str | None]:
    """Measure the similarity of tied candidates, and find the cheapest motion that discriminates each pair.

    A motion is simulated under a position loop with each candidate in turn as the truth, with the log's noise on the
    positions. Every candidate is refitted to it, as in a diagnosis, and must fit worse than the truth by ``SEPARATED``.
    Shorter motions are cheaper; among equals, the one with the least ∫|w|² dt.

    Args:
        outcome: with rivals. tied: its fits, see ``tied_fits``.
        envelope: of the spec; the motions stay inside it or inside what the log has shown.
    """
    pairs = tuple(_tied_pair(search, outcome, tied[0], other) for other in tied[1:])
    reach = reach_of(search.system, search.motion, envelope)
    report = progress or (lambda what, share: None)
    tried: list[MotionTried] = []
    count = len(library(reach, search.motion))
    for motion, simulated in _cheapest_first(search, tied[0].model, reach, log.sample_time):
        report(f"motion {len(tried) + 1} of {count}", len(tried) / count)
        figures = _try(search, log, tied, reach, motion, simulated)
        tried.append(figures)
        if figures.separation >= SEPARATED:
            named = zip(search.system.positions, motion.references, strict=True)
            texts = {x.name: str(sympy.sstr(reference, full_prec=False)) for x, reference in named}
            text = _csv(search.system, motion, simulated, log.sample_time)
            return Separation(pairs, tuple(tried), figures, texts, SEPARATED), text
    return Separation(pairs, tuple(tried), None, {}, SEPARATED), None


def _cheapest_first(search: Search, machine: System, reach: Reach, h: float) -> Iterator[tuple[ExtraMotion, LoopRun]]:
    """The library's motions that do not diverge, cheapest first; as many as ``MOST_SIMULATED`` allows."""
    simulated = 0.0
    for duration, same in groupby(library(reach, search.motion), key=lambda motion: motion.duration):
        motions = list(same)
        simulated += len(motions) * duration / h * search.system.degrees_of_freedom**3
        if simulated > MOST_SIMULATED:
            return
        followed = [(motion, _simulated(search, machine, reach, motion, h)) for motion in motions]
        whole = [(motion, run) for motion, run in followed if run is not None]
        yield from sorted(whole, key=lambda pair: _energy(pair[1], h))


def _tied_pair(search: Search, outcome: Outcome, first: Fit, other: Fit) -> TiedPair:
    """The angle between the parts of the residual that two fits explain, and their distance on this log."""
    base = outcome.base if len(first.trial.parts) == 1 else search.without(first, 0)
    one, two = ((base.residual - fit.residual).ravel() for fit in (first, other))
    size = float(np.linalg.norm(one) * np.linalg.norm(two))
    cosine = float(np.clip(one @ two / size, -1.0, 1.0)) if size > 0 else 1.0
    parts = [fit.trial.parts[0] for fit in (first, other)]
    return TiedPair(
        parts[0].key,
        parts[1].key,
        float(np.degrees(np.arccos(cosine))),
        _distance(first, other),
        separating_experiment(parts[0].kind, parts[1].kind),
    )


def _distance(truth: Fit, other: Fit) -> float:
    """Distance by which one fit is better than another, in standard deviations of the noise."""
    gain = float(other.held_out_losses.sum() - truth.held_out_losses.sum())
    return float(np.copysign(2 * np.sqrt(independent_share(truth) * abs(gain)), gain))


def _try(
    search: Search, log: Log, fits: Sequence[Fit], reach: Reach, motion: ExtraMotion, first: LoopRun
) -> MotionTried:
    """The smallest separation over all pairs of a candidate as the truth and another one."""
    h, least = log.sample_time, float("inf")
    energy = _energy(first, h)
    for k, fit in enumerate(fits):
        simulated = first if k == 0 else _simulated(search, fit.model, reach, motion, h)
        there = None if simulated is None else _search_there(search, log, simulated, k)
        if there is None:
            return MotionTried(motion.name, motion.duration, energy, 0.0)
        refitted = [there.on_another_record(one) for one in fits]
        least = min(least, *(_distance(refitted[k], one) for j, one in enumerate(refitted) if j != k))
        if least <= 0:
            break
    return MotionTried(motion.name, motion.duration, energy, max(0.0, least))


def _simulated(search: Search, machine: System, reach: Reach, motion: ExtraMotion, h: float) -> LoopRun | None:
    """A motion under a position loop; None if it diverges."""
    samples = round(motion.duration / h)
    return follow(search, machine, *motion.at(h * np.arange(samples, dtype=np.float64)), reach.centre, h, reach.inputs)


def follow(
    search: Search, machine: System, target: Array, rate: Array, centre: Array, h: float, limit: Array
) -> LoopRun | None:
    """Simulate a machine that follows a trajectory under a PD loop, critically damped at ``centre``; None if it
    diverges.

    Args:
        search: its system and cutoff give the gains (``loop_gains``).
        target, rate: (N, n) reference positions and velocities, one row for each sample.
        centre: (n,) positions at which the gains are computed.
        limit: (m,) largest |w|.

    Returns:
        The run, or None if it diverges.
    """
    # Imported here: it comes with the code generator, which few diagnoses need.
    from codegen.simulate.observed_loop import SampledLoop, run_loop

    position_gain, velocity_gain = loop_gains(search.system, search.motion.cutoff_hz, centre, h)
    controller = Feedback(
        len(machine.inputs),
        reference=sampled(target, h),
        velocity_reference=sampled(rate, h),
        position_gain=position_gain,
        velocity_gain=velocity_gain,
    )
    start = (target[0], np.zeros_like(target[0]))
    run = run_loop(machine, SampledLoop(controller, limit=limit), h, len(target), start)
    return run if np.isfinite(run.positions).all() and np.isfinite(run.inputs).all() else None


def logged(log: Log, positions: Array, inputs: Array) -> Log:
    """A copy of a log with the data of a simulated run."""
    time = log.sample_time * np.arange(len(positions), dtype=np.float64)
    return replace(log, time=time, positions=positions, velocities=None, inputs=inputs, gaps=())


def loop_gains(system: System, cutoff_hz: float, centre: Array, h: float) -> tuple[Array, Array]:
    """(m, n) gains ω² B⁺M and 2ω B⁺M of a critically damped position loop; M and B = ∂g/∂w at ``centre``."""
    at = dict(system.values) | dict(zip(system.positions, map(float, centre), strict=True))
    at |= dict.fromkeys((*system.velocities, *system.inputs), 0)
    mass = np.array(system.mass_matrix.subs(at), dtype=float)
    reached = np.array(sympy.Matrix(system.force).jacobian(list(system.inputs)).subs(at), dtype=float)
    frequency = 2 * np.pi * min(LOOP_SHARE * cutoff_hz, 1 / (LOOP_SAMPLES * h))
    to_inputs = np.linalg.pinv(reached) @ mass
    return frequency**2 * to_inputs, 2 * frequency * to_inputs


def _energy(run: LoopRun, h: float) -> float:
    return float((run.inputs**2).sum() * h)


def measured(log: Log, noise: Array, positions: Array, seed: int) -> Array:
    """Positions with the resolution of a log's sensors, and noise of the RMS ``noise`` (n,), rounding included."""
    n = positions.shape[1]
    step = np.broadcast_to(np.array(log.encoder_step or log.raw_data.smallest_step or (0.0,)), n)
    sensors = Sensors(np.sqrt(np.maximum(noise**2 - step**2 / 12, 0.0)), step)
    noises = sensors.noise(len(positions), n, seed)[0]
    if any(log.raw_data.integrated):
        noises = np.where(log.raw_data.integrated, np.cumsum(noises, axis=0), noises)
    return sensors.encoded(positions, noises)


def _search_there(search: Search, log: Log, simulated: LoopRun, seed: int) -> Search | None:
    """The search on the first part of a simulated motion; None if it has too little motion."""
    positions, commands = measured(log, search.record.noise, simulated.positions, seed), simulated.inputs
    kept = round(TRAINED * len(positions))
    made = logged(log, positions[:kept], commands[:kept])
    try:
        motion = smooth_motion(made, search.motion.cutoff_hz)
        record = replace(record_of(motion, made), noise=search.record.noise, joints=search.record.joints)
    except BadInput:
        return None

    def shorter(share: float) -> Record:
        return replace(record_of(motion, made, share), joints=search.record.joints)

    return replace(search, problem=replace(search.problem, motion=motion), record=record, shorter=shorter)


def _csv(system: System, motion: ExtraMotion, run: LoopRun, h: float) -> str:
    """The excitation file: t, references and simulated commands, one row per sample, SI."""
    names = ["t", *(f"{x.name}_reference" for x in system.positions), *(w.name for w in system.inputs)]
    time = h * np.arange(len(run.inputs), dtype=np.float64)
    rows = np.hstack([time[:, None], motion.at(time)[0], run.inputs])
    lines = [",".join(f"{v:.9g}" for v in row) for row in (rows + 0.0).tolist()]
    return "\n".join([",".join(names), *lines]) + "\n"


@dataclass(frozen=True, eq=False)
class Reach:
    """The ranges in which the machine may be moved: centre and half width of positions, largest speeds and inputs."""

    centre: Array
    half: Array
    speed: Array
    inputs: Array


@dataclass(frozen=True, eq=False)
class ExtraMotion:
    """A reference motion: name in words, duration in s, a whole number of samples, and references over t in s."""

    name: str
    duration: float
    references: tuple[sympy.Expr, ...]

    def at(self, time: Array) -> tuple[Array, Array]:
        """References and their rates at (N,) times, both (N, n)."""
        rows = []
        for expressions in (self.references, [r.diff(TIME) for r in self.references]):
            columns = [np.broadcast_to(sympy.lambdify(TIME, e, "numpy")(time), time.shape) for e in expressions]
            rows.append(np.column_stack(columns).astype(np.float64))
        return rows[0], rows[1]


def reach_of(system: System, motion: Motion, envelope: Mapping[str, tuple[Any, Any]]) -> Reach:
    """The ranges of a log, extended to the spec's envelope if that is larger."""
    low, high = motion.positions.min(axis=0), motion.positions.max(axis=0)
    speed = np.quantile(np.abs(motion.velocities), 0.99, axis=0)
    inputs = np.abs(motion.commands).max(axis=0)
    for i, (x, v) in enumerate(zip(system.positions, system.velocities, strict=True)):
        if x.name in envelope:
            bounds = [float(b) for b in envelope[x.name]]
            low[i], high[i] = min(low[i], bounds[0]), max(high[i], bounds[1])
        speed[i] = max(speed[i], _both_ways(envelope, v))
    for j, w in enumerate(system.inputs):
        inputs[j] = max(inputs[j], _both_ways(envelope, w))
    centre, half = (low + high) / 2, (high - low) / 2
    return Reach(np.where(np.abs(centre) > CENTRED * half, centre, 0.0), MARGIN * half, MARGIN * speed, inputs)


def _both_ways(envelope: Mapping[str, tuple[Any, Any]], symbol: sympy.Symbol) -> float:
    """The magnitude that the envelope allows in both directions; 0 if it has no range."""
    return min((abs(float(b)) for b in envelope.get(symbol.name, ())), default=0.0)


def library(reach: Reach, motion: Motion) -> list[ExtraMotion]:
    """Reference motions of two lengths, shortest first; deterministic for a log."""
    shortest = SEGMENTS * PERIODS / motion.cutoff_hz
    moves = []
    for factor in LENGTHS:
        samples = round(factor * shortest / motion.sample_time)
        duration = samples * motion.sample_time
        for name, shape in SHAPES.items():
            references = tuple(
                _plain(reach.centre[i] + shape(*_size(reach, i, duration), duration)) for i in range(len(reach.centre))
            )
            moves.append(ExtraMotion(name, duration, references))
    return moves


def _size(reach: Reach, i: int, duration: float) -> tuple[float, float]:
    """Amplitude a and frequency Ω = speed/a in rad/s of one coordinate."""
    half, speed = float(reach.half[i]), float(reach.speed[i])
    pace = max(speed / half if half > 0 else 0.0, LEAST_PERIODS * 2 * np.pi / duration) * PACES ** (i % 4)
    return min(half, speed / pace), pace


Shape = Callable[[float, float, float], sympy.Expr]
"""(a, Ω, duration) → a motion about zero that stays within ±a and ±aΩ."""


def _turn(duration: float) -> float:
    """Frequency in rad/s of one slow sweep."""
    return 2 * np.pi * SLOW_TURNS / duration


def _chirp(a: float, pace: float, duration: float) -> sympy.Expr:
    """Up and down twice between Ω and 8 Ω, at a nearly constant top speed."""
    turn = 4 * np.pi / duration
    phase = 4.5 * pace * TIME - 3.5 * pace / turn * sin(turn * TIME)
    return 0.8 * a / (4.5 - 3.5 * sympy.cos(turn * TIME)) * sin(phase)


SHAPES: dict[str, Shape] = {
    "two tones over the whole range": lambda a, pace, _: (
        0.6 * a * sin(0.8 * pace * TIME) + 0.35 * a * sin(1.3 * pace * TIME)
    ),
    "slow sweep both ways": lambda a, pace, duration: (
        min(a, SLOW * a * pace / _turn(duration)) * sin(_turn(duration) * TIME)
    ),
    "fast reversals": lambda a, pace, _: a / 6 * sin(6 * pace * TIME),
    "sweep with fast reversals on it": lambda a, pace, duration: (
        min(0.7 * a, 0.3 * a * pace / _turn(duration)) * sin(_turn(duration) * TIME) + 0.1 * a * sin(7 * pace * TIME)
    ),
    "chirp up and down": _chirp,
    "quick moves with rests at both ends": lambda a, pace, _: a * tanh(4 * sin(pace / 4 * TIME)),
    "one half of the range, then the other": lambda a, pace, duration: (
        0.5 * a * tanh(3 * sin(2 * np.pi / duration * TIME)) + 0.45 * a * sin(pace * TIME)
    ),
}


def _plain(expression: sympy.Expr) -> sympy.Expr:
    """The expression with rounded numbers, so that its printed text is what was simulated."""
    rounded = {n: sympy.Float(f"{float(n):.{DIGITS}g}") for n in expression.atoms(sympy.Float)}
    return expression.xreplace(rounded)
