"""Columns that were sampled at times of their own → rows at common times, by an interpolation that is stated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.logs.description import LogDescription
from codegen.logs.log import Array, Flags
from codegen.logs.source import Columns, listing, shown

GAP_STEPS = 5.0
"""Times its median step, beyond which nothing is interpolated between two samples of a series."""
TIME = "t"
"""The column of the rows' time."""


@dataclass(frozen=True, eq=False)
class Series:
    """Samples of columns that share their times.

    Attributes:
        name: of the topic, group or channel.
        columns: (c) names.
        time: (N,) s.
        values: (N, c).
    """

    name: str
    columns: tuple[str, ...]
    time: Array
    values: Array


def check_held(description: LogDescription, names: Iterable[str]) -> None:
    """Refuse a topic or column under ``hold`` that there is not.

    Args:
        names: of the columns.

    Raises:
        BadInput: with the nearest name.
    """
    known = list(names)
    for name in description.hold:
        if not any(_of(column, name) for column in known):
            raise BadInput(
                description.place("hold"),
                f"`{shown(name)}`, which is no topic or column of the log",
                f"topics or columns, such as {listing(known, 5)}",
                nearest_name(name, known),
                code="LOG013",
            )


def joined(
    file: str, series: Sequence[Series], wanted: Sequence[str], description: LogDescription
) -> tuple[Columns, tuple[str, ...]]:
    """One row for each time of the series with the most samples in the span that all have.

    The others stand at these times by the line between their neighbours, or, under ``hold`` of the description, by the
    sample before. Rows in a gap of one of them are left out.

    Args:
        file: for messages.
        series: that hold the wanted columns; no column twice.
        wanted: the columns; ``t`` is the time, in s from the first row.

    Returns:
        the columns, and what was done in plain words.

    Raises:
        BadInput: for a series without samples, whose time runs backwards or is not finite, or no common span.
    """
    for one in series:
        _require_rising(file, one)
    start, stop = max(s.time[0] for s in series), min(s.time[-1] for s in series)
    if not start <= stop:
        first, last = max(series, key=lambda s: s.time[0]), min(series, key=lambda s: s.time[-1])
        found = f"no time at which both `{shown(first.name)}` and `{shown(last.name)}` were logged"
        expected = f"stamps of one clock; they are {first.time[0] - last.time[-1]:.6g} s apart"
        raise BadInput(Place(file), found, expected, code="LOG008")
    base = max(series, key=lambda s: int(((s.time >= start) & (s.time <= stop)).sum()))
    time = base.time[(base.time >= start) & (base.time <= stop)]
    found_columns: dict[str, Array] = {}
    kept = np.ones(len(time), dtype=bool)
    notes = []
    for one in series:
        if one is base:
            found_columns |= dict(zip(one.columns, one.values[(one.time >= start) & (one.time <= stop)].T, strict=True))
            continue
        before = np.clip(np.searchsorted(one.time, time, side="right") - 1, 0, len(one.time) - 1)
        gap = _in_gap(one, time, before)
        kept &= ~gap
        held = [c for c in one.columns if any(_of(c, name) for name in description.hold)]
        for column, values in zip(one.columns, one.values.T, strict=True):
            found_columns[column] = values[before] if column in held else np.interp(time, one.time, values)
        notes.append(_words(one, base, len(held), int(gap.sum())))
    if not kept.any():
        raise BadInput(
            Place(file),
            "every row lies in a gap of some topic",
            "topics that were logged at the same time",
            code="LOG008",
        )
    found_columns[TIME] = time - time[0]
    values = np.column_stack([found_columns[name] for name in wanted])
    return Columns(file, tuple(wanted), values[kept], None), tuple(notes)


def together(columns: Mapping[str, tuple[str, Array, Array]]) -> list[Series]:
    """Column → (series' name, times, values), grouped by times that are the same."""
    groups: list[tuple[str, Array, list[str], list[Array]]] = []
    for column, (name, time, values) in columns.items():
        for _, times, names, found in groups:
            if times is time or np.array_equal(times, time):
                names.append(column)
                found.append(values)
                break
        else:
            groups.append((name, time, [column], [values]))
    return [Series(name, tuple(names), time, np.column_stack(found)) for name, time, names, found in groups]


def _of(column: str, name: str) -> bool:
    return column == name or column.startswith((f"{name}.", f"{name}["))


def _require_rising(file: str, one: Series) -> None:
    place = Place(file, None, shown(one.name, 80))
    if not len(one.time):
        raise BadInput(place, "no sample", "at least one", code="LOG009")
    if not np.isfinite(one.time).all():
        raise BadInput(
            place, f"sample {int(np.argmin(np.isfinite(one.time))) + 1} without a time", "finite times", code="LOG007"
        )
    back = np.diff(one.time) < 0
    if back.any():
        k = int(np.argmax(back))
        found = f"time runs backwards after sample {k + 1}, by {one.time[k] - one.time[k + 1]:.6g} s"
        raise BadInput(place, found, "times that rise", code="LOG007")


def _in_gap(one: Series, time: Array, before: Array) -> Flags:
    """(N,) whether a time lies between two samples that are too far apart to say anything of it."""
    steps = np.diff(one.time)
    if not len(steps):
        return np.zeros(len(time), dtype=bool)
    after = np.minimum(before + 1, len(one.time) - 1)
    apart = one.time[after] - one.time[before]
    return np.asarray((apart > GAP_STEPS * np.median(steps)) & (time > one.time[before]), dtype=bool)


def _words(one: Series, base: Series, held: int, gap: int) -> str:
    how = "the value before" if held == len(one.columns) else "the line between neighbours"
    if 0 < held < len(one.columns):
        how = f"the line between neighbours, {held} of its columns by the value before"
    left = f"; {gap} rows in its gaps left out" if gap else ""
    return (
        f"`{shown(one.name)}` ({_rate(one)}) stands at the times of `{shown(base.name)}` ({_rate(base)}) by {how}{left}"
    )


def _rate(one: Series) -> str:
    steps = np.diff(one.time)
    step = float(np.median(steps)) if len(steps) else 0.0
    return f"{1 / step:.4g} Hz" if step > 0 else f"{len(one.time)} samples"
