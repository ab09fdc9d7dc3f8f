"""Preflight of the inputs: constant, zero, at their limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from codegen.logs.finding import Finding, Severity
from codegen.logs.log import Array, Log
from codegen.spec.model import Spec

MUCH_AT_LIMIT = 0.01
TWO_LEVELS = 0.9


def audit_input(log: Log, spec: Spec) -> Iterator[Finding]:
    """What there is to say of each input."""
    kept = np.concatenate([np.arange(start, stop) for start, stop in log.segments])
    for j, declared in enumerate(spec.inputs):
        yield _input(declared.name, declared.unit, log.inputs[kept, j], only=len(spec.inputs) == 1)


def _input(name: str, unit: str, values: Array, only: bool) -> Finding:
    low, high = float(values.min()), float(values.max())
    span, topic = high - low, f"input {name}"
    rms = float(np.sqrt(np.mean(values**2)))
    if span <= 1e-9 * max(abs(low), abs(high)):
        words = f"{name} is zero throughout" if high == 0 else f"{name} is constant at {low:.4g} {unit}"
        severity: Severity = "problem" if only else "warning"
        figures = {"min": low, "max": high, "rms": rms}
        return Finding(severity, topic, f"{words}: nothing can be learnt of how it acts.", figures)
    near = 1e-6 * span
    at_low, at_high = float(np.mean(values <= low + near)), float(np.mean(values >= high - near))
    figures = {"min": low, "max": high, "rms": rms, "share_at_min": at_low, "share_at_max": at_high}
    words = f"{name} runs from {low:.4g} to {high:.4g} {unit}, RMS {rms:.4g}."
    if at_low + at_high > TWO_LEVELS:
        return Finding("info", topic, f"{words} It switches between these two levels.", figures)
    held = max(at_low, at_high)
    if held > MUCH_AT_LIMIT:
        words += f" It is at its extreme for {at_low + at_high:.1%} of the time, as if limited."
        return Finding("warning", topic, words, figures)
    return Finding("info", topic, words, figures)
