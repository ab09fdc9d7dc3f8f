"""Storage faults of a log's raw columns: signed integers stored as unsigned, counter overflow, repeated rows.

A fault that the log's description declares is corrected. Others are detected and reported, with the line of the
description that would correct them. Also here: the resolution (quantisation step) of a measured position.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, nearest_name
from codegen.base.user_text import brief
from codegen.logs.description import LogDescription
from codegen.logs.formats.series import is_part_of
from codegen.logs.formats.source import Columns, listing
from codegen.logs.log import Finding
from codegen.logs.term import Term

WIDTHS = (16, 32)
"""Bits of the integer types that are considered."""
NEAR_AN_END = 0.25
"""Small signed integers stored as unsigned all lie within this share of the range from its ends."""
WRAP_SIZE = 0.05
"""Largest difference between an overflow's jump and the counter's range, over the range; the motion in one row."""
FEW_JUMPS = 0.1
"""Largest share of rows with a jump."""
REACH, MOVING_STEPS = 3, 1.5
"""``repeats``: rows to either side that are compared, and least motion per row, in quantisation steps."""
NEAR_STEPS, FEWEST, ON_LATTICE = 50, 20, 0.9
"""``smallest_step``: largest difference that is used, in steps; least number of such differences; least share of them
that are multiples of the step."""
Fault = tuple[str, str, dict[str, float]]
"""What a column does, as a clause; the key of meta.yaml that corrects it; and figures."""


def corrected(raw: Columns, description: LogDescription) -> Columns:
    """The file's columns with the declared corrections: unsigned integers read as signed, counters unwrapped."""
    if not (description.signed or description.unwrap):
        return raw
    values = raw.values.copy()
    for name, bits in description.signed.items():
        for j in _indices(raw.names, name):
            values[:, j] = _signed(values[:, j], bits)
    for name, period in description.unwrap.items():
        for j in _indices(raw.names, name):
            finite = np.isfinite(values[:, j])
            values[finite, j] = np.unwrap(values[finite, j], period=period)
    return Columns(raw.file, raw.names, values, raw.lines)


def require_columns(names: Sequence[str], description: LogDescription) -> None:
    """Check that the file has every column that the description corrects, selects rows by or holds."""
    for key, columns in (("signed16", description.signed), ("unwrap", description.unwrap), ("rows", description.rows)):
        for column in columns:
            if column not in names:
                bits = description.signed.get(column) if key == "signed16" else None
                place = description.place("signed32" if bits == 32 else key)
                expected = f"one of the columns {listing(names)}"
                found = f"no column `{brief(column)}`"
                raise BadInput(place, found, expected, nearest_name(column, names), code="LOG003")
    for name in description.hold:
        if not any(is_part_of(column, name) for column in names):
            found = f"`{brief(name)}`, which is no topic, file or column of the log"
            expected = f"topics, files or columns, such as {listing(list(names), 5)}"
            raise BadInput(description.place("hold"), found, expected, nearest_name(name, names), code="LOG013")


def counter_findings(raw: Columns, terms: Mapping[str, Term]) -> list[tuple[tuple[str, ...], Finding]]:
    """Undeclared storage faults of integer columns: the symbols concerned, and the finding, of each."""
    findings: list[tuple[tuple[str, ...], Finding]] = []
    for j, name in enumerate(raw.names):
        values = raw.values[:, j]
        values = values[np.isfinite(values)]
        symbols = tuple(s for s, term in terms.items() if name in term.columns)
        if len(values) < 2 or "t" in symbols or not np.array_equal(values, np.round(values)):
            continue
        if found := _stored_unsigned(name, values) or _overflow(name, values):
            fault, key, figures = found
            what = " and ".join(symbols)
            words = f"The column {name}, from which {what} is taken, {fault}. Say `{key}` in meta.yaml beside the log."
            findings.append((symbols, Finding("problem", f"numbers of {what}", words, figures)))
    return findings


def repeats(data: Array, steps: Sequence[float]) -> tuple[float, float]:
    """Share of the rows that equal the row before: of all rows, and of the rows in motion.

    A row is in motion if some position changes, over ``REACH`` rows to either side, by more than ``MOVING_STEPS``
    quantisation steps per row.
    """
    same = (data[1:] == data[:-1]).all(axis=1)
    window = 2 * REACH + 1
    if len(data) <= window:
        return float(same.mean()), 0.0
    change = np.abs(data[window:, : len(steps)] - data[:-window, : len(steps)])
    moving = (change > MOVING_STEPS * window * np.asarray(steps)).any(axis=1)
    same_in_motion = same[REACH : len(data) - 1 - REACH][moving]
    return float(same.mean()), float(same_in_motion.mean()) if len(same_in_motion) else 0.0


def smallest_step(position: Array) -> float:
    """Quantisation step of raw samples (N,): most differences are multiples of it; 0 if none shows."""
    differences = np.abs(np.diff(position))
    rounding = 1e-14 * float(np.abs(position).max(initial=0.0))
    differences = differences[differences > rounding]
    if len(differences) < FEWEST:
        return 0.0
    step = float(differences.min())
    for _ in range(3):  # the smallest difference has a rounding error of the printed digits, which a fit averages out
        small = differences[differences < NEAR_STEPS * step]
        counts = np.maximum(np.round(small / step), 1)
        step = float(small.sum() / counts.sum())
    small = differences[differences < NEAR_STEPS * step]
    deviation = np.abs(small / step - np.round(small / step))
    if len(small) < FEWEST or np.mean(deviation < 0.1) < ON_LATTICE:
        return 0.0
    return step


def _indices(names: Sequence[str], name: str) -> list[int]:
    return [j for j, other in enumerate(names) if other == name]


def _signed(values: Array, bits: int) -> Array:
    """Two's complement: unsigned integers of so many bits as signed ones."""
    return np.asarray(np.where(values >= 2.0 ** (bits - 1), values - 2.0**bits, values))


def _stored_unsigned(name: str, values: Array) -> Fault | None:
    """The fault if all values are near the ends of an unsigned range, and the signed values vary less."""
    for bits in WIDTHS:
        size = 2.0**bits
        high = values >= size / 2
        if values.min() < 0 or values.max() >= size or not high.any():
            continue
        if not (np.minimum(values, size - values) <= NEAR_AN_END * size).all():
            continue
        signed = _signed(values, bits)
        if not high.all() and np.abs(np.diff(signed)).sum() >= 0.5 * np.abs(np.diff(values)).sum():
            continue
        share, least, largest = float(high.mean()), float(values[high].min()), float(values.max())
        fault = (
            f"holds signed {bits}-bit numbers stored as if they were unsigned: {share:.1%} of its values lie between "
            f"{least:.0f} and {largest:.0f}, where small negative ones are meant"
        )
        figures = {"share": share, "least": least, "largest": largest, "bits": float(bits)}
        return fault, f"signed{bits}: [{name}]", figures
    return None


def _overflow(name: str, values: Array) -> Fault | None:
    """The fault if few differences are about a counter's range and the others are far smaller."""
    differences = np.diff(values)
    for bits in WIDTHS:
        size = 2.0**bits
        jumps = np.abs(np.abs(differences) - size) <= WRAP_SIZE * size
        if not jumps.any() or jumps.mean() > FEW_JUMPS:
            continue
        others = np.abs(differences[~jumps])
        if len(others) and others.max() > size / 4:
            continue
        count = int(jumps.sum())
        fault = f"jumps by about 2^{bits} {count} times, as a counter of {bits} bits that overflows"
        return fault, f"unwrap: {{{name}: {size:.0f}}}", {"count": float(count), "size": size}
    return None
