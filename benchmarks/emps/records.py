"""The two records of EMPS: what trains, what tests, and how a run over each starts."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import read_log
from codegen.spec import Spec

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data" / "emps"
RECORDS = {"training": "DATA_EMPS.mat", "test": "DATA_EMPS_PULSES.mat"}
FREE_SAMPLES = 20
"""By the package nonlinear-benchmarks (``state_initialization_window_length``): for the start state, and not scored."""
EVERY = 5
"""Samples over which the command is averaged for a fit, which takes one position of them."""


@dataclass(frozen=True, eq=False)
class Measured:
    """One record.

    Attributes:
        position, velocity: (N,) low-passed, for the start of a run in a fit. measured: (N,) as logged, m.
        command: (N,) V, held from t_k to t_(k+1). sample_time: s.
    """

    position: Array
    velocity: Array
    measured: Array
    command: Array
    sample_time: float

    def __len__(self) -> int:
        return len(self.measured)

    def runs(self, start: int, stop: int, seconds: float | None) -> Record:
        """Runs over a stretch for a fit, one behind the other, each so long; or one over all of it."""
        length = (stop - start if seconds is None else min(round(seconds / self.sample_time), stop - start)) // EVERY
        count = (stop - start) // (length * EVERY)
        stretch = slice(start, start + count * length * EVERY)
        command = self.command[stretch].reshape(-1, EVERY).mean(axis=1)
        thin = [x[stretch][::EVERY, None] for x in (self.measured, self.position, self.velocity)]
        starts = np.arange(count, dtype=np.int32) * length
        return Record(*thin, command[:, None], EVERY * self.sample_time, np.ones(1), starts, length)

    def free_run(self, start: int = 0, stop: int | None = None) -> Record:
        """One run over a stretch, from the state that its first ``FREE_SAMPLES`` samples give."""
        stretch = slice(start, stop)
        measured, command = self.measured[stretch, None], self.command[stretch, None]
        position, velocity = start_state(measured[:, 0], self.sample_time)
        first = [np.full_like(measured, value) for value in (position, velocity)]
        return Record(
            measured, *first, command, self.sample_time, np.ones(1), np.zeros(1, dtype=np.int32), len(measured)
        )


def start_state(measured: Array, sample_time: float) -> tuple[float, float]:
    """Position and speed at the first sample, by a parabola through the first ``FREE_SAMPLES`` and no other."""
    _, speed, position = np.polyfit(np.arange(FREE_SAMPLES) * sample_time, measured[:FREE_SAMPLES], 2)
    return float(position), float(speed)


def blocks(count: int, size: int) -> list[tuple[int, int]]:
    """(start, stop) of each of ``count`` equal parts of a record of this size."""
    edges = [k * size // count for k in range(count + 1)]
    return list(pairwise(edges))


def without(block: tuple[int, int], size: int) -> list[tuple[int, int]]:
    """The stretches of a record before and behind a block."""
    return [(a, b) for a, b in ((0, block[0]), (block[1], size)) if b > a]


def read(spec: Spec, name: str) -> Measured:
    """A record by its name in ``RECORDS``."""
    motion = smooth_motion(read_log(DATA / RECORDS[name], spec))
    columns = (motion.positions, motion.velocities, motion.measured, motion.commands)
    return Measured(*(np.ascontiguousarray(c[:, 0]) for c in columns), motion.sample_time)
