"""Candidates that one log cannot tell apart: how alike they are on it, and the cheapest extra motion that tells."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput
from codegen.diagnosis.advice import Likeness, MotionTried, Separation
from codegen.diagnosis.credit import held_out_losses, independent_share
from codegen.diagnosis.discrimination import Discrimination, Model
from codegen.diagnosis.follow import follow
from codegen.diagnosis.models import with_effects, with_values
from codegen.diagnosis.motions import ExtraMotion, Reach, library, reach_of, reference_text
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.ranking import Ranked, twins
from codegen.diagnosis.record import record_of
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.rounds import Outcome
from codegen.diagnosis.search import Search
from codegen.diagnosis.shooting import Record
from codegen.diagnosis.signals import smooth_motion
from codegen.effects import CATALOGUE
from codegen.effects.declare import unit_words
from codegen.effects.family import kinds_of
from codegen.logs import Log
from codegen.mechanics.system import System
from codegen.simulate.sensors import Sensors

Array = NDArray[np.float64]

SEPARATED = 10.0
"""Standard deviations of the noise between the truth and the other candidate's best fit: 25 nats, where the verdict
asks for about five."""
TRAINED = 0.7
"""Share of the motion that is judged: a diagnosis without a second log holds the rest out."""
MOST_RIVALS, MOST_ALIKE = 2, 1


@dataclass(frozen=True, eq=False)
class Played:
    """A motion as a candidate's machine follows it: references (N, n), commands (N, m) and positions (N, n)."""

    references: Array
    commands: Array
    positions: Array

    def energy(self, h: float) -> float:
        """∫|w|² dt."""
        return float((self.commands**2).sum() * h)


def tied_fits(search: Search, outcome: Outcome) -> list[Shot]:
    """The best fit, and its rivals in the place of its first effect."""
    return [outcome.final, *(_in_place(search, outcome, r) for r in outcome.rivals[:MOST_RIVALS])]


def separate(
    search: Search, outcome: Outcome, tied: Sequence[Shot], log: Log, envelope: Mapping[str, tuple[Any, Any]]
) -> tuple[Separation, str | None]:
    """Tell how alike the tied candidates are, and look for the cheapest motion that tells each from each.

    A motion is simulated with one candidate after the other as the truth, under a position loop, with the log's noise
    on the positions; every candidate is then refitted to it, as a diagnosis of it would, and must lose to the truth by
    ``SEPARATED``. Shorter motions are cheaper, and among those of one length the one with the least ∫|w|² dt.
    Beside them stand changes of the machine on the log's own path; see ``discrimination``.

    Args:
        outcome: with rivals. tied: its fits, see ``tied_fits``.
        envelope: of the spec; the motions stay inside it or inside what the log has shown.

    Returns:
        The figures, and the excitation file's text: None where no motion separates them.
    """
    shots = [*tied, *(_in_place(search, outcome, r) for r in _look_alikes(outcome))]
    alike = tuple(_likeness(search, outcome, shots[0], other) for other in tied[1:])
    reach = reach_of(search.system, search.motion, envelope)
    machines = [_machine(shot) for shot in tied]
    changes = tuple(Discrimination(search, log, [_model(shot) for shot in tied]).tried())
    tried: list[MotionTried] = []
    for motion, played in _cheapest_first(search, machines[0], reach, log.sample_time):
        figures = _try(search, log, shots, machines, reach, motion, played)
        tried.append(figures)
        if figures.separation >= SEPARATED:
            names = [x.name for x in search.system.positions]
            texts = {name: reference_text(r) for name, r in zip(names, motion.references, strict=True)}
            return Separation(alike, tuple(tried), figures, texts, SEPARATED, changes), _csv(search, played)
    return Separation(alike, tuple(tried), None, {}, SEPARATED, changes), None


def _cheapest_first(search: Search, machine: System, reach: Reach, h: float) -> Iterator[tuple[ExtraMotion, Played]]:
    """The library's motions that stay finite: the shorter first, among equals the one with less energy."""
    for _, same in groupby(library(reach, search.motion), key=lambda motion: motion.duration):
        followed = [(motion, _play(search, machine, reach, motion, h)) for motion in same]
        whole = [(motion, played) for motion, played in followed if played is not None]
        yield from sorted(whole, key=lambda pair: pair[1].energy(h))


def _look_alikes(outcome: Outcome) -> list[Ranked]:
    """The best that this log ruled out though it is confused with one that ties: it must lose on the motion too."""
    tied = [outcome.final.runner.trial.parts[0], *(r.found.part for r in outcome.rivals)]
    alike = {c.other for part in tied for c in CATALOGUE[part.kind].confused_with}
    named = {(p.kind, p.on) for p in (*tied, *outcome.final.runner.trial.parts)}
    named |= {same for r in outcome.first if (r.found.part.kind, r.found.part.on) in named for same in _twins(r)}
    possible = (r for r in outcome.first if not r.why_not and kinds_of(r.found.part.kind) & alike)
    return [r for r in possible if (r.found.part.kind, r.found.part.on) not in named][:MOST_ALIKE]


def _twins(ranked: Ranked) -> list[tuple[str, str]]:
    return twins(ranked.found.part, ranked.found)


def _in_place(search: Search, outcome: Outcome, ranked: Ranked) -> Shot:
    """The fit with another candidate in the place of the first effect."""
    rival, final = ranked.found, outcome.final
    moved, found = final.runner.trial.split(final.theta)
    others = final.runner.trial.parts[1:]
    return search.exchanged(final, moved, [rival.part, *others], [rival.parameters, *found[1:]])


