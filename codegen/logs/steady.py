"""Records at constant speed: their detection, and the finding that says what such a log cannot show."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from codegen.logs.finding import Finding
from codegen.logs.log import Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

SPREAD, OF_TOP = 0.15, 0.03
"""A record runs at constant speed if the standard deviation of its speed is at most the larger of these shares: of its
mean speed, and of the top speed."""
ONE_WAY = 2.0
"""Upper limit of that standard deviation in any case, as a share of the mean speed. Slow speeds that are read in coarse
steps reach it."""
MOSTLY = 0.8
"""Least share of the records that run at constant speed."""


@dataclass(frozen=True)
class Steady:
    """A coordinate that runs at one constant speed in each of most records.

    Attributes:
        coordinate: its index.
        records, of: how many records run at constant speed, of how many that can be judged.
        slowest, fastest: mean speeds of these records, SI, signed.
    """

    coordinate: int
    records: int
    of: int
    slowest: float
    fastest: float


def steady_speeds(log: Log, motion: Motion) -> list[Steady]:
    """The coordinates that run at constant speed in each of most records."""
    found = []
    for j in range(log.positions.shape[1]):
        count = 0
        top = float(np.abs(motion.velocities[motion.usable, j]).max(initial=0.0))
        means: list[float] = []
        for start, stop in log.segments:
            speed = motion.velocities[start:stop, j][motion.usable[start:stop]]
            if not len(speed):
                continue
            count += 1
            mean, spread = float(speed.mean()), float(speed.std())
            if spread < ONE_WAY * abs(mean) and spread <= max(SPREAD * abs(mean), OF_TOP * top):
                means.append(mean)
        if means and len(means) >= MOSTLY * count:
            found.append(Steady(j, len(means), count, min(means), max(means)))
    return found


def audit_steady(steady: list[Steady], spec: Spec) -> Iterator[Finding]:
    """The finding on each such coordinate."""
    for one in steady:
        c = spec.coordinates[one.coordinate]
        unit = f"{c.unit}/s"
        speeds = f"at {one.slowest:.3g} {unit}"
        if one.records > 1:
            speeds = f"in {one.records} of its {one.of} records, from {one.slowest:.3g} to {one.fastest:.3g} {unit}"
        words = (
            f"{c.name} runs at constant speed, {speeds}. Such a log shows friction over speed and forces that repeat "
            "with position. It does not show inertia, delays and effects at reversals, and inertia is not judged."
        )
        figures = {
            "share": one.records / one.of,
            "records": float(one.records),
            "slowest": one.slowest,
            "fastest": one.fastest,
        }
        yield Finding("info", f"steady speeds of {c.name}", words, figures)
