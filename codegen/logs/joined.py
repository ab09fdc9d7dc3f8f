"""Several records of one machine as one log: one after the other, with pauses between that nothing uses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from codegen.errors import BadInput
from codegen.logs.log import Array, Intake, Log

PAUSE_S = 2.0
SAME_STEP = 1e-6


def join_logs(read: Sequence[Callable[[float | None], Log]]) -> Log:
    """One experiment of one or several records.

    Records are put on the coarsest of their steps. Between two of them lies a pause of ``PAUSE_S`` in which the
    position goes from the end of the one to the start of the next with continuous velocity, so that filters do not
    ring; the pause is a gap and no sample of it is used.

    Args:
        read: a function for each record, from a step in seconds (None for the record's own) to the record.

    Raises:
        BadInput: if the records differ in cutoff, tolerance or encoder step, or one cannot be read.
    """
    logs = [one(None) for one in read]
    step = max(log.sample_time for log in logs)
    logs = [
        log if abs(log.sample_time / step - 1) <= SAME_STEP else one(step) for log, one in zip(logs, read, strict=True)
    ]
    whole = logs[0]
    for log in logs[1:]:
        _refuse_other(whole, log)
        whole = _appended(whole, log)
    return whole


def _refuse_other(one: Log, other: Log) -> None:
    for name in ("cutoff_hz", "tolerance", "encoder_step"):
        mine, theirs = getattr(one, name), getattr(other, name)
        if mine != theirs:
            expected = f"{mine} as in {one.path.name}: logs of one experiment share their description"
            raise BadInput(str(other.path), f"{name} {theirs}", expected)


def _appended(one: Log, other: Log) -> Log:
    h, size = one.sample_time, one.size
    pause = round(PAUSE_S / h)
    shift = size + pause
    bridge = _bridge(one, other, pause)
    inputs = np.repeat(other.inputs[:1], pause, axis=0)
    velocities = None
    if one.velocities is not None and other.velocities is not None:
        velocities = np.vstack([one.velocities, np.gradient(bridge, h, axis=0), other.velocities])
    moved = tuple((a + shift, b + shift) for a, b in other.gaps)
    notes = [n for n in other.notes if n not in one.notes]
    return replace(
        one,
        name=f"{one.name}+{other.name}",
        time=one.time[0] + h * np.arange(shift + other.size),
        positions=np.vstack([one.positions, bridge, other.positions]),
        velocities=velocities,
        inputs=np.vstack([one.inputs, inputs, other.inputs]),
        notes=(*one.notes, *notes),
        gaps=(*one.gaps, (size, shift), *moved),
        intake=_merged(one.intake, other.intake),
    )


def _bridge(one: Log, other: Log, pause: int) -> Array:
    """(pause, n) cubic from the last position and velocity of the one to the first of the other."""
    h = one.sample_time
    reach = max(1, min(round(0.05 / h), one.size // 2, other.size // 2))
    start, end = one.positions[-1], other.positions[0]
    leaving = (one.positions[-1] - one.positions[-1 - reach]) / (reach * h)
    arriving = (other.positions[reach] - other.positions[0]) / (reach * h)
    span = (pause + 1) * h
    s = (np.arange(1, pause + 1) / (pause + 1))[:, None]
    h00, h10, h01, h11 = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, -2 * s**3 + 3 * s**2, s**3 - s**2
    return np.asarray(h00 * start + h10 * span * leaving + h01 * end + h11 * span * arriving)


def _merged(one: Intake, other: Intake) -> Intake:
    repaired = {k: one.repaired.get(k, 0) + other.repaired.get(k, 0) for k in {**one.repaired, **other.repaired}}
    steps = tuple(max(a, b) for a, b in zip(one.smallest_step, other.smallest_step, strict=True))
    return Intake(
        rows=one.rows + other.rows,
        jitter=max(one.jitter, other.jitter),
        longest_step=max(one.longest_step, other.longest_step),
        resampled=one.resampled or other.resampled,
        repaired=repaired,
        dropped=one.dropped + other.dropped,
        smallest_step=steps,
    )
