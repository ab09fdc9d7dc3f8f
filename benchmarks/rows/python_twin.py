"""The Python twin, one step of the two masses: numpy, SymPy's lambdify, numba; stated, without a goal."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.measure.build import Missing, difference
from benchmarks.measure.compare import TOLERANCE
from benchmarks.measure.timing import interleaved, pinned
from benchmarks.model import Model, load
from benchmarks.peers import python_peers
from benchmarks.peers.python_peers import Run
from benchmarks.result import OURS, Entry, Row

PEERS: tuple[tuple[str, Callable[[Model], Run]], ...] = (
    (OURS, python_peers.twin),
    ("Python by hand, on floats", python_peers.floats),
    ("numpy, vectors", python_peers.vectors),
    ("SymPy `lambdify`, `cse`", python_peers.lambdified),
    ("numba, called at each step", python_peers.numba_step),
    ("numba, with the loop", python_peers.numba_loop),
)


def checked(model: Model, rows: np.ndarray) -> tuple[dict[str, Run], dict[str, str]]:
    """The peers that compute our numbers, and a note on each of the others."""
    runs: dict[str, Run] = {}
    notes: dict[str, str] = {}
    reference: np.ndarray | None = None
    for title, make in PEERS:
        try:
            run = make(model)
        except Missing as missing:
            notes[title] = str(missing)
            continue
        found = python_peers.as_table(run(rows), model.output_names)
        reference = found if reference is None else reference
        off = difference(reference, found)
        if off > TOLERANCE:
            notes[title] = f"computes something else: outputs differ by {off:.1e}"
        else:
            runs[title] = run
    return runs, notes


def row() -> Row:
    model = load("two_mass")
    rows = model.rows(2048)
    runs, notes = checked(model, rows)

    def once(run: Run) -> float:
        start = time.process_time()
        run(rows)
        return 1e9 * (time.process_time() - start) / len(rows)

    with pinned():
        times = interleaved({title: partial(once, run) for title, run in runs.items()})
    entries = [Entry(title, times=times.get(title), note=notes.get(title, "")) for title, _ in PEERS]
    return Row("python_twin", "Python twin, one step of the two masses", tuple(entries))
