"""Velocity and acceleration from measured positions by a zero-phase low-pass; standstill and constant speeds."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.logs.log import Log

ORDER = 4
"""Order of the Butterworth filter."""
EDGE_PERIODS = 2.0
"""Periods of the cut-off after which a filter has settled."""
NOISE_FACTOR, SHARE_OF_TOP_SPEED = 5.0, 0.01
"""Threshold of motion: times the RMS velocity of the noise, and share of the top speed."""
DEFAULT_CUTOFF = 20.0
"""Default cutoff in Hz."""
SPREAD, OF_TOP = 0.15, 0.03
"""A record runs at constant speed if the standard deviation of its speed is at most the larger of these shares: of its
mean speed, and of the top speed."""
ONE_WAY = 2.0
"""Upper limit of that standard deviation in any case, as a share of the mean speed. Slow speeds that are read in coarse
steps reach it."""
MOSTLY = 0.8
"""Least share of the records that run at constant speed."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of a log's n coordinates, low-passed forwards and backwards.

    Attributes:
        positions, velocities, accelerations: (N, n), SI; as measured or zero where ``usable`` is false.
        usable: (N,) true away from gaps, ends and segments too short to filter.
        threshold: (n) speed, SI, below which motion cannot be distinguished from measurement noise.
        reversals: (n) changes of direction between speeds above the threshold.
        standstill: (n) share of the usable samples that are below the threshold.
    """

    cutoff_hz: float
    positions: Array
    velocities: Array
    accelerations: Array
    usable: Flags
    threshold: Array
    reversals: tuple[int, ...]
    standstill: tuple[float, ...]


def scaled(motion: Motion, j: int, factor: float) -> Motion:
    """The motion with one coordinate scaled by a factor."""
    by = np.ones(motion.positions.shape[1])
    by[j] = factor
    names = ("positions", "velocities", "accelerations", "threshold")
    return replace(motion, **{name: getattr(motion, name) * by for name in names})


def measured_motion(log: Log) -> Motion:
    """Differentiate a log's positions.

    The cut-off is the log's, or by default 20 Hz, at most a tenth of the sample rate.
    """
    cutoff = log.cutoff_hz or min(DEFAULT_CUTOFF, 0.1 / log.sample_time)
    smooth, usable = low_pass(log, log.positions, cutoff)
    velocities, accelerations = np.zeros_like(smooth), np.zeros_like(smooth)
    for start, stop in log.segments:
        if usable[start:stop].any():
            velocities[start:stop] = np.gradient(smooth[start:stop], log.sample_time, axis=0)
            accelerations[start:stop] = np.gradient(velocities[start:stop], log.sample_time, axis=0)
    threshold = _threshold(log, smooth, velocities, usable, cutoff)
    moving = np.abs(velocities) > threshold
    standstill = (
        tuple(float(x) for x in 1 - moving[usable].mean(axis=0)) if usable.any() else (1.0,) * log.positions.shape[1]
    )
    reversals = tuple(_reversals(log, velocities[:, j], moving[:, j] & usable) for j in range(log.positions.shape[1]))
    return Motion(cutoff, smooth, velocities, accelerations, usable, threshold, reversals, standstill)


def low_pass(log: Log, values: Array, cutoff_hz: float) -> tuple[Array, Flags]:
    """Filter every usable segment of values (N, c) forwards and backwards, with the cutoff below half the sample rate.

    Returns:
        (N, c) filtered values (as they were in gaps and short segments), and (N,) where they can be relied on: two
        periods of the cut-off away from the ends of a segment.
    """
    from scipy.signal import sosfiltfilt  # imported here: it takes a second, which verbs without a log do not need

    sections = _sections(cutoff_hz, log.sample_time)
    filtered, usable = values.copy(), np.zeros(log.size, dtype=np.bool_)
    edge = int(np.ceil(EDGE_PERIODS / (cutoff_hz * log.sample_time)))
    for start, stop in log.segments:
        if stop - start > max(3 * edge, 8 * ORDER):
            filtered[start:stop] = sosfiltfilt(sections, values[start:stop], axis=0)
            usable[start + edge : stop - edge] = True
    return filtered, usable


@lru_cache(maxsize=64)
def _sections(cutoff_hz: float, sample_time: float) -> Array:
    """(2, 6) second-order sections of the filter, not to be changed: their design takes longer than filtering."""
    from scipy.signal import butter

    return np.asarray(butter(ORDER, cutoff_hz, fs=1 / sample_time, output="sos"))


def _threshold(log: Log, smooth: Array, velocities: Array, usable: Flags, cutoff: float) -> Array:
    """(n) the largest of the speeds that noise or one encoder step pretends, and of one per cent of the top speed."""
    n = log.positions.shape[1]
    if not usable.any():
        return np.zeros(n)
    rate = 1 / log.sample_time
    noise = np.median(np.abs(log.positions - smooth)[usable], axis=0) / 0.6745
    through = 2 * np.pi * np.sqrt(2 * cutoff**3 / (3 * rate))  # white position noise → RMS velocity below the cut-off
    declared = log.encoder_step or (0.0,) * n
    seen = log.raw_data.smallest_step or (0.0,) * n
    step = np.array([a or b for a, b in zip(declared, seen, strict=True)])
    top: Array = np.percentile(np.abs(velocities[usable]), 99.5, axis=0)
    floor: Array = np.max([NOISE_FACTOR * through * noise, 2 * cutoff * step, SHARE_OF_TOP_SPEED * top], axis=0)
    return floor


def _reversals(log: Log, velocity: Array, moving: Flags) -> int:
    count = 0
    for start, stop in log.segments:
        signs = np.sign(velocity[start:stop][moving[start:stop]])
        count += int((signs[1:] != signs[:-1]).sum())
    return count


@dataclass(frozen=True)
class Steady:
    """A coordinate that runs at one constant speed in each of most records.

    Attributes:
        records, of: how many records run at constant speed, of how many that can be judged.
        slowest, fastest: mean speeds of these records, SI, signed.
    """

    coordinate: int
    records: int
    of: int
    slowest: float
    fastest: float


def steady_speeds(log: Log, velocities: Array, usable: Flags) -> list[Steady]:
    """The coordinates that run at constant speed in each of most records.

    Args:
        velocities: (N, n). usable: (N,) whether filters have settled.
    """
    found = []
    for j in range(log.positions.shape[1]):
        count = 0
        top = float(np.abs(velocities[usable, j]).max(initial=0.0))
        means: list[float] = []
        for start, stop in log.segments:
            speed = velocities[start:stop, j][usable[start:stop]]
            if not len(speed):
                continue
            count += 1
            if _is_constant(speed, top):
                means.append(float(speed.mean()))
        if means and len(means) >= MOSTLY * count:
            found.append(Steady(j, len(means), count, min(means), max(means)))
    return found


def steady_segments(log: Log, velocities: Array, usable: Flags) -> Flags:
    """(segments,) whether every coordinate runs at constant speed, of segments with usable samples; else True.

    ``velocities``, ``usable``: as of ``steady_speeds``.
    """
    tops = np.abs(velocities[usable]).max(axis=0, initial=0.0)
    runs = (velocities[start:stop][usable[start:stop]] for start, stop in log.segments)
    return np.array([not len(v) or all(map(_is_constant, v.T, tops)) for v in runs])


def _is_constant(speed: Array, top: float) -> bool:
    """Whether a speed (K,) of a coordinate with this top speed is constant."""
    mean, spread = float(speed.mean()), float(speed.std())
    return spread < ONE_WAY * abs(mean) and spread <= max(SPREAD * abs(mean), OF_TOP * top)
