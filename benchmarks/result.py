"""What a row of the page says: figures of each peer, goals met or missed, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.counting import Count
from benchmarks.timing import Times

OURS = "stiction"


@dataclass(frozen=True)
class Entry:
    """One peer in a row.

    Attributes:
        count, times: instructions and nanoseconds a step, where they were measured.
        difference: the largest relative difference of its outputs from ours.
        note: why there is nothing, or what it is.
    """

    name: str
    count: Count | None = None
    times: Times | None = None
    difference: float | None = None
    note: str = ""

    @property
    def instructions(self) -> float | None:
        return self.count.instructions if self.count else None


@dataclass(frozen=True)
class Goal:
    """A figure that was set, and what was reached.

    Attributes:
        text: the goal in words.
        reached: the figure, or None where it cannot be measured here.
        limit: that it must not pass.
        least: whether it must not stay below the limit instead.
        unit: behind the figure.
        basis: what the figure is a ratio of.
    """

    text: str
    reached: float | None
    limit: float
    least: bool = False
    unit: str = "×"
    basis: str = "instructions"

    @property
    def verdict(self) -> str:
        if self.reached is None:
            return "not available"
        met = self.reached >= self.limit if self.least else self.reached <= self.limit
        return "met" if met else "**missed**"


@dataclass(frozen=True)
class Table:
    """Any further table: its head and its rows, already in words."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Row:
    """One row of the list of benchmarks.

    Attributes:
        title, about: what is measured and how.
        entries: ours first.
        goals: in order.
        notes: where the time goes, and what is missing.
        tables: beside that of the entries.
    """

    title: str
    about: str
    entries: tuple[Entry, ...] = ()
    goals: tuple[Goal, ...] = ()
    notes: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()


def ratio(entries: Sequence[Entry], *peers: str, times: bool = False) -> float | None:
    """Ours over the best of the named peers, by instructions or by median time; None where either is missing."""

    def figure(entry: Entry) -> float | None:
        return (entry.times.median if entry.times else None) if times else entry.instructions

    ours = next((figure(e) for e in entries if e.name == OURS), None)
    theirs = [value for e in entries if e.name in peers and (value := figure(e)) is not None]
    return ours / min(theirs) if ours is not None and theirs else None


def where_it_goes(entry: Entry, most: int = 6) -> str:
    """The functions in which an entry's instructions are spent."""
    if entry.count is None:
        return f"{entry.name}: not counted"
    parts = [f"`{name}` {value:.0f}" for name, value in list(entry.count.parts.items())[:most]]
    return f"{entry.name}, instructions a step by function: {', '.join(parts)}"
