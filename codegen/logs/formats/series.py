"""Signals with different sample times, joined to rows at common times by interpolation."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.base.errors import BadInput, Place
from codegen.base.user_text import brief
from codegen.logs.description import LogDescription
from codegen.logs.formats.source import Columns, LogFile

GAP_STEPS = 5.0
"""Median steps of a series beyond which nothing is interpolated between two samples."""
TIME = "t"
"""The column of the rows' time."""


class Signal(NamedTuple):
    """One column: its source (a topic, a group, a file), (N,) times in s, (N,) values."""

    source: str
    time: Array
    values: Array


class SignalFile(LogFile):
    """A log of signals with different sample times; ``lengths``: column → number of values, or 0."""

    lengths: Mapping[str, int]

    @abstractmethod
    def signals(self, wanted: Sequence[str]) -> dict[str, Signal]:
        """The signals of some columns; an exception means a damaged file."""

    def set_columns(self, lengths: Mapping[str, int]) -> None:
        """Set the columns of the log; raises BadInput for no column."""
        if not lengths:
            why = next((f" ({brief(name, 80)}: {words})" for name, words in self.unread.items()), "")
            raise self.fault(f"no signal of numbers{why}")
        self.lengths, self.names = lengths, (TIME, *(name for name in lengths if name != TIME))

    def load(self, wanted: Sequence[str]) -> Columns:
        names = [name for name in wanted if name != TIME]
        self.take(16 * sum(self.lengths[name] for name in names))
        with self.reading():
            signals = self.signals(names)
        return joined(self, signals, wanted, TIME, from_first=True)


class ChannelFile(SignalFile):
    """A log whose columns are read one by one."""

    @abstractmethod
    def signal(self, name: str) -> Signal:
        """The signal of a column."""

    def signals(self, wanted: Sequence[str]) -> dict[str, Signal]:
        return {name: self.signal(name) for name in wanted}


def joined(
    log: LogFile,
    signals: Mapping[str, Signal],
    wanted: Sequence[str],
    clock: str = "",
    in_seconds: bool = True,
    from_first: bool = False,
) -> Columns:
    """The wanted columns of a log at common times, with a note; ``clock``: the column of the time, if any."""
    time, columns, notes = at_common_times(str(log.path), signals, log.description, in_seconds)
    log.own_notes += [note for note in notes if note not in log.own_notes]
    if clock:
        columns[clock] = time - time[0] if from_first else time
    return Columns(str(log.path), tuple(wanted), np.column_stack([columns[name] for name in wanted]))


def at_common_times(
    file: str, signals: Mapping[str, Signal], description: LogDescription, in_seconds: bool = True
) -> tuple[Array, dict[str, Array], tuple[str, ...]]:
    """Interpolate signals to the times of the one with the most samples in the common span.

    The others are interpolated linearly or, under ``hold`` of the description, by the sample before. Rows in a gap of
    one of them are left out.

    Args:
        signals: column → its signal.
        in_seconds: whether times are known to be in s; else the notes state numbers of samples and not rates.

    Returns:
        (N,) times, column → (N,) values, and notes in words, one for signals of one source.
    """
    given = list(signals.values())
    for signal in given:
        _require_rising(file, signal)
    start, stop = max(s.time[0] for s in given), min(s.time[-1] for s in given)
    if not start <= stop:
        first, last = max(given, key=lambda s: s.time[0]), min(given, key=lambda s: s.time[-1])
        found = f"no time at which both `{brief(first.source)}` and `{brief(last.source)}` were logged"
        expected = f"stamps of one clock; they are {first.time[0] - last.time[-1]:.6g} s apart"
        raise BadInput(Place(file), found, expected, code="LOG008")
    base = max(given, key=lambda s: int(((s.time >= start) & (s.time <= stop)).sum()))
    common = (base.time >= start) & (base.time <= stop)
    time = base.time[common]
    columns: dict[str, Array] = {}
    kept = np.ones(len(time), dtype=bool)
    notes: dict[str, None] = {}
    for column, signal in signals.items():
        if np.array_equal(signal.time, base.time):
            columns[column] = signal.values[common]
            continue
        before = np.clip(np.searchsorted(signal.time, time, side="right") - 1, 0, len(signal.time) - 1)
        gap = _in_gap(signal, time, before)
        kept &= ~gap
        held = any(is_part_of(column, name) for name in description.hold)
        columns[column] = signal.values[before] if held else np.interp(time, signal.time, signal.values)
        notes[_words(signal, base, held, int(gap.sum()), in_seconds)] = None
    if not kept.any():
        found, expected = "every row lies in a gap of some topic", "topics that were logged at the same time"
        raise BadInput(Place(file), found, expected, code="LOG008")
    return time[kept], {name: values[kept] for name, values in columns.items()}, tuple(notes)