def _likeness(search: Search, outcome: Outcome, first: Shot, other: Shot) -> Likeness:
    """The angle between what the two take out of the residual, and how far the better fits on this log."""
    base = outcome.base if len(first.runner.trial.parts) == 1 else search.without(first, 0)
    one, two = ((base.residual - shot.residual).ravel() for shot in (first, other))
    size = float(np.linalg.norm(one) * np.linalg.norm(two))
    cosine = float(np.clip(one @ two / size, -1.0, 1.0)) if size > 0 else 1.0
    parts = [shot.runner.trial.parts[0] for shot in (first, other)]
    return Likeness(
        (parts[0].kind, parts[0].on),
        (parts[1].kind, parts[1].on),
        float(np.degrees(np.arccos(cosine))),
        _distance(first, other),
        next(
            (c.separated_by for c in CATALOGUE[parts[0].kind].confused_with if c.other in kinds_of(parts[1].kind)), ""
        ),
    )


def _distance(truth: Shot, other: Shot) -> float:
    """How much better one fits than the other, in standard deviations of the noise.

    Near the noise, where a segment's loss grows by a quarter of its squared residual, it is the norm of the difference
    of the two predictions over the noise, with only as many residuals counted as are independent; below zero where the
    other fits better.
    """
    gain = float(held_out_losses(other).sum() - held_out_losses(truth).sum())
    return float(np.copysign(2 * np.sqrt(independent_share(truth) * abs(gain)), gain))


def _machine(shot: Shot) -> System:
    """The system with a fit's effects and levels."""
    trial = shot.runner.trial
    moved, found = trial.split(shot.theta)
    system = with_values(trial.system, {s.name: float(v) for s, v in zip(trial.moved, moved, strict=True)})
    effects = [
        FoundEffect(p.kind, p.on, values, unit_words(CATALOGUE[p.kind], p.place, system))
        for p, values in zip(trial.parts, found, strict=True)
    ]
    return with_effects(system, effects)


def _model(shot: Shot) -> Model:
    """A fit by its numbers in SI."""
    trial = shot.runner.trial
    moved, found = trial.split(shot.theta)
    own = [values[name] for part, values in zip(trial.parts, found, strict=True) for name in part.names]
    return Model(trial, np.append(moved, own), np.append(shot.price[: len(moved)], np.zeros(len(own))))


def _try(
    search: Search,
    log: Log,
    shots: Sequence[Shot],
    machines: Sequence[System],
    reach: Reach,
    motion: ExtraMotion,
    first: Played,
) -> MotionTried:
    """The least separation over all pairs of truth and other; ``first`` is the motion as the first candidate has it.

    ``machines`` are of the first of the ``shots``: only what ties is taken as the truth.
    """
    h, least = log.sample_time, float("inf")
    energy = first.energy(h)
    for k, machine in enumerate(machines):
        played = first if k == 0 else _play(search, machine, reach, motion, h)
        there = None if played is None else _search_there(search, log, played, k)
        if there is None:
            return MotionTried(motion.name, motion.duration, energy, 0.0)
        fits = [there.elsewhere(shot) for shot in shots]
        least = min(least, *(_distance(fits[k], fit) for j, fit in enumerate(fits) if j != k))
        if least <= 0:
            break
    return MotionTried(motion.name, motion.duration, energy, max(0.0, least))


def _play(search: Search, machine: System, reach: Reach, motion: ExtraMotion, h: float) -> Played | None:
    """A motion under a position loop; None where it does not stay finite."""
    samples = round(motion.duration / h)
    target, rate = motion.at(h * np.arange(samples, dtype=np.float64))
    run = follow(search, machine, target, rate, reach.centre, h, reach.inputs)
    return None if run is None else Played(target, run.inputs, run.positions)


def _measured(search: Search, log: Log, positions: Array, seed: int) -> Array:
    """Positions as this log's sensors would have them: in its steps, with its noise."""
    n = positions.shape[1]
    step = np.array(log.encoder_step or log.intake.smallest_step or (0.0,) * n)
    said = np.array(log.description.position_noise or (0.0,) * n)
    noise = np.where((step > 0) | (said > 0), said, search.record.noise)
    sensors = Sensors(np.broadcast_to(noise, n), np.broadcast_to(step, n))
    return sensors.encoded(positions, sensors.noise(len(positions), n, seed)[0])


def _search_there(search: Search, log: Log, played: Played, seed: int) -> Search | None:
    """The search on the motion's first part, as if it had been logged; None where it holds too little motion."""
    measured, commands = _measured(search, log, played.positions, seed), played.commands
    kept = round(TRAINED * len(measured))
    made = replace(
        log,
        time=log.sample_time * np.arange(kept, dtype=np.float64),
        positions=measured[:kept],
        velocities=None,
        inputs=commands[:kept],
        gaps=(),
    )
    try:
        motion = smooth_motion(made, search.motion.cutoff_hz)
        record = replace(record_of(motion, made), noise=search.record.noise, joints=search.record.joints)
    except BadInput:
        return None

    def shorter(share: float) -> Record:
        return replace(record_of(motion, made, share), joints=search.record.joints)

    return replace(search, motion=motion, record=record, shorter=shorter)


def _csv(search: Search, played: Played) -> str:
    """t, the references and the commands, one row a sample, SI; like a log, but no log: nothing in it was measured."""
    system, h = search.system, search.record.sample_time
    names = ["t", *(f"{x.name}_reference" for x in system.positions), *(w.name for w in system.inputs)]
    rows = np.hstack([h * np.arange(len(played.commands))[:, None], played.references, played.commands])
    lines = [",".join(f"{v:.9g}" for v in row) for row in (rows + 0.0).tolist()]
    return "\n".join([",".join(names), *lines]) + "\n"
