"""Single events: intervals in which an effect acts, and those in which a force residual is far above the usual.

A test on blocks of the log cannot accept an effect that acts in one or two of them. But in such an event the effect
predicts the course of the residual: with b and a the residuals without and with the effect, and the values of another
log, a/b is small only if size, beginning and course agree. Let r = Σa²/Σb² in an event, and n its number of independent
values. If the effect is not there and b is a disturbance in these n dimensions, of any direction and size (uniform in a
ball about zero with all b of so small an r), r is as small with a probability of at most r^(n/2), since no value is
fitted. Over k events (Fisher 1932)

    p = P(χ²_2k ≥ −2 ln Π r_i^(n_i/2)) = gammaincc(k, −ln Π r_i^(n_i/2)),    for one event r^(n/2)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import LEAST_ROWS, acting_force
from codegen.diagnosis.fit.drive import residual_at_drive, residual_without_levels
from codegen.diagnosis.fit.linear import correlation, independent, rms
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.mechanics.system import System

ACTS = 0.05
"""Least force of an effect, over its largest, at which it acts."""
LEAST_ROWS_OF_EVENT = 3
"""Least number of used samples of an event."""
LEAST_PREDICTED = 0.99
"""Least share of the squared residual in the events that an effect predicts: forces are right to 10 %. A force from
outside that a controller balances looks like a limit of its command, but not as closely: the command without that force
is not constant."""
MOST_EVENTS = 12
"""Largest number of events; an effect that acts more often is for the tests on blocks."""
FAR_ABOVE, OF_DRIVE = 10.0, 0.5
"""Least RMS residual in a period of the cutoff reported as an event: over that of the median period, and over that
of the drive force. Of 22 logs without an effect, training and held-out data, one reaches 0.3 of the drive force."""


@dataclass(frozen=True)
class Prediction:
    """How well an effect predicts the residual in the events in which it acts.

    Attributes:
        share: of the squared residual in these that it predicts.
        p: probability of that for a disturbance instead of the effect.
        spans: (start, stop) of each event, s.
    """

    share: float
    p: float
    spans: tuple[tuple[float, float], ...]

    @property
    def is_exact(self) -> bool:
        """Whether there are a few events, and it predicts nearly all of the residual in them."""
        return 0 < len(self.spans) <= MOST_EVENTS and self.share >= LEAST_PREDICTED


def predicted(problem: Problem, plain: System, richer: System, i: int) -> Prediction:
    """The prediction of the residual of a model on coordinate i by one with a further effect; no value is fitted."""
    motion, rows = problem.motion, problem.used[:, i]
    b, a = (inverse_dynamics_residual(system, motion)[:, i] for system in (plain, richer))
    acts = np.abs(b - a) * rows
    nats, before, after, spans = 0.0, 0.0, 0.0, list[tuple[float, float]]()
    for event in _joined(np.flatnonzero(acts >= ACTS * float(acts.max(initial=0.0))), motion.step(1)):
        inside = event[rows[event]]
        if len(inside) < LEAST_ROWS_OF_EVENT or not acts.any():
            continue
        without, with_it = float(b[inside] @ b[inside]), float(a[inside] @ a[inside])
        before, after = before + without, after + with_it
        nats += 0.5 * _independent_values(b[inside], motion.step(2)) * log(max(without, 1e-300) / max(with_it, 1e-300))
        spans.append((float(motion.time[inside[0]]), float(motion.time[inside[-1]])))
    p = _chance(nats, len(spans))
    return Prediction(1 - after / max(before, 1e-300), p, tuple(spans))


def _chance(nats: float, events: int) -> float:
    """p of several events from −ln of the product of theirs; 1 without an event."""
    return float(gammaincc(events, max(nats, 0.0))) if events else 1.0


def _joined(places: NDArray[np.intp], gap: int) -> list[NDArray[np.intp]]:
    """Samples in groups that are more than ``gap`` samples apart."""
    return np.split(places, np.flatnonzero(np.diff(places) > gap) + 1) if len(places) else []


def _independent_values(residual: Array, every: int) -> float:
    """Number of independent values of a residual in an event, of two in a period of the cutoff; at least 1."""
    return max(1.0, independent(correlation(residual[::every])) * len(residual) / every)


@dataclass(frozen=True)
class Event:
    """The period of the cutoff with the largest residual on a coordinate.

    Attributes:
        start, stop: its times, s, with the neighbouring periods that are as far above the usual.
        size: RMS residual. over_drive: the same over the RMS drive force. over_usual: over that of the median period.
    """

    start: float
    stop: float
    size: float
    over_drive: float
    over_usual: float


def largest_event(problem: Problem, system: System, i: int) -> Event | None:
    """The largest event of the residual of coordinate i that is far above the usual and the material; None without one.

    Periods in which the velocity changes its sign are left out: there friction whose sign changes one sample early
    leaves a large residual.
    """
    motion = problem.motion
    sizes, usual, drive = _by_period(problem, residual_at_drive(system, motion)[:, i], system, i)
    k = int(np.argmax(sizes))
    if not _is_event(sizes[k], usual, drive):
        return None
    size, width = float(sizes[k]), max(2, motion.step(1))
    event = next(e for e in _joined(np.flatnonzero(sizes >= FAR_ABOVE * usual), width) if e[0] <= k <= e[-1])
    start, stop = (float(motion.time[place]) for place in (event[0], event[-1]))
    half = 0.5 * width * motion.sample_time
    return Event(start - half, stop + half, size, size / drive, size / max(usual, 1e-300))


def events_of(problem: Problem) -> tuple[int, ...]:
    """The middle sample of each event of the declared model, friction levels refitted, ascending."""
    motion, system, found = problem.motion, problem.system, set[int]()
    for i, residual in enumerate(residual_without_levels(problem, system).T):
        sizes, usual, drive = _by_period(problem, residual, system, i)
        if _is_event(float(sizes.max()), usual, drive):
            far = np.flatnonzero((sizes >= FAR_ABOVE * usual) & (sizes >= OF_DRIVE * drive))
            found |= {int(e[len(e) // 2]) for e in _joined(far, max(2, motion.step(1)))}
    return tuple(sorted(found))


def _is_event(size: float, usual: float, drive: float) -> bool:
    return size >= FAR_ABOVE * usual and size >= OF_DRIVE * drive > 0


def _by_period(problem: Problem, residual: Array, system: System, i: int) -> tuple[Array, float, float]:
    """(N,) RMS of a residual of coordinate i in the period of the cutoff about each sample; the median; the RMS drive.

    The RMS is zero where not all of the period is used or where it has a reversal; all is zero if little is left.
    """
    motion, rows = problem.motion, problem.used[:, i]
    width = max(2, motion.step(1))
    turns = np.abs(np.diff(np.sign(motion.velocities[:, i]), prepend=0.0)) > 0
    used = rows & (_moving_sum(turns.astype(float), 2 * width + 1) < 0.5)
    whole = _moving_sum(used.astype(float), width) > width - 0.5
    if whole.sum() < LEAST_ROWS:
        return np.zeros(len(rows)), 0.0, 0.0
    sizes = np.sqrt(np.maximum(_moving_sum(np.where(used, residual, 0.0) ** 2, width), 0.0) / width) * whole
    return sizes, float(np.median(sizes[whole])), rms(acting_force(system, motion)[rows, i])


def _moving_sum(values: Array, width: int) -> Array:
    """(N,) sum over ``width`` samples about each, also where ``width`` is above N."""
    return np.asarray(np.convolve(values, np.ones(width))[(width - 1) // 2 :][: len(values)])