def join_columns_by_time(
    raw: Columns, time: Array, of_time: Sequence[str], description: LogDescription
) -> tuple[Columns, tuple[str, ...]]:
    """Fill a table in which each row has values of some columns only, by joining these at common times.

    ``time``: (N,) s, computed from the columns ``of_time``. Raises as ``at_common_times``.
    """
    there = np.isfinite(raw.values) & np.isfinite(time)[:, None]
    others = [j for j, name in enumerate(raw.names) if name not in of_time]
    order = np.argsort(time, kind="stable")
    signals = {}
    for j in others:
        own = order[there[order, j]]
        signals[raw.names[j]] = Signal(raw.names[j], time[own], raw.values[own, j])
    common, columns, notes = at_common_times(raw.file, signals, description)
    rows = order[np.searchsorted(time[order], common)]
    values = raw.values[rows]
    for j in others:
        values[:, j] = columns[raw.names[j]]
    return Columns(raw.file, raw.names, values, None if raw.lines is None else raw.lines[rows]), notes


def is_part_of(column: str, name: str) -> bool:
    """Whether a column is, or is part of, the column or topic of this name."""
    return column == name or column.startswith((f"{name}.", f"{name}["))


def _require_rising(file: str, one: Signal) -> None:
    place = Place(file, None, brief(one.source, 80))
    if not len(one.time):
        raise BadInput(place, "no sample", "at least one", code="LOG009")
    if not np.isfinite(one.time).all():
        found = f"sample {int(np.argmin(np.isfinite(one.time))) + 1} without a time"
        raise BadInput(place, found, "finite times", code="LOG007")
    back = np.diff(one.time) < 0
    if back.any():
        k = int(np.argmax(back))
        found = f"time runs backwards after sample {k + 1}, by {one.time[k] - one.time[k + 1]:.6g} s"
        raise BadInput(place, found, "times that rise", code="LOG007")


def _in_gap(one: Signal, time: Array, before: Array) -> Flags:
    """(N,) whether a time lies between two samples that are too far apart to interpolate."""
    steps = np.diff(one.time)
    if not len(steps):
        return np.zeros(len(time), dtype=bool)
    after = np.minimum(before + 1, len(one.time) - 1)
    apart = one.time[after] - one.time[before]
    return np.asarray((apart > GAP_STEPS * np.median(steps)) & (time > one.time[before]), dtype=bool)


def _words(one: Signal, base: Signal, held: bool, gap: int, in_seconds: bool) -> str:
    how = "holding the last value" if held else "linear interpolation"
    left = f"; {gap} rows in its gaps left out" if gap else ""
    rate, of = (_rate(s) if in_seconds else f"{len(s.time)} samples" for s in (one, base))
    return f"`{brief(one.source)}` ({rate}) is converted to the times of `{brief(base.source)}` ({of}) by {how}{left}"


def _rate(one: Signal) -> str:
    steps = np.diff(one.time)
    step = float(np.median(steps)) if len(steps) else 0.0
    return f"{1 / step:.4g} Hz" if step > 0 else f"{len(one.time)} samples"
