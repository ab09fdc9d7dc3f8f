"""The refusal of a log with too few stretches in motion: how long it rests, and what would let it be judged."""

from __future__ import annotations

import numpy as np

from codegen.base.errors import BadInput
from codegen.diagnosis.case import HELD_OUT_SHARE, Case, holds_segments, smoothed
from codegen.diagnosis.fit.record import LEAST_SAMPLES, LEAST_SEGMENTS, PERIODS, SHORTENED, TooFewStretches
from codegen.diagnosis.fit.signals import CUTOFFS_HZ, TRIM_S, is_within_rate
from codegen.logs.excerpt import since
from codegen.logs.motion import measured_motion

MOSTLY_AT_REST = 0.5
"""Share of the time at rest from which on it is named as the cause."""


def few_stretches(case: Case, refused: TooFewStretches) -> BadInput:
    """The refusal by ``record_of``, with the time at rest, what to record, and an idle start to leave out."""
    found, expected = refused.found, refused.expected
    resting = [f"{name} rests in {share:.0%} of the time" for name, share in _at_rest(case) if share > MOSTLY_AT_REST]
    if resting:
        found += f" ({', '.join(resting)})"
        expected += f": record about {_enough_s(case):.0f} s to and fro without pauses"
    else:
        expected += f": record about {_enough_s(case, refused.count):.0f} s of such motion"
    idle = _idle_start(case)
    if idle is not None:
        line = f"`evaluation: {{from_s: {idle:.3f}}}` in meta.yaml beside the log"
        expected += f"; it rests until {idle + TRIM_S:.3f} s, which {line} leaves out"
    usual, rate = case.motion.cutoff_hz, 1 / case.log.sample_time
    higher = next((hz for hz in reversed(CUTOFFS_HZ) if hz > usual), usual)
    if not case.log.cutoff_hz and not is_within_rate(higher, case.log.sample_time):
        expected += f"; or sample faster than {rate:.4g} Hz, of which the cutoff is at most a tenth"
    return BadInput(refused.place, found, expected, code="LOG009")


def _idle_start(case: Case) -> float | None:
    """Time in s until which a log rests at its beginning, if without that it holds enough stretches; else None."""
    log, motion = case.log, measured_motion(case.log)
    moving = np.any(np.abs(motion.velocities) > motion.threshold, axis=1)
    end = float(log.time[np.argmax(moving)]) - TRIM_S
    if log.records or end <= log.time[0]:
        return None
    rest = since(log, end)
    split = round(rest.size * (1 - HELD_OUT_SHARE)) if case.test_log is None else rest.size
    try:
        return end if holds_segments(rest, smoothed(rest, case.problem.system), split) else None
    except BadInput:  # too short
        return None


def _at_rest(case: Case) -> list[tuple[str, float]]:
    """Each coordinate and its share of the time at rest, by the preflight."""
    shares = {f.topic: f.figures["standstill"] for f in case.findings["train"] if "standstill" in f.figures}
    topics = ((c.name, f"motion of {c.name}") for c in case.spec.coordinates)
    return [(name, shares[topic]) for name, topic in topics if topic in shares]


def _enough_s(case: Case, found: int = 0) -> float:
    """Seconds of motion that hold enough of the shortest stretches, with the ends and the held-out part.

    Args:
        found: stretches in the log, of whose time slow motion and gaps take as large a share as of a longer one's; 0
            for a motion without pauses.
    """
    shortest = max(SHORTENED[-1] * PERIODS / case.motion.cutoff_hz, LEAST_SAMPLES * case.log.sample_time)
    ideal = 2 * TRIM_S + LEAST_SEGMENTS * shortest / (1 - HELD_OUT_SHARE if case.test_log is None else 1)
    alike = case.log.size * case.log.sample_time * LEAST_SEGMENTS / found if found else 0.0
    return max(ideal, alike)
