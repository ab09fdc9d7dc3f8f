"""The excerpt of a log that is too long to be diagnosed whole, with the finding that names it."""

from dataclasses import replace

import numpy as np

from codegen.base.errors import BadInput
from codegen.logs.log import Finding, Log

Ranges = tuple[tuple[int, int], ...]

MOST_SAMPLES = 200_000
"""Most samples of a diagnosis, which fits every candidate to all of them: some minutes."""
PLENTY_HZ = 2000.0
"""Sample rate down to which a long log is thinned before it is cut: friction acts below a hundred hertz."""
STARTS = 4
"""Starts that are tried for each length of the excerpt."""


def excerpt(log: Log, most: int = MOST_SAMPLES) -> tuple[Log, tuple[Finding, ...]]:
    """At most so many samples of a log: first every k-th, then one stretch, where the machine travels furthest.

    An input held from row to row is replaced by its mean over the new step: the impulse of a force stays what it was.
    """
    if log.size <= most:
        return log, ()
    every = max(1, min(-(-log.size // most), int(1 / (PLENTY_HZ * log.sample_time) + 1e-9)))
    part = _thinned(log, every) if every > 1 else log
    start = _most_travelled(part, most) if part.size > most else 0
    part = _stretch(part, start, min(start + most, part.size))
    span = f"from {part.time[0]:.6g} to {part.time[-1]:.6g} s{f', one in {every}' if every > 1 else ''}"
    words = (
        f"Of {log.size} samples over {log.duration:.6g} s the diagnosis uses {part.size}, {span}: more would "
        "take too long. Cut the file to use another part."
    )
    figures = {"samples": float(log.size), "used": float(part.size)}
    figures |= {"every": float(every), "start": float(part.time[0])}
    return part, (Finding("warning", "long log", words, figures),)


def since(log: Log, start: float) -> Log:
    """The samples of a log from a time on, s."""
    first = int(np.searchsorted(log.time, start - 1e-6 * log.sample_time))
    if first == log.size:
        place = log.description.place("evaluation.from_s")
        expected = f"a time before the end of the log, {log.time[-1]:.10g} s"
        raise BadInput(place, f"{start:.10g} s", expected, code="LOG013")
    return _stretch(log, first, log.size) if first else log


def _stretch(log: Log, start: int, stop: int) -> Log:
    """The samples of an index range."""
    gaps, joints = (
        tuple((max(a, start) - start, min(b, stop) - start) for a, b in ranges if b > start and a < stop)
        for ranges in (log.gaps, log.joints)
    )
    return _rows(log, slice(start, stop), gaps, joints)


def _thinned(log: Log, every: int) -> Log:
    count = log.size // every
    whole = slice(0, count * every)
    counted = None if log.counted is None else np.asarray(log.counted[whole].reshape(count, every).any(axis=1))
    inputs = log.inputs[whole].reshape(count, every, -1).mean(axis=1)
    gaps, joints = (
        tuple((a // every, min(-(-b // every), count)) for a, b in ranges if a // every < count)
        for ranges in (log.gaps, log.joints)
    )
    part = _rows(log, slice(0, count * every, every), gaps, joints)
    return replace(part, inputs=inputs, sample_time=log.sample_time * every, counted=counted)


def _rows(log: Log, kept: slice, gaps: Ranges, joints: Ranges) -> Log:
    """The samples of a slice, with the gaps and joints among them."""
    return replace(
        log,
        time=log.time[kept],
        positions=log.positions[kept],
        velocities=None if log.velocities is None else log.velocities[kept],
        inputs=log.inputs[kept],
        counted=None if log.counted is None else log.counted[kept],
        gaps=gaps,
        joints=joints,
    )


def _most_travelled(log: Log, most: int) -> int:
    """Start of the excerpt on which the coordinates travel furthest, each relative to its whole travel."""
    way = np.zeros((log.size, log.positions.shape[1]))
    way[1:] = np.abs(np.diff(log.positions, axis=0))
    for a, b in log.gaps:
        way[a : b + 1] = 0.0
    total = way.sum(axis=0)
    travelled = np.concatenate([[0.0], np.cumsum((way / np.where(total > 0, total, 1.0)).sum(axis=1))])
    starts = np.arange(0, log.size - most + 1, max(1, most // STARTS))
    return int(starts[np.argmax(np.round(travelled[starts + most] - travelled[starts], 12))])
