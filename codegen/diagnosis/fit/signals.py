"""Filters of a log: a smooth motion, and one low-pass for every term of the force balance.

Two zero-phase Butterworth filters: a fine one for positions, velocities and accelerations, and a coarse one for every
term of the force balance alike, so that no term leads or lags another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.logs import Log

ORDER = 4
FINE_TO_COARSE, MOST_FINE = 2.5, 0.4
"""Fine cutoff over the coarse one, and its largest value over the sample rate."""
TRIM_S = 1.0
SHORTEST_S = 4.0
SHORTEST_TEST_S = 3.0
"""Least duration, s, of a log on which models are only compared; after trimming its ends it holds two free runs."""
IMPLAUSIBLE_STEP = 1e-5
"""Sample time, s, below which a log that is too short was probably read in another unit of time."""
CUTOFFS_HZ = (20.0, 14.0, 10.0, 7.0, 5.0, 3.5, 2.5)
"""Default cutoff: the highest of these, at most a tenth of the sample rate, with little noise."""
NOISE_WINDOWS, LEAST_WINDOW, MOST_FREQUENCY = 40, 100, 0.47
"""Estimate of a speed's noise: number of windows, least samples in one, highest frequency over the sample rate."""
NOISE_SHARE = 0.05
"""Largest share of noise in the low-passed acceleration, or of that in M a in the drive force, on every coordinate."""
FASTER_HZ = (80.0, 56.0, 40.0, 28.0)
"""Cutoffs for a motion that is mostly above the usual ones, such as a motor's cogging at speed."""
A_TENTH = 0.1
"""Highest default cutoff over the sample rate: two central differences keep 88 % of an acceleration there, and 41 % at
a quarter. With 0.14 and 0.18, short logs at 25 and 20 Hz without an effect were ``ambiguous``."""
SLOW_CLOCK = 0.01
"""Error of a logger's clock that lowers no cutoff: at 100 Hz, with steps of 10.001 ms, 10 Hz is a tenth of the rate."""
FINER_SHARE = 0.05
"""Largest cutoff of ``Motion.finer`` over the sample rate: up to it, central differences and means of neighbouring
inputs attenuate by less than 4 %."""
MOSTLY_HELD = 0.5
"""Share of the rows in motion that repeat the one before from which on readings are held, as of a slow bus."""
MOSTLY_FASTER = 0.5
"""A faster cutoff is taken if the usual one loses more than this share of the squared acceleration, or of an input's
square."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The smoothed motion of one log on its uniform grid of N samples, in SI.

    Attributes:
        positions, velocities, accelerations: (N, n), low-passed at the fine cutoff.
        inputs: (N, m), at t_k the mean of the values held before and after.
        cutoff_hz, fine_hz: cutoffs of the coarse and of the fine filter.
        usable: (N,) samples away from the ends and from gaps.
        counted: (N,) samples that were logged, where the grid is finer than the log; None where all were.
        integrated: (n,) whether a position is the integral of a measured speed; empty if none is.
        held: s for which the log repeats each reading in motion, if that is two rows or more; else 0.
    """

    time: Array
    positions: Array
    velocities: Array
    accelerations: Array
    inputs: Array
    commands: Array
    sample_time: float
    cutoff_hz: float
    fine_hz: float
    usable: NDArray[np.bool_]
    measured: Array
    counted: NDArray[np.bool_] | None = None
    integrated: tuple[bool, ...] = ()
    held: float = 0.0

    @cached_property
    def finer(self) -> Motion:
        """The motion with the coarse cutoff as high as the fine one; itself where the samples are too far apart."""
        cutoff = min(self.fine_hz, FINER_SHARE / self.sample_time)
        if cutoff <= self.cutoff_hz:
            return self
        fine = min(FINE_TO_COARSE * cutoff, MOST_FINE / self.sample_time)
        positions = low_pass(self.measured, fine, self.sample_time)
        velocities = central_difference(positions, self.sample_time)
        accelerations = central_difference(velocities, self.sample_time)
        return replace(
            self,
            positions=positions,
            velocities=velocities,
            accelerations=accelerations,
            cutoff_hz=cutoff,
            fine_hz=fine,
        )

    @cached_property
    def noise(self) -> Array:
        """(n,) standard deviation of the white noise of what was measured: of the positions, or of the speed."""
        return white_noise(self.measured, self.positions, self.fine_hz, self.sample_time, self.integrated, self.usable)

    def noise_after(self, cutoff_hz: float, order: int) -> Array:
        """(n,) RMS due to that noise in the low-passed derivative of the position of this order."""
        return derivative_noise(self.noise, cutoff_hz, self.sample_time, order, self.integrated)

    def low_pass(self, signals: Array) -> Array:
        """The coarse filter along the first axis."""
        return low_pass(signals, self.cutoff_hz, self.sample_time)

    def step(self, samples: float) -> int:
        """Distance, in samples of the log, of ``samples`` points in a period of the coarse cutoff; at least 1."""
        return max(1, int(1 / (samples * self.cutoff_hz * self.sample_time)))


