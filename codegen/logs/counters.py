"""Storage faults of raw columns: signed numbers stored unsigned, counter overflow, repeated rows; and resolution.

A fault that the log's description states is corrected. One that it does not state is reported, with the line that would
correct it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, nearest_name
from codegen.base.user_text import shown
from codegen.logs.description import LogDescription
from codegen.logs.log import Finding
from codegen.logs.source import Columns, listing
from codegen.logs.term import Term

WIDTHS = (16, 32)
NEAR_AN_END = 0.25
"""Signed numbers stored unsigned lie in this share of the range at either end, and none between."""
WRAP_SIZE = 0.05
"""A jump of a counter differs from its whole range by at most this share of it: by the motion in one row."""
FEW_JUMPS = 0.1
REACH, MOVING_STEPS = 3, 1.5
"""Rows to either side that are compared, and least motion per row, in measuring steps."""
NEAR_STEPS, FEWEST, ON_LATTICE = 50, 20, 0.9
"""Largest move that is used, in measuring steps; least number of such moves; least share that are multiples of it."""


def mended(raw: Columns, description: LogDescription) -> Columns:
    """The columns with signed numbers as such, and counters unwrapped.

    Args:
        raw: columns as they stand in the file.
    """
    values = raw.values
    for name, bits in description.signed.items():
        for j in _where(raw.names, name):
            values = values.copy() if values is raw.values else values
            values[:, j] = _signed(values[:, j], bits)
    for name, period in description.unwrap.items():
        for j in _where(raw.names, name):
            values = values.copy() if values is raw.values else values
            finite = np.isfinite(values[:, j])
            values[finite, j] = np.unwrap(values[finite, j], period=period)
    return Columns(raw.file, raw.names, values, raw.lines)


def require_columns(names: Sequence[str], description: LogDescription) -> None:
    """Refuse a column to mend, or to choose rows by, that the file has not.

    Raises:
        BadInput: at the description's key.
    """
    for key, columns in (
        ("signed16", description.signed),
        ("unwrap", description.unwrap),
        ("rows", description.rows),
    ):
        for column in columns:
            if column not in names:
                bits = description.signed.get(column) if key == "signed16" else None
                place = description.place("signed32" if bits == 32 else key)
                expected = f"one of the columns {listing(names)}"
                found = f"no column `{shown(column)}`"
                raise BadInput(place, found, expected, nearest_name(column, names), code="LOG003")


def counter_findings(raw: Columns, terms: Mapping[str, Term]) -> list[tuple[tuple[str, ...], Finding]]:
    """What the numbers of a file's columns show of how they were stored.

    Args:
        raw: columns as they stand in the file, mended where the description says so.

    Returns:
        The symbols that a column stands for, and the finding.
    """
    found: list[tuple[tuple[str, ...], Finding]] = []
    for j, name in enumerate(raw.names):
        values = raw.values[:, j]
        values = values[np.isfinite(values)]
        symbols = tuple(s for s, term in terms.items() if name in term.columns)
        if len(values) < 2 or "t" in symbols or not np.array_equal(values, np.round(values)):
            continue
        told = _stored_unsigned(name, values, symbols) or _starts_anew(name, values, symbols)
        if told is not None:
            found.append((symbols, told))
    return found


def repeats(data: Array, steps: Sequence[float]) -> tuple[float, float]:
    """Shares of the rows, and of the rows in motion, that are equal to the row before.

    Args:
        data: (N, c) positions, and velocities if they were logged.
        steps: (n) smallest step of each position, 0 where none is visible. A row is in motion where some position moves
            by more than such a step in each row near by.
    """
    same = (data[1:] == data[:-1]).all(axis=1)
    reach = 2 * REACH + 1
    if len(data) <= reach:
        return float(same.mean()), 0.0
    far = np.abs(data[reach:, : len(steps)] - data[:-reach, : len(steps)])
    moving = (far > MOVING_STEPS * reach * np.asarray(steps)).any(axis=1)
    near = same[REACH : len(data) - 1 - REACH][moving]
    return float(same.mean()), float(near.mean()) if len(near) else 0.0


def smallest_step(position: Array) -> float:
    """The step on whose multiples the differences of neighbouring samples lie.

    Args:
        position: (N,) raw samples, before any resampling.

    Returns:
        The step in the position's unit, or 0 if the differences lie on no lattice, or are all far larger than it.
    """
    moves = np.abs(np.diff(position))
    rounding = 1e-14 * float(np.abs(position).max(initial=0.0))
    moves = moves[moves > rounding]
    if len(moves) < FEWEST:
        return 0.0
    step = float(moves.min())
    for _ in range(3):  # the smallest difference carries the rounding of the printed digits; a fit over more does not
        near = moves[moves < NEAR_STEPS * step]
        counts = np.maximum(np.round(near / step), 1)
        step = float(near.sum() / counts.sum())
    near = moves[moves < NEAR_STEPS * step]
    off = np.abs(near / step - np.round(near / step))
    if len(near) < FEWEST or np.mean(off < 0.1) < ON_LATTICE:
        return 0.0
    return step


def _where(names: Sequence[str], name: str) -> list[int]:
    return [j for j, other in enumerate(names) if other == name]


def _signed(values: Array, bits: int) -> Array:
    return np.asarray(np.where(values >= 2.0 ** (bits - 1), values - 2.0**bits, values))


def _stored_unsigned(name: str, values: Array, symbols: Sequence[str]) -> Finding | None:
    """Integers near either end of the unsigned range, and none between."""
    for bits in WIDTHS:
        whole = 2.0**bits
        high = values >= whole / 2
        if values.min() < 0 or values.max() >= whole or not high.any():
            continue
        if not (np.minimum(values, whole - values) <= NEAR_AN_END * whole).all():
            continue
        signed = _signed(values, bits)
        if not high.all() and np.abs(np.diff(signed)).sum() >= 0.5 * np.abs(np.diff(values)).sum():
            continue
        share, least = float(high.mean()), float(values[high].min())
        words = (
            f"The column {name}, from which {_and(symbols)} is taken, holds signed {bits}-bit numbers stored as if "
            f"they were unsigned: {share:.1%} of its values lie between {least:.0f} and {values.max():.0f}, where "
            f"small negative ones are meant. Say `signed{bits}: [{name}]` in the log description."
        )
        figures = {"share": share, "least": least, "largest": float(values.max()), "bits": float(bits)}
        return Finding("problem", f"numbers of {_and(symbols)}", words, figures)
    return None


def _starts_anew(name: str, values: Array, symbols: Sequence[str]) -> Finding | None:
    """Jumps by nearly the whole range of a counter between rows that else move little."""
    moves = np.diff(values)
    for bits in WIDTHS:
        whole = 2.0**bits
        jumps = np.abs(np.abs(moves) - whole) <= WRAP_SIZE * whole
        if not jumps.any() or jumps.mean() > FEW_JUMPS:
            continue
        rest = np.abs(moves[~jumps])
        if len(rest) and rest.max() > whole / 4:
            continue
        count = int(jumps.sum())
        words = (
            f"The column {name}, from which {_and(symbols)} is taken, jumps by about 2^{bits} {count} times, as a "
            f"counter of {bits} bits that overflows. Say `unwrap: {{{name}: {whole:.0f}}}` in the log description."
        )
        figures = {"count": float(count), "size": whole}
        return Finding("problem", f"numbers of {_and(symbols)}", words, figures)
    return None


def _and(symbols: Sequence[str]) -> str:
    return " and ".join(symbols)
