"""Resampling of rows to a uniform time grid, with the gaps that are too long to interpolate."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.logs.formats.source import Columns

JITTER = 0.01
"""Relative deviation from the median step up to which time stamps are taken as uniform."""
GAP_STEPS = 5.0
"""Usual steps from which on a step is a gap."""
MOST_STEPS = 10.0
"""Median steps as which a longer one counts in the usual step: the mean step, if that is above the median one.

Long steps that come again and again are usual, single ones are not.
"""
MOST_GROWTH = 10
"""Most samples of the grid over the number of rows."""
FINER = 0.8
"""Grid step over the median step below which splines are used; a linear interpolation would show its corners."""


@dataclass(frozen=True)
class Uniform:
    """Data on a uniform grid.

    Attributes:
        time: (N,) s.
        sampled: (N, c) columns that were interpolated linearly.
        held: (N, m) columns that are held between rows.
        step: s.
        gaps: half-open index ranges of the grid that must not be used.
        jitter: RMS deviation of the file's steps from their median, gaps left out, relative.
        longest_step: s.
        resampled: whether anything was interpolated.
    """

    time: Array
    sampled: Array
    held: Array
    step: float
    gaps: tuple[tuple[int, int], ...]
    jitter: float
    longest_step: float
    resampled: bool
    notes: tuple[str, ...]


def uniform(time: Array, sampled: Array, held: Array, source: Columns, wanted: float | None = None) -> Uniform:
    """Put rows on a uniform grid, whose step is the median step or the given one.

    Stamps that keep within 1 % of the median step are taken as uniform and no value is touched. Otherwise ``sampled``
    is interpolated linearly, by cubic splines for a step much below the median one, and ``held``, a zero-order hold
    from row to row, is given by its mean over each new step, which keeps the impulse of a force.

    Args:
        time: (N,) s, strictly rising; N of at least 2.
        sampled: (N, c). held: (N, m). source: the raw rows, for the places of messages.
    """
    steps = np.diff(time)
    median = float(np.median(steps))
    longest = float(steps.max())
    longest_usual = GAP_STEPS * max(median, float(np.minimum(steps, MOST_STEPS * median).mean()))
    inner = steps[steps <= longest_usual]
    jitter = float(np.sqrt(np.mean((inner / median - 1) ** 2)))
    if wanted is None and np.abs(steps / median - 1).max() <= JITTER:
        step = _rounded(float(time[-1] - time[0]) / len(steps))
        return Uniform(time[0] + step * np.arange(len(time)), sampled, held, step, (), jitter, longest, False, ())

    step = wanted or _rounded(median)
    span = float(time[-1] - time[0]) / step
    if span * step / median > MOST_GROWTH * len(time) + 1000:
        k = int(np.argmax(steps))
        found = f"time jumps by {steps[k]:g} s where the median step is {median:g} s"
        raise BadInput(source.place(k + 1, 0), found, "a record without pauses; split the file here", code="LOG008")
    grid = time[0] + _phase(time, step) + step * np.arange(int(span + 1e-6) + 1)
    grid = grid[grid <= time[-1] + 0.01 * step]
    if len(grid) < 2:
        words = f"{len(time)} rows in {span * step:g} s"
        raise BadInput(source.place(0, 0), words, "rows at regular times", code="LOG008")
    if step < FINER * median:
        fine = CubicSpline(time, sampled, axis=0)(np.clip(grid, time[0], time[-1]))
    else:
        fine = np.column_stack([np.interp(grid, time, column) for column in sampled.T])
    edges = np.append(grid, grid[-1] + step)
    means = np.reshape([held_means(time, column, edges) for column in held.T], (held.shape[1], len(grid))).T
    gaps = _gaps(time, steps, grid, longest_usual)
    return Uniform(
        grid, fine, means, step, gaps, jitter, longest, True, tuple(_words(steps, median, step, jitter, gaps))
    )


def _rounded(step: float) -> float:
    """Twelve digits: 0.001 and not 0.0009999999999998899."""
    return float(f"{step:.12g}")


def _phase(time: Array, step: float) -> float:
    """Offset of the grid after the first row, in [0, step) s, at which it meets most stamps; 0 if they share none."""
    phases = (time - time[0]) / step % 1.0
    mean = np.mean(np.exp(2j * np.pi * phases))
    if abs(mean) < 0.9:
        return 0.0
    rough = float(np.angle(mean)) / (2 * np.pi)
    phase = rough + float(np.median((phases - rough + 0.5) % 1.0 - 0.5))
    return 0.0 if abs(phase) < 1e-3 else (phase % 1.0) * step


def held_means(time: Array, column: Array, edges: Array) -> Array:
    """(K,) means between successive edges, (K + 1,), of a value, (N,), that is held from each row to the next.

    The last row's value holds to the last edge.
    """
    origin = float(column[0])
    knots = np.append(time, max(time[-1], edges[-1]) + edges[-1] - edges[-2])
    impulse = np.concatenate(([0.0], np.cumsum((column - origin) * np.diff(knots))))
    means: Array = origin + np.diff(np.interp(edges, knots, impulse)) / np.diff(edges)
    # The sums have rounding errors; a mean lies between the values that it is a mean of.
    return np.clip(means, column.min(), column.max())


def earlier(column: Array, rows: float) -> Array:
    """(N,) means over each row of a value (N,) that is held from row to row and acts so many rows earlier.

    Rows beyond the end hold the last value. Half a row earlier gives the means of successive rows.
    """
    whole = int(np.floor(rows))
    index = np.clip(np.arange(len(column))[:, None] + [whole, whole + 1], 0, len(column) - 1)
    share = rows - whole
    return np.asarray(column[index] @ np.array([1 - share, share]))


def _gaps(time: Array, steps: Array, grid: Array, limit: float) -> tuple[tuple[int, int], ...]:
    """Grid samples strictly inside steps longer than ``limit`` seconds."""
    slack = 1e-6 * limit
    spans = []
    for k in np.flatnonzero(steps > limit):
        start = int(np.searchsorted(grid, time[k] + slack, side="right"))
        stop = int(np.searchsorted(grid, time[k + 1] - slack, side="left"))
        if stop > start:
            spans.append((start, stop))
    return tuple(spans)


def _words(steps: Array, median: float, step: float, jitter: float, gaps: tuple[tuple[int, int], ...]) -> list[str]:
    words = [
        f"irregular time stamps (steps of {steps.min():.4g} to {steps.max():.4g} s, median {median:.4g} s, RMS jitter "
        f"{jitter:.2%}): positions interpolated onto a uniform grid of {step:.6g} s, inputs averaged over each of its "
        "steps as held values"
    ]
    if gaps:
        lost = sum(stop - start for start, stop in gaps) * step
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        words.append(f"{count} longer than {GAP_STEPS:g} steps, {lost:.3g} s in all, not to be used")
    return words
