"""Input rows that visit every branch: reversals, standing, chatter, saturation, huge values, NaN and infinity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .interface import Interface

PERIODS = (997.0, 257.3, 61.1)
"""Of the swings that a motion is made of, in samples."""


@dataclass(frozen=True)
class Channel:
    """An input of the observer.

    Attributes:
        kind: ``position``, ``velocity`` or ``input``.
        most: speed of the coordinate that the certificate speaks for, or what the drive saturates at.
        rest: where the motion begins.
    """

    kind: str
    most: float
    rest: float = 0.0


@dataclass(frozen=True)
class Excitation:
    """What drives an observer: its inputs in order, the sample time, and the range of its reals."""

    channels: tuple[Channel, ...]
    sample_time: float
    dtype: np.dtype


def ordinary(excitation: Excitation, samples: int, seed: int = 1) -> np.ndarray:
    """Motion that reverses, stands, chatters about zero and saturates, a quarter of the samples each."""
    random = np.random.default_rng(seed)
    part = np.minimum(np.arange(samples) // max(1, samples // 4), 3)
    rows = np.zeros((samples, len(excitation.channels)))
    tiny = float(np.finfo(excitation.dtype).tiny)
    for column, channel in enumerate(excitation.channels):
        swing, drive = _swing(random, samples), _swing(random, samples)
        velocity = np.select(
            [part == 0, part == 1, part == 2],
            [swing, np.zeros(samples), random.choice([-1e-9, 0.0, -0.0, 1e-9], size=samples)],
            np.sign(swing),
        )
        if channel.kind == "position":
            # every second encoder counts in steps
            step = channel.most * excitation.sample_time / 8 if column % 2 else 0.0
            position = channel.rest + np.cumsum(channel.most * velocity) * excitation.sample_time
            rows[:, column] = np.round(position / step) * step if step else position
        elif channel.kind == "velocity":
            rows[:, column] = channel.most * velocity
        else:
            rows[:, column] = channel.most * np.clip(3 * drive, -1.0, 1.0)
            rows[part == 1, column] *= random.choice([0.0, -0.0, tiny], size=int(np.sum(part == 1)))
    return rows.astype(excitation.dtype)


def huge(excitation: Excitation, samples: int, seed: int = 2) -> np.ndarray:
    """Ordinary motion among finite values up to the largest that there is, and subnormal ones."""
    random = np.random.default_rng(seed)
    rows = ordinary(excitation, samples, seed)
    kind = np.finfo(excitation.dtype)
    most = float(kind.max) / 1e8  # 1e300 in double precision
    values = [most, -most, float(kind.max), -float(kind.max), most**0.5, -(most**0.3), float(kind.tiny) / 8, -0.0]
    at = random.random(rows.shape) < 0.005
    rows[at] = random.choice(values, size=int(np.sum(at)))
    return rows


def broken(excitation: Excitation, samples: int, seed: int = 3) -> np.ndarray:
    """Ordinary motion in which one sensor of a sample is NaN or infinite now and then; never at the first sample."""
    random = np.random.default_rng(seed)
    rows = ordinary(excitation, samples, seed)
    at = np.flatnonzero(random.random(samples) < 0.05)
    at = at[at > 0]
    rows[at, random.integers(rows.shape[1], size=len(at))] = random.choice([np.nan, np.inf, -np.inf], size=len(at))
    return rows


def broken_at_first(excitation: Excitation, samples: int) -> np.ndarray:
    """No sensor works at the init and for a few samples after it."""
    rows = ordinary(excitation, samples, 4)
    rows[: min(5, samples)] = np.nan
    return rows


def hostile(excitation: Excitation, samples: int, seed: int = 6) -> np.ndarray:
    """What no sensor gives: any bits at all, subnormal numbers, the ends of the range, and runs of lost samples.

    A quarter of the samples each of: random bit patterns throughout; ordinary motion in which whole stretches of a
    sample to fifty are NaN or infinite; numbers among the smallest that there are; and signs, zeros and extremes in
    turn from one sample to the next.
    """
    random = np.random.default_rng(seed)
    each, width, kind = samples // 4, len(excitation.channels), np.finfo(excitation.dtype)
    bits = random.integers(0, 256, size=(each, width * excitation.dtype.itemsize), dtype=np.uint8).view(
        excitation.dtype
    )
    lost = ordinary(excitation, each, seed)
    for start in np.flatnonzero(random.random(each) < 0.02):
        stretch = slice(start, start + random.integers(1, 50))
        columns = random.random(width) < random.choice([0.5, 1.0])
        lost[stretch, columns] = random.choice([np.nan, np.inf, -np.inf])
    tiny = random.normal(size=(each, width)) * float(kind.smallest_subnormal) * random.choice([1, 1e3, 1e6], (each, 1))
    ends = [float(kind.max), -float(kind.max), float(kind.tiny), -float(kind.smallest_subnormal), 0.0, -0.0, 1.0, -1.0]
    extremes = random.choice(ends, size=(samples - 3 * each, width))
    return np.concatenate([bits, lost, tiny.astype(excitation.dtype), extremes.astype(excitation.dtype)])


def has_fault_policy(face: Interface) -> bool:
    """Whether the outputs have the flag of the sensor fault policy."""
    return any(member.name == "fault" for member in face.outputs)


def episodes(face: Interface, excitation: Excitation, samples: int) -> list[np.ndarray]:
    """All of the above, each beginning with an init.

    Seven eighths are one ordinary run; the rest is short episodes, as one huge value can spoil all that follows.
    """
    run = [ordinary(excitation, samples - samples // 8)]
    if has_fault_policy(face):
        each = samples // 64
        for k in range(3):
            run += [huge(excitation, each, 100 + k), broken(excitation, each, 200 + k)]
        run += [broken_at_first(excitation, samples - sum(map(len, run)))]
    return run


def _swing(random: np.random.Generator, samples: int) -> np.ndarray:
    """A smooth motion of several periods that reverses, within ±1."""
    total = np.zeros(samples)
    for period in PERIODS:
        total += np.sin(2 * np.pi * (np.arange(samples) / period + random.random()))
    return total / len(PERIODS)
