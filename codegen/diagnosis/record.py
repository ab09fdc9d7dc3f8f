"""A motion divided into short segments for free-run simulation, and the noise of its positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from codegen.base.errors import BadInput
from codegen.diagnosis.shooting import STEPS_PER_PERIOD, Record
from codegen.diagnosis.signals import Motion
from codegen.logs import Log

Array = NDArray[np.float64]

PERIODS = 5.0
"""Length of a segment in periods of the coarse cutoff: long enough to show a wrong force, short enough to correct a
wrong start."""
LEAST_SAMPLES = 12
EDGE_S = 0.2
STILL = 0.02
"""A segment whose speed stays below this share of the 95 % speed is not used."""
LEAST_SEGMENTS = 12
SHORTENED = (1.0, 0.8, 0.64, 0.5)
"""Shares of the usual segment length, tried in turn where a short log has too few segments."""
MOST_STEPS, PLENTY = 40_000, 120
"""Most time steps of all segments, unless there are fewer segments than ``PLENTY``; the kept segments are spread
over the log."""
NOISE_WINDOWS, LEAST_WINDOW = 40, 100
"""Windows in which the noise near the Nyquist frequency is looked at, and the fewest samples of one."""
JITTERS = 3.0
"""Noise near the Nyquist frequency over the stated one from which on the stated one is not believed."""
A_RECORD = 3
"""Segments in a record of usual length, where an experiment consists of several."""


def record_of(motion: Motion, log: Log, shorter: float = 1.0) -> Record:
    """Segments of a motion, each starting at a fast sample nearby, since a run that starts at rest may stay stuck.

    Args:
        shorter: factor on the length of the segments.

    Raises:
        BadInput: if fewer than twelve segments move, of half the usual length too.
    """
    h, count = motion.sample_time, len(motion.time)
    usable = _near_data(motion, log)
    length = max(LEAST_SAMPLES, round(shorter * PERIODS / (motion.cutoff_hz * h)))
    stretches = [(0, count)]
    if log.joints:  # records that may each be short: segments lie within them
        stretches = _runs(usable)
        usual = round(float(np.median([stop - start for start, stop in stretches]))) if stretches else length
        length = max(LEAST_SAMPLES, min(length, usual // A_RECORD))
    found = ""
    for share in SHORTENED:
        tried = max(LEAST_SAMPLES, round(share * length))
        starts = _starts(motion, usable, stretches, tried)
        if len(starts) >= LEAST_SEGMENTS:
            break
        found = found or f"{len(starts)} stretches of {tried * h:.2g} s in motion"
    else:
        raise BadInput(
            log.where, found, f"at least {LEAST_SEGMENTS}, so that friction in slip can be seen", code="LOG009"
        )
    steps = tried * max(1, int(np.ceil(h * STEPS_PER_PERIOD * motion.cutoff_hz)))
    starts = _evenly(starts, max(PLENTY, MOST_STEPS // steps))
    return Record(
        motion.measured,
        motion.positions,
        motion.velocities,
        motion.commands,
        h,
        0.0,
        position_noise(motion, log),
        np.array(starts, dtype=np.int32),
        tried,
    )


def _evenly(starts: list[int], most: int) -> list[int]:
    """At most so many of them, evenly spread."""
    if len(starts) <= most:
        return starts
    return [starts[k] for k in np.linspace(0, len(starts) - 1, most).round().astype(int)]


def _starts(motion: Motion, usable: NDArray[np.bool_], stretches: list[tuple[int, int]], length: int) -> list[int]:
    """Start samples of segments of ``length`` samples within one stretch each, where the machine moves fastest nearby.

    A log resampled on a finer grid gets only as many segments as its own samples fill.
    """
    h, count = motion.sample_time, len(motion.time)
    speed = np.abs(motion.velocities)
    top = np.quantile(speed, 0.95, axis=0)
    share = speed / np.where(top > 0, top, 1.0)
    edge = min(round(EDGE_S / h), count // 20)
    reach, starts = length // 4, []
    own = np.arange(count + 1) if motion.counted is None else np.concatenate([[0], np.cumsum(motion.counted)])
    for first, last in stretches:
        taken = own[first]
        for k in range(max(first, edge) + reach, min(last, count - edge) - length - reach, length):
            if own[k + length] - taken < length:
                continue
            taken = own[k + length]
            start = k - reach + int(np.argmax(share[k - reach : k + reach + 1].min(axis=1)))
            if usable[start : start + length].all() and share[start : start + length].max() > STILL:
                starts.append(start)
    return starts


def position_noise(motion: Motion, log: Log) -> Array:
    """(n,) standard deviation of the positions: from the log's description, else estimated above the fine filter.

    Where stamps jitter, the positions scatter by speed times jitter, far more than an encoder's step. That shows near
    the Nyquist frequency, where no motion of a mass is left; what is seen there counts where it is ``JITTERS`` times
    the stated noise.
    """
    above = np.std((motion.measured - motion.positions)[motion.usable], axis=0)
    seen = above / np.sqrt(max(0.05, 1 - 2 * motion.fine_hz * motion.sample_time))
    step = np.array(log.encoder_step or log.intake.smallest_step or (0.0,) * len(seen)) / np.sqrt(12)
    stated = np.hypot(step, np.array(log.description.position_noise or (0.0,) * len(seen)))
    fastest = _fastest_noise(motion.measured)
    stated = np.where(fastest > JITTERS * stated, fastest, stated) * (stated > 0)
    size = np.ptp(motion.measured, axis=0)
    return np.asarray(np.where(stated > 0, stated, np.maximum(seen, 1e-9 * np.where(size > 0, size, 1.0))))


def _fastest_noise(measured: Array) -> Array:
    """(n,) standard deviation of white noise that the positions show above two fifths of the sample rate.

    The median over windows, so that single impacts and gaps do not count.
    """
    windows = min(NOISE_WINDOWS, max(1, len(measured) // LEAST_WINDOW))
    b, a = butter(4, 0.8, "high")
    above = filtfilt(b, a, measured, axis=0)
    deviations = [np.std(part, axis=0) for part in np.array_split(above, windows)]
    return np.asarray(np.median(deviations, axis=0) / np.sqrt(0.2))


def _near_data(motion: Motion, log: Log) -> NDArray[np.bool_]:
    near = np.ones(len(motion.time), dtype=bool)
    reach = round(1 / (motion.cutoff_hz * motion.sample_time))
    for start, stop in log.gaps:
        near[max(0, start - reach) : stop + reach] = False
    return near


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Half-open index ranges of true values in (N,) flags."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
