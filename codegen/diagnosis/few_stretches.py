"""The refusal of a log with too few stretches in motion: how long it rests, and what would let it be judged."""

from __future__ import annotations

from dataclasses import replace

from codegen.base.errors import BadInput
from codegen.diagnosis.case import HELD_OUT_SHARE, Case, holds_segments
from codegen.diagnosis.fit.record import LEAST_SAMPLES, LEAST_SEGMENTS, PERIODS, SHORTENED
from codegen.diagnosis.fit.signals import CUTOFFS_HZ, TRIM_S, is_within_rate, smooth_motion

MOSTLY_AT_REST = 0.5
"""Share of the time at rest from which on it is named as the cause."""
HIGHEST = 0.25
"""Highest proposed cutoff over the sample rate, half of the Nyquist frequency."""


def few_stretches(case: Case, refused: BadInput) -> BadInput:
    """The refusal by ``record_of``, with the share of the time at rest, what to record, and a cutoff that passes."""
    found, expected = refused.found, refused.expected
    resting = [f"{name} rests in {share:.0%} of the time" for name, share in _at_rest(case) if share > MOSTLY_AT_REST]
    if resting:
        found += f" ({', '.join(resting)})"
        expected += f": record about {_enough_s(case):.0f} s to and fro without pauses"
    else:
        expected += f": record about {_enough_s(case):.0f} s of such motion"
    cutoff = passing_cutoff(case)
    if cutoff is not None:
        expected += f", or try `cutoff_hz: {cutoff:g}` in meta.yaml beside the log"
    return BadInput(refused.place, found, expected, code="LOG009")


def passing_cutoff(case: Case) -> float | None:
    """The lowest of the usual cutoffs above the case's at which its training part holds enough stretches, Hz."""
    log, usual, split = case.log, case.motion.cutoff_hz, len(case.problem.motion.time)
    higher = (hz for hz in reversed(CUTOFFS_HZ) if usual < hz and is_within_rate(hz, log.sample_time, HIGHEST))
    stated = (replace(log, cutoff_hz=hz) for hz in higher)
    return next((one.cutoff_hz for one in stated if holds_segments(one, smooth_motion(one), split)), None)


def _at_rest(case: Case) -> list[tuple[str, float]]:
    """Each coordinate and its share of the time at rest, by the preflight."""
    shares = {f.topic: f.figures["standstill"] for f in case.findings["train"] if "standstill" in f.figures}
    topics = ((c.name, f"motion of {c.name}") for c in case.spec.coordinates)
    return [(name, shares[topic]) for name, topic in topics if topic in shares]


def _enough_s(case: Case) -> float:
    """Seconds of motion that hold enough of the shortest stretches, with the ends and the held-out part."""
    shortest = max(SHORTENED[-1] * PERIODS / case.motion.cutoff_hz, LEAST_SAMPLES * case.log.sample_time)
    return 2 * TRIM_S + LEAST_SEGMENTS * shortest / (1 - HELD_OUT_SHARE if case.test_log is None else 1)
