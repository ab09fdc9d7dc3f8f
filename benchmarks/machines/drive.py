"""A servo drive: cascaded P–PI loops on a quantised encoder, and what it records of its own current."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.machines.plant import Plant

CONTROL_S = 1e-3
SPEED_FILTER_S = 1.5e-3
"""Time constant of the low-pass of the differentiated encoder."""


@dataclass(frozen=True)
class Recorder:
    """How the log of a drive is recorded.

    Attributes:
        every: control periods in a row. encoder: step of each position. measured: whether the current is measured, or
            else commanded. filter_s: low-pass of a measured current. late: rows by which it is written late.
        noise, resolution: of the current, A. loop_s: time constant of the current loop.
    """

    every: int
    encoder: tuple[float, ...]
    measured: bool
    filter_s: float
    late: int
    noise: float
    resolution: float
    loop_s: float


@dataclass(frozen=True)
class Record:
    """A run: rows by axes, as logged and as they are without quantisation and noise."""

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    i: NDArray[np.float64]
    clean_x: NDArray[np.float64]
    clean_i: NDArray[np.float64]


def run(
    rng: np.random.Generator,
    plant: Plant,
    goals: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    recorder: Recorder,
    bandwidth_hz: float,
    limits: Sequence[float],
) -> Record:
    """Drive a plant along references, one (position, speed) an axis; those of an axis without a drive are not used.

    Args:
        bandwidth_hz: of the speed loop. limits: of the currents, A.
    """
    # A commanded current is the drive's set point, which changes once a row; a measured one is sampled.
    period = CONTROL_S * (1 if recorder.measured else recorder.every)
    stride = round(period / CONTROL_S)
    axes = range(len(plant.family.axes))
    driven = [k for k in axes if plant.family.axes[k].driven]
    mass = plant.family.mass(plant.values, plant.x, math)
    omega = 2 * math.pi * bandwidth_hz
    gain = [mass[k] * omega / plant.factors[k] if k in driven else 0.0 for k in axes]
    integral, speed, before = [0.0] * len(axes), [0.0] * len(axes), list(plant.x)
    alpha = 1 - math.exp(-period / SPEED_FILTER_S)
    settle = 1 - math.exp(-period / recorder.loop_s)
    filtered = 1 - math.exp(-period / recorder.filter_s) if recorder.filter_s else 1.0
    acting, sensed = [0.0] * len(axes), [0.0] * len(axes)
    rows: list[tuple[list[float], list[float], list[float], list[float]]] = []
    for n in range(0, len(goals[driven[0]][0]), stride):
        clean = plant.measured()
        seen = [math.floor(c / e + 0.5) * e for c, e in zip(clean, recorder.encoder, strict=True)]
        command = [0.0] * len(axes)
        for k in driven:
            speed[k] += alpha * ((seen[k] - before[k]) / period - speed[k])
            wanted, rate = goals[k]
            error = rate[n] + omega / 5 * (wanted[n] - seen[k]) - speed[k]
            integral[k] += period * omega / 5 * error
            free = gain[k] * (error + integral[k])
            command[k] = min(max(free, -limits[k]), limits[k])
            if command[k] != free:
                integral[k] -= period * omega / 5 * error
        before = seen
        # The current loop acts before and within the period; its mean over the period is what moves the machine.
        acting = [a + settle * (c - a) for a, c in zip(acting, command, strict=True)]
        if n % recorder.every == 0:
            rows.append((clean, seen, list(command), list(sensed)))
        plant.advance(acting, period)
        sensed = [s + filtered * (a - s) for s, a in zip(sensed, acting, strict=True)]
    x_clean, x_seen, commanded, measured = (np.array(column) for column in zip(*rows, strict=True))
    logged = measured if recorder.measured else commanded
    noisy = logged + (recorder.noise * rng.standard_normal(logged.shape) if recorder.measured else 0.0)
    noisy = np.round(noisy / recorder.resolution) * recorder.resolution
    if recorder.late:
        noisy = np.vstack([noisy[:1]] * recorder.late + [noisy[: -recorder.late]])
    t = np.arange(len(rows)) * CONTROL_S * recorder.every
    return Record(t, x_seen, noisy, x_clean, logged)
