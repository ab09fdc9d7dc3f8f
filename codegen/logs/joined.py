"""Concatenation of several records of one machine to one log, with unused pauses between them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from codegen.base.arrays import Array, Flags
from codegen.base.errors import BadInput
from codegen.logs.excerpt import MOST_SAMPLES
from codegen.logs.log import Log, RawData

PAUSE_S = 2.0
SAME_STEP = 1e-6
"""Relative difference up to which two sample times are taken to be equal."""
LONGEST_NAME = 100
MOST_GROWTH = 3
"""Most samples of the common grid over those of the records: interpolated samples cost time and add no information."""


def join_logs(read: Sequence[Callable[[float | None], Log]]) -> Log:
    """One experiment from one or several records.

    The records are resampled to the finest of their sample times, so that none loses information; to a coarser one if
    there would be more than ``MOST_SAMPLES`` samples, or more than ``MOST_GROWTH`` times those of the records. Between
    two records is a pause of ``PAUSE_S``, in which the position goes from the end of one to the start of the next with
    continuous velocity, so that filters do not ring. No sample of a pause (``joints``) is used. ``records`` keeps each
    record as it was sampled. ``read``: for each record, a function that reads it with a sample time in seconds, or with
    its own for None. Raises BadInput if the records differ in cutoff, tolerance or encoder step, or one cannot be read.
    """
    logs = [one(None) for one in read]
    if len(logs) == 1:
        return logs[0]
    step = _common_step(logs)
    same = [abs(log.sample_time / step - 1) <= SAME_STEP for log in logs]
    joined = [log if fits else _resampled(log, one(step)) for log, one, fits in zip(logs, read, same, strict=True)]
    whole = joined[0]
    for log in joined[1:]:
        for name in ("cutoff_hz", "tolerance", "encoder_step"):
            mine, theirs = getattr(whole, name), getattr(log, name)
            if mine != theirs:
                expected = f"{mine} as in {whole.path.name}: logs of one experiment share their description"
                raise BadInput(str(log.path), f"{name} {theirs}", expected, code="LOG011")
        whole = _appended(whole, log)
    notes = whole.notes
    if not all(same):
        steps = [log.sample_time for log in logs]
        words = f"records with steps of {min(steps):.6g} to {max(steps):.6g} s, put on one grid of {step:.6g} s"
        notes = (words, *notes)
    return replace(whole, records=tuple(logs), notes=notes)


def _common_step(logs: Sequence[Log]) -> float:
    """The finest sample time of the logs, or a coarser one if there would be too many samples."""
    finest = min(log.sample_time for log in logs)
    seconds = sum(log.duration + PAUSE_S for log in logs)
    most = min(MOST_SAMPLES, MOST_GROWTH * sum(log.size for log in logs))
    if seconds <= most * finest:
        return finest
    return float(f"{max(finest, seconds / most):.6g}")


def _resampled(log: Log, other: Log) -> Log:
    """A record on the experiment's grid (``other``), with the findings at its own rate (``log``)."""
    counted = np.ones(other.size, dtype=bool)
    if log.sample_time > other.sample_time:  # interpolated samples do not count as data
        places = np.round((log.time - other.time[0]) / other.sample_time).astype(int)
        counted[:] = False
        counted[np.clip(places, 0, other.size - 1)] = True
    return replace(other, raw_data=log.raw_data, notes=log.notes, counted=counted)


def _appended(one: Log, other: Log) -> Log:
    h, size = one.sample_time, one.size
    pause = round(PAUSE_S / h)
    shift = size + pause
    bridge = _bridge(one, other, pause)
    inputs = np.repeat(other.inputs[:1], pause, axis=0)
    velocities = None
    if one.velocities is not None and other.velocities is not None:
        velocities = np.vstack([one.velocities, np.gradient(bridge, h, axis=0), other.velocities])
    counted = None
    if one.counted is not None or other.counted is not None:
        counted = np.concatenate([_counted(one), np.zeros(pause, dtype=bool), _counted(other)])
    moved = tuple((a + shift, b + shift) for a, b in other.gaps)
    notes = [n for n in other.notes if n not in one.notes]
    return replace(
        one,
        name=_name(one.name, other.name),
        time=one.time[0] + h * np.arange(shift + other.size),
        positions=np.vstack([one.positions, bridge, other.positions]),
        velocities=velocities,
        inputs=np.vstack([one.inputs, inputs, other.inputs]),
        notes=(*one.notes, *notes),
        gaps=(*one.gaps, (size, shift), *moved),
        joints=(*one.joints, (size, shift)),
        raw_data=_merged(one.raw_data, other.raw_data),
        counted=counted,
    )


def _counted(log: Log) -> Flags:
    return np.ones(log.size, dtype=bool) if log.counted is None else log.counted


def _name(one: str, other: str) -> str:
    """Both names, joined by +; if that would be long, the names so far, followed by +…"""
    if one.endswith("+…") or len(one) + len(other) > LONGEST_NAME:
        return f"{one.removesuffix('+…')}+…"
    return f"{one}+{other}"


def _bridge(one: Log, other: Log, pause: int) -> Array:
    """Cubic Hermite curve from the last position and velocity of one log to the first of the other, (pause, n)."""
    h = one.sample_time
    reach = max(1, min(round(0.05 / h), one.size // 2, other.size // 2))
    start, end = one.positions[-1], other.positions[0]
    leaving = (one.positions[-1] - one.positions[-1 - reach]) / (reach * h)
    arriving = (other.positions[reach] - other.positions[0]) / (reach * h)
    ends = CubicHermiteSpline([0.0, (pause + 1) * h], [start, end], [leaving, arriving])
    return np.asarray(ends(h * np.arange(1, pause + 1)))


def _merged(one: RawData, other: RawData) -> RawData:
    repaired = {k: one.repaired.get(k, 0) + other.repaired.get(k, 0) for k in {**one.repaired, **other.repaired}}
    steps = tuple(max(a, b) for a, b in zip(one.smallest_step, other.smallest_step, strict=True))
    whole = one.rows + other.rows
    known = {(f.topic, f.severity) for f in one.findings}
    return replace(
        one,
        repeated=(one.repeated * one.rows + other.repeated * other.rows) / whole,
        stale=(one.stale * one.rows + other.stale * other.rows) / whole,
        findings=(*one.findings, *(f for f in other.findings if (f.topic, f.severity) not in known)),
        doubted=one.doubted | other.doubted,
        unsized=one.unsized | other.unsized,
        rows=whole,
        jitter=max(one.jitter, other.jitter),
        longest_step=max(one.longest_step, other.longest_step),
        resampled=one.resampled or other.resampled,
        repaired=repaired,
        dropped=one.dropped + other.dropped,
        smallest_step=steps,
        columns={**one.columns, **other.columns},
        inferred_units={**one.inferred_units, **other.inferred_units},
        applied_units={**one.applied_units, **other.applied_units},
    )
