"""Cleaning of raw columns: finite values at increasing times. Changes are noted; what cannot be repaired is refused."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from codegen.base.arrays import Array, Flags, runs
from codegen.base.errors import BadInput, Place
from codegen.base.user_text import brief
from codegen.logs.counters import WIDTHS, WRAP_SIZE
from codegen.logs.description import LogDescription
from codegen.logs.formats.source import Columns
from codegen.logs.term import identifier
from codegen.logs.uniform import held_means

LARGEST_VALUE, SMALLEST_VALUE = 1e30, 1e-30
"""Least magnitude that is refused, and least one that is not read as zero: squares and products stay in range."""
SHARE_NOT_FINITE, RUN_NOT_FINITE = 0.01, 5
"""Largest share of values that are not finite, and most of them in a row, that are filled in."""
ONE_OF = "or, where a column numbers motors or records, `rows: {COLUMN: NUMBER}` in meta.yaml beside the log"
"""How one of several motors is read from a file whose rows are those of all."""
SHARE_REPEATED = 0.20
"""Largest share of rows that repeat a time stamp with other data."""
SHARE_MOVED, ROWS_MOVED, IRREGULAR = 0.05, 100, 0.25
"""Rows out of order: largest share, largest distance from their place, and largest deviation of the steps of time when
sorted, over their median."""
_UNITS = {1e3: ("milliseconds", "0.001"), 1e6: ("microseconds", "1e-6"), 1e9: ("nanoseconds", "1e-9")}


@dataclass(frozen=True)
class CleanedRows:
    """The usable rows of a log.

    Attributes:
        time: (N,) s, strictly rising.
        data: (N, c) the other columns in SI, finite.
        repaired: symbol → number of values filled in.
    """

    time: Array
    data: Array
    source: Columns
    repaired: Mapping[str, int]
    dropped: int
    notes: tuple[str, ...]


def clean(
    raw: Columns, symbols: Sequence[str], held: Sequence[bool], scale: Mapping[str, float], description: LogDescription
) -> CleanedRows:
    """Check the rows of a log, and repair those that can be.

    Args:
        symbols: (1 + c) names in the spec of these columns, the first ``t``.
        held: (1 + c) whether a column is held between rows (inputs), so that a missing value is the one before it.
    """
    notes: list[str] = []
    raw = _without_padding(raw, notes)
    rows = len(raw.values)
    if rows == 1:
        raise BadInput(raw.place(0), "a single row", "rows at two or more times", code="LOG009")
    fill = description.missing == "fill"
    timed = _in_order(_finite_time(raw, fill, notes), notes)
    values, repaired = _finite(timed, symbols, held, fill, notes)
    kept = _rising(timed, values, notes)
    timed, values = timed.rows(kept), values[kept]
    if len(values) < 2:
        raise BadInput(timed.place(0), "a single time stamp in all rows", "rows at two or more times", code="LOG009")
    factors = np.array([scale[s] for s in symbols])
    values = values * factors
    _plausible(values, timed, symbols)
    values[:, 1:][np.abs(values[:, 1:]) < SMALLEST_VALUE] = 0.0
    _check_seconds(timed, values[:, 0], scale["t"], description, notes)
    return CleanedRows(values[:, 0].copy(), values[:, 1:], timed, repaired, rows - len(values), tuple(notes))


def _bad(values: Array) -> Flags:
    """Whether a value is not finite, or larger than ``LARGEST_VALUE``."""
    return ~(np.abs(values) < LARGEST_VALUE)


def _without_padding(raw: Columns, notes: list[str]) -> Columns:
    """The rows without those at both ends that are all zero, as an unfilled buffer leaves them."""
    used = np.flatnonzero((raw.values != 0).any(axis=1))
    if not len(used) or raw.values[used[-1], 0] <= 0:
        return raw
    start = int(used[0]) if used[0] > 1 else 0
    stop = int(used[-1]) + 1
    left = len(raw.values) - stop + start
    if not left:
        return raw
    first = raw.place(0 if start else stop)
    notes.append(f"{_count(left, 'row')} of zeros (also the time) at the ends left out (first: {first})")
    keep = np.zeros(len(raw.values), dtype=bool)
    keep[start:stop] = True
    return raw.rows(keep)


def _finite_time(raw: Columns, fill: bool, notes: list[str]) -> Columns:
    """The rows that have a time."""
    bad = _bad(raw.values[:, 0])
    if not bad.any():
        return raw
    _refuse_many(raw, 0, bad, fill)
    notes.append(f"{_count(bad.sum(), 'row')} without a time stamp left out (first: {raw.place(int(np.argmax(bad)))})")
    return raw.rows(~bad)


def _in_order(raw: Columns, notes: list[str]) -> Columns:
    """The rows sorted by time, where only a few were written early or late and no step of time is left irregular.

    A clock that was set back, or a second record in the file, leaves such steps or moves rows far: see ``_rising``.
    """
    time = raw.values[:, 0]
    back = np.diff(time) < 0
    if not 0 < back.sum() <= SHARE_MOVED * len(time):
        return raw
    order = np.argsort(time, kind="stable")
    moved = np.flatnonzero(order != np.arange(len(time)))
    steps = np.diff(time[order])
    median = float(np.median(steps))
    steps = steps[max(moved[0] - 1, 0) : moved[-1] + 1]
    far = np.abs(order - np.arange(len(time))).max() > ROWS_MOVED
    if far or (np.abs(steps - median) > IRREGULAR * median).any():
        return raw
    first = raw.place(int(np.argmax(back)) + 1)
    notes.append(f"{_count(back.sum(), 'row')} before an earlier one: the rows are sorted by time (first: {first})")
    lines = None if raw.lines is None else raw.lines[order]
    return Columns(raw.file, raw.names, raw.values[order], lines)


def _finite(
    raw: Columns, symbols: Sequence[str], held: Sequence[bool], fill: bool, notes: list[str]
) -> tuple[Array, dict[str, int]]:
    """The values with isolated missing ones filled in, and how many in which symbol."""
    values = raw.values.copy()
    repaired: dict[str, int] = {}
    for j in range(1, values.shape[1]):
        bad = _bad(values[:, j])
        if not bad.any():
            continue
        _refuse_many(raw, j, bad, fill)
        good = np.flatnonzero(~bad)
        if held[j]:
            before = np.searchsorted(good, np.flatnonzero(bad)) - 1
            values[bad, j] = values[good[np.maximum(before, 0)], j]
        else:
            values[bad, j] = np.interp(np.flatnonzero(bad), good, values[good, j])
        repaired[symbols[j]] = int(bad.sum())
        how = "the value before" if held[j] else "interpolation between its neighbours"
        first = raw.place(int(np.argmax(bad)), j)
        notes.append(f"{symbols[j]}: {_count(bad.sum(), 'value')} not finite, filled in from {how} (first: {first})")
    return values, repaired


def _refuse_many(raw: Columns, column: int, bad: Flags, fill: bool) -> None:
    """Raise BadInput if too many values of a column are not finite, in a row or in all."""
    start, stop = max(runs(bad), key=lambda run: run[1] - run[0], default=(0, 0))
    run = stop - start
    at, count = int(np.argmax(bad)), int(bad.sum())
    found = f"{count} of {len(bad)} values are not finite (NaN, inf, empty or beyond {LARGEST_VALUE:g})"
    which = ", the first here"
    if run > RUN_NOT_FINITE:
        at, which = start, f", {run} of them in a row"
        expected = f"at most {RUN_NOT_FINITE} in a row; delete these rows, and the gap in time is left out"
    elif not fill:
        expected = "numbers; `missing: fill` in meta.yaml beside the log fills single ones in"
    elif count > SHARE_NOT_FINITE * len(bad):
        expected = f"at most {SHARE_NOT_FINITE:.0%} of them missing"
    else:
        return
    if column and count > SHARE_NOT_FINITE * len(bad):
        expected += "; or `missing: join` where columns were logged at times of their own"
    raise BadInput(raw.place(at, column), found + which, expected, code="LOG006")


def _rising(raw: Columns, values: Array, notes: list[str]) -> Flags:
    """(N,) which rows to keep so that time rises; the first of every repeated time stamp."""
    time = values[:, 0]
    steps = np.diff(time)
    if (steps < 0).any():
        k = int(np.argmax(steps < 0))
        count = int((steps < 0).sum())
        found = f"time runs backwards, from {float(time[k])!r} to {float(time[k + 1])!r}"
        more = f" ({count} times in the file, the first here)" if count > 1 else ""
        expected = f"rows in the order of time; a file for each record, {ONE_OF}"
        usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        for bits in WIDTHS:
            if abs(-steps[k] / 2**bits - 1) < WRAP_SIZE or 0 < steps[k] + 2**bits < 2 * usual:
                key = f"`unwrap: {{{brief(raw.names[0])}: {2**bits}}}` in meta.yaml beside the log"
                expected = f"a time that rises; a counter of {bits} bits that overflows is continued by {key}"
        raise BadInput(raw.place(k + 1, 0), found + more, expected, code="LOG007")
    repeats = np.concatenate(([False], steps == 0))
    if not repeats.any():
        return ~repeats
    first = np.maximum.accumulate(np.where(repeats, 0, np.arange(len(time))))
    same = repeats & (values == values[first]).all(axis=1)
    other = repeats & ~same
    if other.sum() > SHARE_REPEATED * len(time):
        found = f"{int(other.sum())} of {len(time)} rows repeat a time stamp with other data, the first here"
        parts = f"`columns: {{t: {identifier(raw.names[0])} + 0.001*MS}}` where a column MS holds the milliseconds"
        equal = "or, in place of the column, `sample_time: SECONDS` where the rows are equally far apart"
        expected = f"a different time in each row (written with more digits; or {parts}), {equal}, {ONE_OF}"
        raise BadInput(raw.place(int(np.argmax(other)), 0), found, expected, code="LOG007")
    if same.any():
        where = raw.place(int(np.argmax(same)))
        notes.append(f"{_count(same.sum(), 'row')} that repeat another left out (first: {where})")
    if other.any():
        where = raw.place(int(np.argmax(other)))
        words = "with other data at the same time left out, the first row of each time kept"
        notes.append(f"{_count(other.sum(), 'row')} {words} (first: {where})")
    return ~repeats


def _plausible(values: Array, source: Columns, symbols: Sequence[str]) -> None:
    """Raise BadInput for a value that is too large after scaling, or time stamps that become equal."""
    bad = _bad(values)
    if bad.any():
        j = int(np.argmax(bad.any(axis=0)))
        k = int(np.argmax(bad[:, j]))
        found = f"{symbols[j]} is {values[k, j]:g} after scaling"
        raise BadInput(source.place(k, j), found, f"below {LARGEST_VALUE:g}", code="LOG005")
    if not (np.diff(values[:, 0]) > 0).all():
        found = "time stamps that are equal after scaling"
        raise BadInput(source.place(0, 0), found, "another factor for t", code="LOG007")


def _check_seconds(raw: Columns, time: Array, factor: float, description: LogDescription, notes: list[str]) -> None:
    """Compare the median step with the description's sample rate."""
    rate = description.sample_rate_hz
    if rate is None:
        return
    step = float(np.median(np.diff(time)))
    ratio = step * rate
    for power, (unit, hint) in _UNITS.items():
        if 0.8 < ratio / power < 1.25:
            place = Place(raw.file, raw.place(0).line, brief(raw.names[0]))
            found = f"a median step of {step:g} s where {description.file} says {rate:g} Hz: it seems to be in {unit}"
            scaled = hint if factor == 1.0 else f"{factor * float(hint):g}"
            expected = f"seconds; in meta.yaml beside the log `scale: {{t: {scaled}}}`"
            raise BadInput(place, found, expected, code="LOG012")
    if abs(ratio - 1) > 0.1:
        notes.append(f"the median step is {step:g} s, which is {1 / step:g} Hz; the description says {rate:g} Hz")


