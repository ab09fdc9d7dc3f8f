"""The unit that time seems to be in, from the step of a log over the step that was expected of it."""

from __future__ import annotations

from codegen.logs.uniform import JITTER

UNITS = (
    (1e3, "milliseconds", "0.001"),
    (1e6, "microseconds", "1e-6"),
    (1e9, "nanoseconds", "1e-9"),
    (1 / 60, "minutes", "60"),
    (1 / 3600, "hours", "3600"),
    (1 / 86400, "days", "86400"),
)
"""Step in the unit, taken as s, over the same step in s; the unit; its factor to s."""
MEANT = ((1e-3, "ms"), (1e-6, "us"))
"""Step of a log over a sample time that was written in a smaller unit, and is read as s."""


def time_unit_hint(step: float, period: float, scale: float, taken: bool) -> str:
    """A question with its remedy; empty where the steps differ by no factor between units of time.

    Args:
        step: of the log, s. period: of the observer, s.
        scale: stated factor of the log's time; 1 where none is.
        taken: whether the file or its description states the unit of time.
    """
    ratio = step / period
    if scale != 1 and _equal(ratio, scale):
        return f"is time in s before `scale: {{t: {scale:g}}}`? (leave that out of meta.yaml)"
    if taken and any(_equal(ratio, times) for times, *_ in (*UNITS, *MEANT)):
        return "is time in another unit? (`units: {t: UNIT}` in meta.yaml beside the log)"
    for times, unit, factor in UNITS:
        if _equal(ratio, times):
            stated = factor if scale == 1 else f"{float(factor) * scale:g}"
            return f"is time in {unit}? (`scale: {{t: {stated}}}` in meta.yaml beside the log)"
    for times, unit in MEANT:
        if _equal(ratio, times):
            return f"is the observer's sample time meant in {unit}? (`sample_time: {period:g} {unit}` in the spec)"
    return ""


def _equal(ratio: float, times: float) -> bool:
    return abs(ratio / times - 1) <= JITTER
