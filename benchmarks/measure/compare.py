"""The entries of a row from the peers of one step: built, checked against ours, counted, timed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.measure.build import Missing, Peer, build, difference, outputs_of
from benchmarks.measure.counting import count
from benchmarks.measure.timing import times_of
from benchmarks.result import Entry

TOLERANCE = 1e-9
Made = TypeVar("Made")
Candidate = tuple[str, Callable[[], Peer]]
"""A peer's name, and what makes it; the maker raises Missing where it cannot."""


def checked(
    candidates: Sequence[tuple[str, Callable[[], Made]]], outputs: Callable[[Made], np.ndarray]
) -> tuple[dict[str, Made], dict[str, float], dict[str, str]]:
    """By name: the peers that compute what the first one does, the differences of all from it, and notes on the others.

    Args:
        outputs: what a peer computes, samples by outputs.
    """
    right: dict[str, Made] = {}
    off: dict[str, float] = {}
    notes: dict[str, str] = {}
    reference: np.ndarray | None = None
    for title, make in candidates:
        try:
            peer = make()
        except Missing as missing:
            notes[title] = str(missing)
            continue
        found = outputs(peer)
        reference = found if reference is None else reference
        off[title] = difference(reference, found)
        if off[title] > TOLERANCE:
            notes[title] = f"computes something else: outputs differ by {off[title]:.1e}"
        else:
            right[title] = peer
    return right, off, notes


def compare(candidates: Sequence[Candidate], rows: np.ndarray, counted: bool = True) -> list[Entry]:
    """Entries in the order of the candidates; the first is ours, against which the others are checked.

    A peer that is missing, or computes something else, is an entry that says so.
    """
    with tempfile.TemporaryDirectory(prefix="stiction-benchmark-") as name:
        folder = Path(name)
        table = folder / "rows"
        table.write_bytes(np.ascontiguousarray(rows, dtype=float).tobytes())
        makers = [
            (title, lambda make=make, k=k: build(make(), folder / str(k))) for k, (title, make) in enumerate(candidates)
        ]
        built, off, notes = checked(makers, lambda peer: outputs_of(peer, table))
        counts = {title: count(b, table, len(rows)) for title, b in built.items()} if counted else {}
        times = times_of(built, table, len(rows))
    return [
        Entry(title, counts.get(title), times.get(title), off.get(title), notes.get(title, ""))
        for title, _ in candidates
    ]
