"""Peers of one step → the entries of a row: built, held to ours, counted, timed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.measure.build import Built, Missing, Peer, build, difference, outputs_of
from benchmarks.measure.counting import count
from benchmarks.measure.timing import times_of
from benchmarks.result import Entry

TOLERANCE = 1e-9

Candidate = tuple[str, Callable[[], Peer]]
"""A peer's name, and what makes it; the maker raises Missing where it cannot."""


def compare(candidates: Sequence[Candidate], rows: np.ndarray, counted: bool = True) -> list[Entry]:
    """Entries in the order of the candidates; the first is ours, against which the others are checked.

    A peer that is missing, or computes something else, is an entry that says so.
    """
    with tempfile.TemporaryDirectory(prefix="stiction-benchmark-") as name:
        folder = Path(name)
        table = folder / "rows"
        table.write_bytes(np.ascontiguousarray(rows, dtype=float).tobytes())
        built: dict[str, Built] = {}
        off: dict[str, float] = {}
        notes: dict[str, str] = {}
        reference: np.ndarray | None = None
        for index, (title, make) in enumerate(candidates):
            try:
                peer = build(make(), folder / str(index))
            except Missing as missing:
                notes[title] = str(missing)
                continue
            found = outputs_of(peer, table)
            reference = found if reference is None else reference
            off[title] = difference(reference, found)
            if off[title] > TOLERANCE:
                notes[title] = f"computes something else: outputs differ by {off[title]:.1e}"
            else:
                built[title] = peer
        counts = {title: count(b, table, len(rows)) for title, b in built.items()} if counted else {}
        times = times_of(built, table, len(rows))
    return [
        Entry(title, counts.get(title), times.get(title), off.get(title), notes.get(title, ""))
        for title, _ in candidates
    ]
