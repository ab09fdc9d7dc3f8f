"""Nanoseconds a step: on one core, the peers in turn, the median and the least of the rounds."""

from __future__ import annotations

import os
import statistics
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.measure.build import Built

ROUNDS = 9
ROUND_SECONDS = 0.03


@dataclass(frozen=True)
class Times:
    """Nanoseconds a step."""

    median: float
    least: float


@contextmanager
def pinned() -> Iterator[None]:
    """A context that pins the process, and programs it starts, to one core, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def interleaved(rounds: Mapping[str, Callable[[], float]]) -> dict[str, Times]:
    """Times of several functions, each of which returns a time; they are called in turn, ``ROUNDS`` times."""
    found: dict[str, list[float]] = {name: [] for name in rounds}
    for _ in range(ROUNDS):
        for name, once in rounds.items():
            found[name].append(once())
    return {name: Times(statistics.median(values), min(values)) for name, values in found.items()}


def times_of(peers: Mapping[str, Built], rows: Path, samples: int) -> dict[str, Times]:
    """Nanoseconds a step of compiled peers."""

    def run(built: Built, passes: int) -> float:
        command = [str(built.program), "time", str(rows), str(passes)]
        return float(subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout)

    with pinned():
        passes = {name: max(1, round(1e9 * ROUND_SECONDS / samples / run(b, 2))) for name, b in peers.items()}
        return interleaved({name: partial(run, b, passes[name]) for name, b in peers.items()})
