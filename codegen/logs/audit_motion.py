"""Preflight of the motion: measuring step, ranges, reversals, standstill, and the spec's envelope."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from codegen.logs.finding import Finding, decide
from codegen.logs.log import Array, Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

FEW_REVERSALS = 4
MOSTLY_STILL = 0.8
COARSE = 0.1
ENCODER_OFF = 0.2
WRAP = 0.5
WRAP_OVER_REST = 5.0
FEW_JUMPS = 0.02
FAR_INSIDE = 0.01


def audit_motion(log: Log, spec: Spec, motion: Motion) -> Iterator[Finding]:
    """What there is to say of each coordinate."""
    if not motion.usable.any():
        words = f"No stretch of the log is long enough to differentiate at a cut-off of {motion.cutoff_hz:.3g} Hz."
        yield Finding("problem", "motion", words, {"cutoff_hz": motion.cutoff_hz})
        return
    for j in range(len(spec.coordinates)):
        yield from _encoder(log, spec, motion, j)
        yield from _coordinate(log, spec, motion, j)
        yield from _wraps(log, spec, j)
    yield from _envelope(log, spec, motion)


def _encoder(log: Log, spec: Spec, motion: Motion, j: int) -> Iterator[Finding]:
    c = spec.coordinates[j]
    seen = log.intake.smallest_step[j] if log.intake.smallest_step else 0.0
    declared = log.encoder_step[j] if log.encoder_step else 0.0
    noise = float(np.std((log.positions - motion.positions)[motion.usable, j]))
    figures = {"seen": seen, "declared": declared, "noise_rms": noise}
    topic = f"resolution of {c.name}"
    if declared and seen and abs(seen / declared - 1) > ENCODER_OFF:
        words = f"{c.name} moves in steps of {seen:.4g} {c.unit}, while the description says {declared:.4g}."
        yield Finding("warning", topic, words, figures)
        return
    step = seen or declared
    top = float(np.abs(motion.velocities[motion.usable, j]).max())
    if not step:
        words = f"{c.name} shows no measuring step; noise above {motion.cutoff_hz:.3g} Hz: RMS {noise:.3g} {c.unit}."
        yield Finding("info", topic, words, figures)
        return
    # Speed that one step within half a period of the cut-off amounts to.
    creep = step * 2 * motion.cutoff_hz
    coarse = creep > COARSE * top
    words = f"{c.name} is measured in steps of {step:.4g} {c.unit}."
    if coarse:
        words += f" That is coarse: one step looks like {creep:.2g} {c.unit}/s, where the top speed is {top:.2g}."
    yield Finding(decide(coarse), topic, words, figures)


def _coordinate(log: Log, spec: Spec, motion: Motion, j: int) -> Iterator[Finding]:
    c = spec.coordinates[j]
    position, velocity = log.positions[_outside_gaps(log), j], motion.velocities[motion.usable, j]
    low, high = float(position.min()), float(position.max())
    slow, fast = float(velocity.min()), float(velocity.max())
    reversals, still = motion.reversals[j], motion.standstill[j]
    figures = {
        "position_min": low,
        "position_max": high,
        "velocity_min": slow,
        "velocity_max": fast,
        "reversals": float(reversals),
        "standstill": still,
        "threshold": float(motion.threshold[j]),
    }
    topic = f"motion of {c.name}"
    if high == low or still == 1.0:
        words = f"{c.name} does not move: it stays within {high - low:.3g} {c.unit} of {low:.4g}."
        yield Finding("problem" if len(spec.coordinates) == 1 else "warning", topic, words, figures)
        return
    words = (
        f"{c.name} covers {low:.4g} to {high:.4g} {c.unit} at {slow:.3g} to {fast:.3g} {c.unit}/s, with {reversals} "
        f"{'reversal' if reversals == 1 else 'reversals'} and {still:.0%} of the time at standstill."
    )
    hints = []
    if reversals < FEW_REVERSALS:
        hints.append("Few reversals: friction is hard to tell from offsets and springs.")
    if still > MOSTLY_STILL:
        hints.append("It stands still most of the time, where friction can be anything up to its level.")
    if slow > -motion.threshold[j] or fast < motion.threshold[j]:
        hints.append("It moves in one direction only: friction cannot be told from a constant force.")
    yield Finding(decide(bool(hints)), topic, " ".join([words, *hints]), figures)


def _wraps(log: Log, spec: Spec, j: int) -> Iterator[Finding]:
    """A position that starts anew after each turn jumps by most of its range between two samples."""
    c = spec.coordinates[j]
    moves = np.abs(np.concatenate([np.diff(log.positions[start:stop, j]) for start, stop in log.segments]))
    span = float(np.ptp(log.positions[_outside_gaps(log), j]))
    jumps = moves > WRAP * span
    if (
        span > 0
        and 0 < jumps.sum() < FEW_JUMPS * len(moves)
        and moves[jumps].min() > WRAP_OVER_REST * moves[~jumps].max()
    ):
        count, size = int(jumps.sum()), float(np.median(moves[jumps]))
        words = (
            f"{c.name} jumps by {size:.4g} {c.unit} {count} times, as one that starts anew each turn: unwrap it. "
            f"`unwrap: {{COLUMN: {size:.4g}}}` in a log description does so, by the column's own unit and exact period."
        )
        yield Finding("problem", f"jumps of {c.name}", words, {"count": float(count), "size": size})


def _envelope(log: Log, spec: Spec, motion: Motion) -> Iterator[Finding]:
    outside_gaps = _outside_gaps(log)
    measured: dict[str, tuple[str, Array]] = {}
    for j, c in enumerate(spec.coordinates):
        measured[c.name] = (c.unit, log.positions[outside_gaps, j])
        measured[c.velocity] = (f"{c.unit}/s", motion.velocities[motion.usable, j])
        measured[f"{c.velocity}_dot"] = (f"{c.unit}/s^2", motion.accelerations[motion.usable, j])
    for j, i in enumerate(spec.inputs):
        measured[i.name] = (i.unit, log.inputs[outside_gaps, j])
    for name, (low_exact, high_exact) in spec.envelope.items():
        if name not in measured:
            continue
        unit, values = measured[name]
        low, high = float(low_exact), float(high_exact)
        share = float(np.mean((values < low) | (values > high)))
        if share > 0:
            words = (
                f"{name} runs from {values.min():.4g} to {values.max():.4g} {unit}, outside the spec's envelope "
                f"[{low:g}, {high:g}] for {share:.1%} of the time: the certificate does not speak for that part."
            )
            figures = {"min": float(values.min()), "max": float(values.max()), "low": low, "high": high, "share": share}
            yield Finding("warning", f"envelope of {name}", words, figures)
        size, bound = float(np.abs(values).max()), max(abs(low), abs(high))
        if 0 < size < FAR_INSIDE * bound:
            words = f"{name} stays below {size:.3g} {unit}, a small part of the spec's envelope [{low:g}, {high:g}]: "
            yield Finding(
                "warning", f"envelope of {name}", words + "is its scale right?", {"max": size, "bound": bound}
            )


def _outside_gaps(log: Log) -> NDArray[np.int64]:
    """Indices of the samples that may be used."""
    return np.concatenate([np.arange(start, stop) for start, stop in log.segments])
