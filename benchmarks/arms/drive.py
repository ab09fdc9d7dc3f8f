"""Motion of an arm under its drives, and the log that they write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from benchmarks.arms.plant import STEP, Array, Plant
from benchmarks.arms.robots import Joint

WAVES, FASTEST = 4, 0.7
"""Sines of a joint's reference, and the highest of their frequencies, Hz."""
BANDWIDTH, CASCADE = 2 * np.pi * 4.0, (12.0, 60.0, 8.0)
"""rad/s, of a PD loop; of a cascade the position gain 1/s, the bandwidth of the velocity loop and its integral 1/s."""
SMOOTHED = 0.3
"""Share of a new difference of positions in the estimate of a velocity."""


@dataclass(frozen=True)
class Drives:
    """How an arm is driven and recorded.

    Attributes:
        loop: PD with gravity compensation, or a velocity loop (PI) under a position loop (P); gains and compensation
            by the data sheet. control: rate of the loops in Hz. log: of the rows, a divisor of it. seconds: of a log.
    """

    loop: Literal["pd", "cascade"]
    control: int
    log: int
    seconds: float


class Reference:
    """Sums of sines within each joint's reach, that rise in the first second."""

    def __init__(self, joints: tuple[Joint, ...], random: np.random.Generator) -> None:
        shape = len(joints), WAVES
        self._rates = 2 * np.pi * random.uniform(0.06, FASTEST, shape)
        self._phases = random.uniform(0, 2 * np.pi, shape)
        shares = random.uniform(0.5, 1.0, shape) / self._rates**0.5
        self._sizes = np.array([j.reach for j in joints])[:, None] * shares / shares.sum(axis=1, keepdims=True)
        self._middle = np.array([j.middle for j in joints])

    def at(self, t: float) -> tuple[Array, Array]:
        """Positions and velocities."""
        angle = self._rates * t + self._phases
        rise, slope = (0.5 - 0.5 * np.cos(np.pi * t), np.pi / 2 * np.sin(np.pi * t)) if t < 1 else (1.0, 0.0)
        swing = (self._sizes * np.sin(angle)).sum(axis=1)
        rate = (self._sizes * self._rates * np.cos(angle)).sum(axis=1)
        return self._middle + rise * swing, rise * rate + slope * swing


def record(plant: Plant, sheet: tuple[Joint, ...], drives: Drives, seed: int) -> Array:
    """Rows of t, encoder readings and measured forces of the drives; a row's forces act from its time on.

    Args:
        sheet: the joints by their data sheet, which is all that the drives know.
        seed: of the reference and the noise of the current sensors, as large as their steps.
    """
    random = np.random.default_rng(seed)
    reference, nominal = Reference(sheet, random), Plant(sheet)
    counts, torques = np.array([j.count for j in sheet]), np.array([j.torque for j in sheet])
    period, every = 1 / drives.control, drives.control // drives.log
    plant.start(reference.at(0.0)[0])
    nominal.start(plant.data.qpos)
    inertia = nominal.dynamics()[0].diagonal().copy()
    before, rows = np.round(plant.data.qpos / counts) * counts, []
    speed, sums = np.zeros((2, len(sheet)))
    for k in range(round(drives.seconds * drives.control)):
        t = k * period
        read = np.round(plant.data.qpos / counts) * counts
        speed += SMOOTHED * ((read - before) / period - speed)
        before = read
        wanted, rate = reference.at(t)
        nominal.start(read)
        w = nominal.dynamics()[1].copy()
        if drives.loop == "pd":
            w += inertia * BANDWIDTH * (BANDWIDTH * (wanted - read) + 1.4 * (rate - speed))
        else:
            error = CASCADE[0] * (wanted - read) + rate - speed
            sums += CASCADE[2] * period * error
            w += inertia * CASCADE[1] * (error + sums)
        if k % every == 0:
            measured = np.round((w + torques * random.standard_normal(len(sheet))) / torques) * torques
            rows.append(np.concatenate([[t], read, measured]))
        for _ in range(round(period / STEP)):
            plant.step(w)
    return np.array(rows)
