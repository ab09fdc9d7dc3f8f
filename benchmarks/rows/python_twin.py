"""The Python twin, one step of the two masses: numpy, SymPy's lambdify, numba; stated, without a goal."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from benchmarks.measure.compare import checked
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


def row() -> Row:
    model = load("two_mass")
    rows = model.rows(2048)
    makers = [(title, partial(make, model)) for title, make in PEERS]
    runs, _, notes = checked(makers, lambda run: python_peers.as_table(run(rows), model.output_names))

    def once(run: Run) -> float:
        start = time.process_time()
        run(rows)
        return 1e9 * (time.process_time() - start) / len(rows)

    with pinned():
        times = interleaved({title: partial(once, run) for title, run in runs.items()})
    entries = [Entry(title, times=times.get(title), note=notes.get(title, "")) for title, _ in PEERS]
    return Row("python_twin", "Python twin, one step of the two masses", tuple(entries))
