"""What a row of the page says: figures of each peer, goals met or missed, and why."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from benchmarks.measure.counting import Count
from benchmarks.measure.timing import Times

OURS = "stiction"
SPENT = 5
"""Functions that are named with their instructions."""


@dataclass(frozen=True)
class Entry:
    """One peer in a row.

    Attributes:
        count, times: instructions and nanoseconds a step, where they were measured.
        difference: the largest relative difference of its outputs from ours.
        note: why there is nothing, or what it is.
        ours: whether the entries from here to the next such one are compared with this one; the first always is.
    """

    name: str
    count: Count | None = None
    times: Times | None = None
    difference: float | None = None
    note: str = ""
    ours: bool = False

    @property
    def instructions(self) -> float | None:
        return self.count.instructions if self.count else None


@dataclass(frozen=True)
class Goal:
    """A figure that was set, and what was reached.

    Attributes:
        text: the goal in words.
        reached: the figure; infinite if the work did not end, None where it cannot be measured here.
        limit: what it must not pass.
        least: whether it must not stay below the limit instead.
        unit: behind the figure.
        basis: what the figure is a ratio of.
        digits: behind the point.
    """

    text: str
    reached: float | None
    limit: float
    least: bool = False
    unit: str = "×"
    basis: str = "instructions"
    digits: int = 2

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
        key: the name of its module, by which the command knows it, and of its template.
        title: what is measured.
        entries: ours first.
        goals: in order.
        tables: further ones, after that of the entries.
        facts: what the template says more.
    """

    key: str
    title: str
    entries: tuple[Entry, ...] = ()
    goals: tuple[Goal, ...] = ()
    tables: tuple[Table, ...] = ()
    facts: Mapping[str, str | list[str] | list[dict[str, str]]] = field(default_factory=dict)


def ratio(entries: Sequence[Entry], *peers: str, ours: str = OURS) -> float | None:
    """Ours over the best of the named peers in instructions; None where either was not counted."""
    own = next((e.instructions for e in entries if e.name == ours), None)
    theirs = [e.instructions for e in entries if e.name in peers and e.instructions is not None]
    return own / min(theirs) if own is not None and theirs else None


def where_it_goes(entry: Entry) -> str:
    """The functions in which an entry's instructions are spent."""
    if entry.count is None:
        return f"{entry.name}: not counted"
    parts = [f"`{_bare(name)}` {value:.0f}" for name, value in list(entry.count.parts.items())[:SPENT]]
    more = len(entry.count.parts) - SPENT
    return f"{entry.name}, instructions a step by function: {', '.join(parts)}{f', {more} more' if more > 0 else ''}"


def _bare(name: str) -> str:
    """A function's name without the types that C++ hangs on it."""
    return name.split("(")[0].split("<")[0].split(" ")[-1]


def figure(value: float | None, digits: int = 2) -> str:
    """A number for a table; a dash where there is none."""
    if value is None:
        return "–"
    return "∞" if math.isinf(value) else f"{value:.{digits}f}"
