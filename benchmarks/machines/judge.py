"""Whether a log shows what its machine lacks, by inverse dynamics with the true parameters; no diagnosis is asked.

With E(θ) = M a − position − motion − drive·i + a sgn v, the effect's force is what E of the true parameters leaves on
the log without quantisation and noise. The noise is what the logged values add to it. Least squares of the effect's
force on ∂E/∂θ of all parameters that may be refitted, and all levels, leaves what a refit without any prior cannot
take; its t-value is that remainder over the noise. Parameters of the drive are held: E is homogeneous in all of them
together. A current that is recorded late or filtered is no effect, so its rate is a column too, unless the effect is
a delay itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from benchmarks.machines.drive import Record
from benchmarks.machines.families import Family, Values

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array]
"""Positions, velocities and accelerations, rows by axes each."""
CUTOFF_HZ = 20.0
LEAST_SHARE, LEAST_LEFT, LEAST_T = 0.05, 0.02, 5.0
AT_REST = 0.02
"""Share of the top speed below which friction is set-valued, so rows are left out."""


@dataclass(frozen=True)
class Seen:
    """How much of an effect a log shows.

    Attributes:
        share: RMS of its force over that of the drive force, on the axis where that is largest.
        left: the same, after least squares on the derivatives of all parameters. t: of that remainder.
    """

    share: float
    left: float
    t: float

    @property
    def identifiable(self) -> bool:
        return self.share >= LEAST_SHARE and self.left >= LEAST_LEFT and self.t >= LEAST_T


def low_passed(values: Array, rate: float) -> Array:
    numerator, denominator = butter(2, CUTOFF_HZ, fs=rate)
    return np.asarray(filtfilt(numerator, denominator, values, axis=0))


def equation_error(family: Family, p: Values, levels: Array, motion: Motion, i: Array) -> Array:
    """The equation error E(θ), (rows, axes)."""
    x, v, a = (list(part.T) for part in motion)
    mass, rest, factors = family.mass(p, x, np), family.force(p, x, v, np), family.drive(p)
    terms = zip(mass, a, levels, v, rest, factors, i.T, strict=True)
    return np.stack([m * c + lvl * np.sign(b) - r - f * d for m, c, lvl, b, r, f, d in terms], axis=1)


def seen(
    family: Family, p: Values, levels: tuple[float, ...], log: Record, held: bool, refitted: Sequence[str], timed: bool
) -> Seen:
    """How much a log shows of the effects that its machine lacks.

    Args:
        held: whether a row's current acts until the next row: then it acts half a row later on average.
        refitted: parameters with a tolerance. timed: whether an effect is a delay.
    """
    dt = float(log.t[1] - log.t[0])
    rate = 1 / dt

    def motion(x: Array) -> Motion:
        smooth = low_passed(x, rate)
        v = np.gradient(smooth, dt, axis=0)
        return smooth, v, np.gradient(v, dt, axis=0)

    def current(i: Array) -> Array:
        means = (i + np.vstack([i[:1], i[:-1]])) / 2 if held else i
        return low_passed(means, rate)

    true, a = motion(log.clean_x), np.array(levels)
    i = current(log.clean_i)
    error = equation_error(family, p, a, true, i)
    noise = equation_error(family, p, a, motion(log.x), current(log.i)) - error
    force = np.sqrt(np.mean((error - equation_error(family, p, a, true, 0 * i)) ** 2, axis=0))
    masses = family.mass(p, list(true[0].T), np)
    inertial = np.array([_rms(mass * acceleration) for mass, acceleration in zip(masses, true[2].T, strict=True)])
    force = np.where(force > 0, force, inertial)
    moving = np.abs(true[1]) > AT_REST * np.abs(true[1]).max(axis=0)
    edge = round(1.0 / dt)
    moving[:edge], moving[-edge:] = False, False
    own = [name for name in refitted if family.drive({**p, name: 2 * p[name]}) == family.drive(p)]
    columns = [_slope(family, p, a, true, i, name) for name in own]
    for k in range(len(levels)):
        columns.append(_only(k, np.sign(true[1])))
        rate_k = _only(k, np.gradient(i, dt, axis=0))
        if not timed and np.any(rate_k):
            columns.append(rate_k)
            error = error - rate_k * (rate_k * error).sum() / (rate_k**2).sum()
    target = (error / force)[moving]
    regressors = np.stack([(c / force)[moving] for c in columns], axis=1)
    size = np.linalg.norm(regressors, axis=0)
    regressors = regressors[:, size > 0] / size[size > 0]
    left = target - regressors @ np.linalg.lstsq(regressors, target, rcond=1e-6)[0]
    noisy = (noise / force)[moving]
    rows = len(target) * min(1.0, 2 * CUTOFF_HZ * dt)
    share = max(_rms((error / force)[moving[:, k], k]) for k in range(len(levels)))
    return Seen(share, _rms(left), _rms(left) / _rms(noisy) * float(np.sqrt(rows)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _only(k: int, values: Array) -> Array:
    """The values of axis k, and zeros for the others."""
    found = np.zeros_like(values)
    found[:, k] = values[:, k]
    return found


def _slope(family: Family, p: Values, levels: Array, motion: Motion, i: Array, name: str) -> Array:
    """∂E/∂θ of one parameter, by central differences."""
    step = 1e-4 * abs(p[name])
    up, down = (equation_error(family, {**p, name: p[name] + s * step}, levels, motion, i) for s in (1, -1))
    return (up - down) / (2 * step)