def low_pass(signals: Array, cutoff_hz: float, sample_time: float) -> Array:
    """Fourth-order Butterworth filter forward and backward: zero phase, −6 dB at the cutoff."""
    b, a = _butterworth(min(2 * cutoff_hz * sample_time, 0.95))
    filtered = np.zeros(signals.shape)
    nonzero = signals.any(axis=0)  # of an effect on an arm, the columns of most joints are zero
    filtered[..., nonzero] = filtfilt(
        b, a, signals[..., nonzero], axis=0, padlen=min(len(signals) - 1, 3 * max(len(a), len(b)) * 8)
    )
    return filtered


@lru_cache(maxsize=16)
def _butterworth(share: float) -> tuple[Array, Array]:
    """Numerator and denominator of the filter with its cutoff at this share of the Nyquist frequency."""
    b, a = butter(ORDER, share)
    return b, a


def is_resolved(period: float, x: Array, v: Array, used: NDArray[np.bool_], cutoff_hz: float) -> bool:
    """Whether a motion (N,) covers a spatial period somewhere so slowly that |v|/period is below the cutoff."""
    slow = used & (np.abs(v) <= cutoff_hz * period)
    first = np.flatnonzero(slow & ~np.concatenate([[False], slow[:-1]]))
    if not len(first):
        return False
    low = np.minimum.reduceat(np.where(slow, x, np.inf), first)
    high = np.maximum.reduceat(np.where(slow, x, -np.inf), first)
    return bool((high - low).max() >= period)


