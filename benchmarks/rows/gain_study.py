"""1000 sets of gains × 25,000 samples of the two masses: lanes against scalar C in one thread, and numba."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.measure.build import Missing
from benchmarks.measure.timing import Times, interleaved, pinned
from benchmarks.model import load
from benchmarks.peers.study import Study, gain_sets, in_c, in_numba, on_threads
from benchmarks.result import OURS, Goal, Row, Table, figure

SETS, SAMPLES = 1024, 25_000
"""A thousand, and what fills the lanes of every thread."""
TOLERANCE = {"double": 1e-9, "single": 1e-3}
LANES, THREADED = f"{OURS}, lanes", f"{OURS}, lanes in every core"
SCALAR, NUMBA = f"{OURS}, scalar C", "numba"
HEAD = ("", "precision", "cores", "median, s", "least, s", "times scalar C", "difference", "note")
THREADS = 1 << ((os.cpu_count() or 1).bit_length() - 1)
"""A power of two, as many as there are cores."""

Case = tuple[str, str, int]
"""Code, precision, threads."""


def makers(folder: Path) -> dict[Case, Callable[[], Study]]:
    """Case → the function that makes its study; scalar C in double first, then in single."""
    model = load("two_mass")
    return {
        (SCALAR, "double", 1): lambda: in_c(model, folder / "scalar", "scalar", "double"),
        (LANES, "double", 1): lambda: in_c(model, folder / "lanes", "lanes", "double"),
        (THREADED, "double", THREADS): lambda: on_threads(in_c(model, folder / "many", "lanes", "double"), THREADS),
        (NUMBA, "double", 1): in_numba,
        (SCALAR, "single", 1): lambda: in_c(model, folder / "scalar32", "scalar", "single"),
        (LANES, "single", 1): lambda: in_c(model, folder / "lanes32", "lanes", "single"),
    }


def once(study: Study, gains: np.ndarray, rows: np.ndarray, threads: int) -> float:
    """Seconds: of the processor on one core, by the clock on all."""
    clock = time.process_time if threads == 1 else time.perf_counter
    with pinned() if threads == 1 else nullcontext():
        start = clock()
        study(gains, rows)
        return clock() - start


def row() -> Row:
    gains, rows = gain_sets(SETS), load("two_mass").rows(SAMPLES)
    studies: dict[Case, Study] = {}
    notes: dict[Case, str] = {}
    off: dict[Case, float] = {}
    reference: dict[str, np.ndarray] = {}
    with tempfile.TemporaryDirectory(prefix="stiction-benchmark-") as name:
        made = makers(Path(name))
        for case, make in made.items():
            try:
                study = make()
            except Missing as missing:
                notes[case] = str(missing)
                continue
            found = study(gains, rows)
            first = reference.setdefault(case[1], found)
            off[case] = float(np.median(np.abs(found / first - 1)))
            if off[case] > TOLERANCE[case[1]]:
                notes[case] = "computes something else"
            else:
                studies[case] = study
        rounds = {str(case): partial(once, study, gains, rows, case[2]) for case, study in studies.items()}
        times = interleaved(rounds)
    return Row(
        "gain_study",
        "1000 sets of gains × 25,000 samples of the two masses",
        goals=(
            Goal(
                "lanes in one thread at least 15 times as fast as scalar C in one thread",
                speed(times, (LANES, "double", 1)),
                15.0,
                least=True,
                basis="median time",
                digits=1,
            ),
        ),
        tables=(Table(HEAD, tuple(cells(case, times, off, notes) for case in made)),),
    )


def speed(times: dict[str, Times], case: Case) -> float | None:
    """Speed as a multiple of that of scalar C in the same precision, by the medians."""
    own, scalar = times.get(str(case)), times.get(str((SCALAR, case[1], 1)))
    return None if own is None or scalar is None else scalar.median / own.median


def cells(case: Case, times: dict[str, Times], off: dict[Case, float], notes: dict[Case, str]) -> tuple[str, ...]:
    code, precision, threads = case
    own = times.get(str(case))
    seconds = (figure(own.median, 3), figure(own.least, 3)) if own else ("–", "–")
    difference = f"{off[case]:.0e}" if case in off else "–"
    return code, precision, str(threads), *seconds, figure(speed(times, case), 1), difference, notes.get(case, "")