def _count(count: int, what: str) -> str:
    return f"1 {what}" if count == 1 else f"{count} {what}s"


def in_time(
    cleaned: CleanedRows, symbols: Sequence[str], held: Sequence[bool], description: LogDescription
) -> CleanedRows:
    """The rows with the columns of ``late`` moved by their times; rows without such a value at the ends are left out.

    A sampled column is interpolated linearly, a held one given by its mean over each row.
    """
    late = {symbol: by for symbol, by in description.late.items() if by and symbol in symbols}
    if not late:
        return cleaned
    if "t" in late:
        raise BadInput(description.place("late.t"), "`t`", "a coordinate, velocity or input", code="LOG013")
    time, data = cleaned.time, cleaned.data.copy()
    ends = np.append(time, 2 * time[-1] - time[-2])  # of the rows
    slack = 1e-6 * float(np.median(np.diff(time)))
    used = np.ones(len(time), dtype=bool)
    for symbol, by in late.items():
        used &= (time + by >= time[0] - slack) & (time + by <= time[-1] + slack)
        if used.sum() < 2:
            expected = f"a time below the {time[-1] - time[0]:.4g} s of the log"
            raise BadInput(description.place(f"late.{symbol}"), f"{by:g} s", expected, code="LOG013")
        k = symbols.index(symbol) - 1
        data[:, k] = held_means(time, data[:, k], ends + by) if held[k + 1] else np.interp(time + by, time, data[:, k])
    words = ", ".join(f"{symbol} is taken {1e3 * by:.4g} ms earlier than logged" for symbol, by in late.items())
    notes = (*cleaned.notes, f"{words}, as the description says (`late`)")
    return replace(cleaned, time=time[used], data=data[used], source=cleaned.source.rows(used), notes=notes)