def smooth_motion(log: Log, cutoff_hz: float | None = None, shortest_s: float = SHORTEST_S) -> Motion:
    """Filter and differentiate a log of uniform samples.

    Args:
        cutoff_hz: of the coarse filter; by default the log's own, else as high as the noise of the positions allows.

    Raises:
        BadInput: if the log is too short to filter and to split into blocks.
    """
    h = log.sample_time
    if log.used * h < shortest_s - h / 2 or log.used < 200:  # half a sample, since the step is estimated
        found = f"{log.used} samples over {log.used * h:.4g} s{log.raw_data.time_unit}"
        expected = f"at least {shortest_s:g} s and 200 samples for a diagnosis"
        if h < IMPLAUSIBLE_STEP:
            expected += f"; a sample every {h:.3g} s is faster than drives are logged: is t in another unit?"
        raise BadInput(log.where, found, expected, code="LOG009")
    integrated = log.raw_data.integrated
    coarse = cutoff_hz or log.cutoff_hz or quiet_cutoff(log.positions, h, integrated)
    fine = min(FINE_TO_COARSE * coarse, MOST_FINE / h)
    positions = low_pass(log.positions, fine, h)
    velocities = central_difference(positions, h)
    accelerations = central_difference(velocities, h)
    before = np.vstack([log.inputs[:1], log.inputs[:-1]])
    usable = np.ones(log.size, dtype=bool)
    stated = log.description.evaluation.trim_s
    cut = min(round((TRIM_S if stated is None else stated) / h), log.size // 10)
    usable[:cut] = usable[log.size - cut :] = False
    for start, stop in log.gaps:
        reach = round(1 / (coarse * h))
        usable[max(0, start - reach) : stop + reach] = False
    return Motion(
        time=log.time,
        positions=positions,
        velocities=velocities,
        accelerations=accelerations,
        inputs=(before + log.inputs) / 2,
        commands=log.inputs,
        sample_time=h,
        cutoff_hz=coarse,
        fine_hz=fine,
        usable=usable,
        measured=log.positions,
        counted=log.counted,
        integrated=integrated,
        held=h / (1 - log.raw_data.stale) if MOSTLY_HELD <= log.raw_data.stale < 1 else 0.0,
    )


def white_noise(
    measured: Array,
    smooth: Array,
    cutoff_hz: float,
    h: float,
    integrated: Sequence[bool] = (),
    rows: NDArray[np.bool_] | slice = slice(None),
) -> Array:
    """(n,) standard deviation of the white measurement noise: of the positions, or of a speed where that was measured.

    Of positions it is σ(measured − smooth)/√(1 − 2fh), since the low-pass at f keeps the share 2fh of the noise's
    power. A position that is the integral of a speed has as differences the means of two neighbouring speeds, with the
    share cos²(πν) of the noise's power at the frequency ν/h.

    Args:
        measured, smooth: (N, n) positions, raw and low-passed at this cutoff.
    """
    above = measured - smooth
    noise = np.std(above[rows], axis=0) / np.sqrt(max(0.05, 1 - 2 * cutoff_hz * h))
    if any(integrated):
        steps = np.diff(measured, axis=0, prepend=measured[:1])[rows] / h
        noise = np.where(integrated, _white_speed(steps, min(cutoff_hz * h, 0.4)), noise)
    return np.asarray(noise)


def _white_speed(steps: Array, above: float) -> Array:
    """(n,) standard deviation of the white noise of a speed, from means of two neighbouring speeds (N, n).

    The root of the median over ln 2 of the spectral density, over windows and frequencies above a share of the sample
    rate; unlike the mean it does not depend on a vibration or an impact.
    """
    length = max(LEAST_WINDOW, len(steps) // NOISE_WINDOWS)
    starts = range(0, max(1, len(steps) - length + 1), length)
    windows = np.stack([steps[k : k + length] for k in starts])
    tapered = windows - windows.mean(axis=1, keepdims=True)
    taper = np.hanning(tapered.shape[1])[:, None]
    power = np.abs(np.fft.rfft(tapered * taper, axis=1)) ** 2 / np.sum(taper**2)
    frequency = np.fft.rfftfreq(tapered.shape[1])
    used = (frequency > above) & (frequency < MOST_FREQUENCY)
    density = power[:, used] / (np.cos(np.pi * frequency[used]) ** 2)[:, None]
    return np.asarray(np.sqrt(np.median(density, axis=(0, 1)) / np.log(2)))


def derivative_noise(noise: Array, cutoff_hz: float, h: float, order: int, integrated: Sequence[bool] = ()) -> Array:
    """(n,) RMS of white measurement noise of standard deviation σ in a derivative of low-passed positions.

    It is σ (2πf)ᵏ √(2fh/(2k + 1)), f the cutoff and k the order of the derivative of the measured signal: ``order`` for
    a position, one less for a measured speed.
    """
    k = order - np.array(integrated or (False,) * len(noise), dtype=float)
    return np.asarray(noise * (2 * np.pi * cutoff_hz) ** k * np.sqrt(2 * cutoff_hz * h / (2 * k + 1)))


def is_within_rate(cutoff_hz: float, h: float) -> bool:
    """Whether a cutoff is at most ``A_TENTH`` of the sample rate 1/h, of which the clock is known to ``SLOW_CLOCK``."""
    return cutoff_hz * h <= A_TENTH * (1 + SLOW_CLOCK)


def quiet_cutoff(positions: Array, h: float, integrated: Sequence[bool] = ()) -> float:
    """The highest cutoff in Hz at which the acceleration is mostly motion, not white noise; seldom above 20 Hz."""
    noise = white_noise(positions, low_pass(positions, 0.2 / h, h), 0.2 / h, h, integrated)

    def quiet(cutoffs: Sequence[float]) -> tuple[float, Array] | None:
        for cutoff in cutoffs:
            if not is_within_rate(cutoff, h):
                continue
            smooth = low_pass(positions, cutoff, h)
            acceleration = np.std(central_difference(central_difference(smooth, h), h), axis=0)
            if np.all(derivative_noise(noise, cutoff, h, 2, integrated) <= NOISE_SHARE * acceleration):
                return cutoff, acceleration
        return None

    usual = quiet(CUTOFFS_HZ)
    if usual is None:
        return min(CUTOFFS_HZ[-1], 0.1 / h)
    faster = quiet(FASTER_HZ)
    if faster is not None and np.any(usual[1] ** 2 < MOSTLY_FASTER * faster[1] ** 2):
        return faster[0]
    return usual[0]


def central_difference(signals: Array, h: float) -> Array:
    """(x[k+1] − x[k−1]) / 2h; one-sided at the ends."""
    return np.asarray(np.gradient(signals, h, axis=0))
