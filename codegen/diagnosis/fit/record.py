"""A motion divided into short segments for free-run simulation, and the noise of its positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label
from scipy.signal import butter, filtfilt

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.diagnosis.fit.signals import LEAST_WINDOW, NOISE_WINDOWS, Motion
from codegen.logs import Log

Indices = NDArray[np.int32]

STEPS_PER_PERIOD = 50
"""Time steps in a period of the coarse cutoff."""
KEPT = 40
"""Most averages of the residual for each segment."""
PERIODS = 5.0
"""Length of a segment in periods of the cutoff, which shows a wrong force and allows a correction of the start."""
LEAST_SAMPLES = 12
EDGE_S = 0.2
STILL = 0.02
"""A segment whose speed stays below this share of the 95 % speed is not used."""
LEAST_SEGMENTS = 12
SHORTENED = (1.0, 0.8, 0.64, 0.5, 0.4)
"""Shares of the usual segment length, tried in turn where a short log has too few segments: down to two periods. At a
share of 0.32 two of six start–stop logs at 25 Hz, 16 samples a segment, were given a wrong effect."""
COUNTED = 0.5
"""Share of the usual segment length below which the counts of ``reliability`` do not hold."""
MOST_STEPS, PLENTY = 40_000, 120
"""Most time steps of all segments, which are spread over the log, unless these are fewer than ``PLENTY``."""
DENSE = 2
"""A record with more steps than that keeps one row in k: this times ``STEPS_PER_PERIOD`` rows in a period at least."""
JITTERS = 10.0
"""Ratio of the noise near the Nyquist frequency to the stated noise from which on it is jitter and no fast motion."""
A_RECORD = 3
"""Segments in a record of median length, if an experiment consists of several."""


class TooFewStretches(BadInput):
    """A log with too few stretches in motion; ``count``: how many it has."""

    def __init__(self, where: str, found: str, expected: str, count: int) -> None:
        super().__init__(where, found, expected, code="LOG009")
        self.count = count


@dataclass(frozen=True, eq=False)
class Record:
    """The data of a log that free-run simulation needs, in SI.

    Attributes:
        measured: (N, n) raw positions.
        positions, velocities: (N, n) smoothed, for start states.
        commands: (N, m), held from t_k to t_(k+1).
        noise: (n,) standard deviation of the noise of ``compared``.
        start: (S,) first samples of the segments.
        joints: of an arm that is simulated joint by joint, the compared joints, each a row of its own in every segment;
            None if the coordinates of a segment are compared together.
        integrated: (n,) whether the positions are the integral of the measured speed; empty for none.
        resumed: samples at which the data resume after a gap of the log, ascending.
        every: rows of the log in one of the record.
    """

    measured: Array
    positions: Array
    velocities: Array
    commands: Array
    sample_time: float
    noise: Array
    start: Indices
    length: int
    joints: tuple[int, ...] | None = None
    integrated: tuple[bool, ...] = ()
    resumed: tuple[int, ...] = ()
    every: int = 1

    @cached_property
    def targets(self) -> Array:
        """(S, L, n) measured positions of each segment, or (S joints, L, 1)."""
        return self.by_row(np.asarray(self.measured[self.start[:, None] + np.arange(self.length)]))

    def by_row(self, positions: Array) -> Array:
        """Positions (S, L, n) as rows (S joints, L, 1), if joints are compared."""
        if self.joints is None:
            return positions
        chosen = positions[..., list(self.joints)].transpose(0, 2, 1)
        return np.ascontiguousarray(chosen.reshape(-1, chosen.shape[2], 1))

    def of_segments(self, offsets: Array) -> Array:
        """Start-state offsets of the rows as (S, 2n)."""
        if self.joints is None:
            return offsets
        n, at = self.measured.shape[1], list(self.joints)
        rows = offsets.reshape(len(self.start), len(at), 2)
        states = np.zeros((len(self.start), 2 * n))
        states[:, at], states[:, [n + i for i in at]] = rows[..., 0], rows[..., 1]
        return states

    def thinned(self, every: int) -> Record:
        """One row in so many, with the mean of the inputs from one to the next: their impulse stays what it was.

        The noise of an integrated speed, a random walk, is that of so many steps.
        """
        count = len(self.measured) // every
        rows = slice(0, count * every, every)
        walks = np.array(self.integrated or (False,) * len(self.noise))
        return replace(
            self,
            measured=self.measured[rows],
            positions=self.positions[rows],
            velocities=self.velocities[rows],
            commands=_means(self.commands, every),
            sample_time=self.sample_time * every,
            noise=np.where(walks, np.sqrt(every), 1.0) * self.noise,
            start=self.start // every,
            length=self.length // every,
            resumed=tuple(-(-first // every) for first in self.resumed),
            every=self.every * every,
        )

    def steps(self, per_period: int, cutoff_hz: float) -> tuple[int, int]:
        """(rows in a time step, time steps in a row) of at least so many time steps in a period of the cutoff."""
        rows = min(int(1 / (per_period * cutoff_hz * self.sample_time) + 1e-9), self.length // LEAST_SAMPLES)
        return max(1, rows), substeps_of(self.sample_time, cutoff_hz, per_period)

    def with_inputs(self, commands: Array) -> Record:
        """The record with other inputs, (N, m) of all rows of the log; of a thinned one, with their means."""
        return replace(self, commands=_means(commands, self.every))

    def of_starts(self, values: Array) -> Array:
        """(n,) values for the rows, (1, n) or (S joints, 1)."""
        return values[None] if self.joints is None else np.tile(values[list(self.joints)], len(self.start))[:, None]

    @cached_property
    def top_speed(self) -> Array:
        """(n,) 95 % speeds."""
        return np.asarray(np.quantile(np.abs(self.velocities), 0.95, axis=0))

    def compared(self, positions: Array) -> Array:
        """Signals with white noise from positions (S, L, n): the positions, or the steps of an integrated speed."""
        if not any(self.integrated):
            return positions
        rows = self.of_starts(np.array(self.integrated, dtype=float))[:, None] > 0
        return np.where(rows, np.diff(positions, axis=1, prepend=positions[:, :1]), positions)

    @property
    def group(self) -> int:
        """Samples whose mean error is one residual of a fit."""
        return max(1, self.length // KEPT)

    @cached_property
    def mean_targets(self) -> Array:
        """The targets as by ``means``."""
        return self.means(self.targets)

    def means(self, positions: Array) -> Array:
        """Means of ``compared`` of positions (S, L, n) over groups of samples, (S, L // group, n)."""
        group, (rows, length, n) = self.group, positions.shape
        kept = length // group
        with np.errstate(over="ignore", invalid="ignore"):  # a run may diverge
            cut = self.compared(positions)[:, : kept * group]
            # A matrix product takes a tenth of the time of numpy's mean over an inner axis, but spreads NaN.
            found = cut.reshape(rows * kept, group * n) @ _averaging(group, n)
            if not np.isfinite(found).all():
                return np.asarray(cut.reshape(rows, kept, group, n).mean(axis=2))
        return np.asarray(found.reshape(rows, kept, n))

    @property
    def at_rest(self) -> Array:
        """Offsets of zero for all rows."""
        segments, n = len(self.start), self.measured.shape[1]
        return np.zeros((segments, 2 * n) if self.joints is None else (segments * len(self.joints), 2))

    @cached_property
    def states(self) -> Array:
        """(S, 2n) smoothed states at the starts."""
        return np.hstack([self.positions[self.start], self.velocities[self.start]])


def _means(values: Array, every: int) -> Array:
    """(N // every, m) means of values (N, m) over so many rows."""
    count = len(values) // every
    return np.asarray(values[: count * every].reshape(count, every, -1).mean(axis=1))


@lru_cache
def _averaging(group: int, n: int) -> Array:
    """(group n, n): the mean of rows (group, n), written one after the other, as a matrix product."""
    return np.tile(np.eye(n) / group, (group, 1))


def record_of(motion: Motion, log: Log, shorter: float = 1.0, events: Sequence[int] = ()) -> Record:
    """The record of a motion: segments of equal length in motion, thinned where the log is dense.

    Each segment starts at a fast sample nearby, since a run that starts at rest may stick; between two of them up to
    half a length may be left out.

    Args:
        shorter: factor on the usual length of a segment.
        events: samples in events of the force balance. A segment is added about each that lies in no other one: an
            effect that acts there alone would not be seen.

    Raises:
        BadInput: if too few segments move, even ``SHORTENED``, times the factor ``shorter``.
    """
    h, count, usable = motion.sample_time, len(motion.time), _away_from_gaps(motion, log)
    length = _usual_length(motion, shorter)
    stretches = [(0, count)]
    if log.joints:  # records that may each be short: segments lie within them
        stretches = [(one.start, one.stop) for (one,) in find_objects(label(usable)[0])]
        usual = round(float(np.median([stop - start for start, stop in stretches]))) if stretches else length
        length = max(LEAST_SAMPLES, min(length, usual // A_RECORD))
    for share in SHORTENED:
        tried = max(LEAST_SAMPLES, round(share * length))
        starts = _starts(motion, usable, stretches, tried)
        if len(starts) >= LEAST_SEGMENTS:
            break
    else:
        found = f"{len(starts)} stretch{'es' * (len(starts) != 1)} of {tried * h:.2g} s in motion"
        expected = (
            f"at least {LEAST_SEGMENTS}, each of {SHORTENED[-1] * PERIODS:g} periods or more of the cutoff of "
            f"{motion.cutoff_hz:.3g} Hz, so that friction in slip can be seen"
        )
        raise TooFewStretches(log.where, found, expected, len(starts))
    steps = tried * substeps_of(h, motion.cutoff_hz)
    most = max(PLENTY, MOST_STEPS // steps)
    if len(starts) > most:
        starts = [starts[k] for k in np.linspace(0, len(starts) - 1, most).round().astype(int)]
    starts = _with_events(starts, events, usable, stretches, tried)
    along = motion.measured, motion.positions, motion.velocities, motion.commands
    record = Record(
        *along,
        h,
        position_noise(motion, log),
        np.array(starts, dtype=np.int32),
        tried,
        integrated=motion.integrated,
        resumed=tuple(stop for _, stop in log.gaps),
    )
    every = min(len(starts) * tried // MOST_STEPS, int(1 / (DENSE * STEPS_PER_PERIOD * motion.cutoff_hz * h) + 1e-9))
    return record.thinned(every) if every > 1 else record


def _away_from_gaps(motion: Motion, log: Log) -> NDArray[np.bool_]:
    """(N,) whether each sample is at least a period of the cutoff away from the gaps of the log."""
    usable = np.ones(len(motion.time), dtype=bool)
    reach = round(1 / (motion.cutoff_hz * motion.sample_time))
    for start, stop in log.gaps:
        usable[max(0, start - reach) : stop + reach] = False
    return usable


def _with_events(
    starts: list[int], events: Sequence[int], usable: NDArray[np.bool_], stretches: list[tuple[int, int]], length: int
) -> list[int]:
    """The starts with one of a segment about each event that lies in no segment, if its samples are usable."""
    for k in events:
        first = min(max(k - length // 2, 0), len(usable) - length)
        within = any(start <= first and first + length <= stop for start, stop in stretches)
        if within and usable[first : first + length].all() and not any(s <= k < s + length for s in starts):
            starts = sorted([*starts, first])
    return starts


def substeps_of(sample_time: float, cutoff_hz: float, per_period: int = STEPS_PER_PERIOD) -> int:
    """Time steps in a sample, at least so many in a period of the cutoff."""
    return max(1, int(np.ceil(sample_time * per_period * cutoff_hz)))


def is_shortened(record: Record, motion: Motion) -> bool:
    """Whether the segments are shorter than ``COUNTED`` of the usual length."""
    return record.every * record.length < round(COUNTED * _usual_length(motion))


def _usual_length(motion: Motion, shorter: float = 1.0) -> int:
    """Samples of ``PERIODS`` of the cutoff, times a factor."""
    return max(LEAST_SAMPLES, round(shorter * PERIODS / (motion.cutoff_hz * motion.sample_time)))


def _starts(motion: Motion, usable: NDArray[np.bool_], stretches: list[tuple[int, int]], length: int) -> list[int]:
    """First samples of segments (``length`` samples each), each within one of the ``stretches`` [start, stop).

    Of places ``length`` apart, one is skipped until as many samples were logged since the last as a segment has. The
    start is the sample within a quarter of the length about the place at which the slowest coordinate, relative to its
    95 % speed, is fastest. A segment that touches a gap or has no motion is left out.
    """
    h, count = motion.sample_time, len(motion.time)
    speed = np.abs(motion.velocities)
    top = np.quantile(speed, 0.95, axis=0)
    share = speed / np.where(top > 0, top, 1.0)
    edge = min(round(EDGE_S / h), count // 20)
    reach, starts = length // 4, []
    logged = np.arange(count + 1) if motion.counted is None else np.concatenate([[0], np.cumsum(motion.counted)])
    for first, last in stretches:
        taken = logged[first]
        for k in range(max(first, edge) + reach, min(last, count - edge) - length - reach, length):
            if logged[k + length] - taken < length:
                continue
            taken = logged[k + length]
            start = k - reach + int(np.argmax(share[k - reach : k + reach + 1].min(axis=1)))
            if usable[start : start + length].all() and share[start : start + length].max() > STILL:
                starts.append(start)
    return starts


def position_noise(motion: Motion, log: Log) -> Array:
    """(n,) standard deviation of the positions: from the log's description, else estimated above the fine filter.

    Of an integrated speed, that of its steps from row to row; with jitter of the time stamps, near the Nyquist
    frequency.
    """
    walks = np.array(motion.integrated or (False,) * motion.measured.shape[1])
    seen = motion.noise * np.where(walks, motion.sample_time, 1.0)
    step = np.array(log.encoder_step or log.raw_data.smallest_step or (0.0,) * len(seen)) / np.sqrt(12)
    stated = np.hypot(step, np.array(log.description.position_noise_rms or (0.0,) * len(seen)))
    fastest = _fastest_noise(motion.measured)
    stated = np.where(fastest > JITTERS * stated, fastest, stated) * ((stated > 0) & ~walks)
    size = np.ptp(motion.measured, axis=0)
    return np.asarray(np.where(stated > 0, stated, np.maximum(seen, 1e-9 * np.where(size > 0, size, 1.0))))


def _fastest_noise(measured: Array) -> Array:
    """(n,) deviation of white noise above two fifths of the sample rate: the median over windows, without impacts."""
    windows = min(NOISE_WINDOWS, max(1, len(measured) // LEAST_WINDOW))
    b, a = butter(4, 0.8, "high")
    above = filtfilt(b, a, measured, axis=0)
    deviations = [np.std(part, axis=0) for part in np.array_split(above, windows)]
    return np.asarray(np.median(deviations, axis=0) / np.sqrt(0.2))
