"""Preflight of the record itself: rate, jitter, length, gaps, repairs."""

from __future__ import annotations

from collections.abc import Iterator

from codegen.logs.finding import Finding, Severity, decide
from codegen.logs.log import Log

SLOW_HZ = 90.0
LONG_STEP = 0.1
UNUSABLE_STEP = 0.5
SHORT_S = 5.0
FEW_SAMPLES = 500
MUCH_JITTER = 0.05
MANY_REPAIRED = 0.001


def audit_record(log: Log) -> Iterator[Finding]:
    """What there is to say of the time stamps and the completeness of a log."""
    yield _rate(log)
    yield _jitter(log)
    yield _length(log)
    yield from _gaps(log)
    yield from _repairs(log)
    for words in log.description.unknown:
        yield Finding("warning", "description", words[0].upper() + words[1:] + ".")
    for note in log.notes[len(log.description.unknown) :]:
        yield Finding("info", "reading", note[0].upper() + note[1:] + ".")


def _rate(log: Log) -> Finding:
    rate = 1 / log.sample_time
    words = f"Sampled at {rate:.6g} Hz (every {1e3 * log.sample_time:.6g} ms)."
    if log.sample_time > LONG_STEP:
        hint = " That is slow for friction: is time in milliseconds? (`scale: {t: 0.001}` in a log description)"
    elif rate < SLOW_HZ:
        hint = " That is slow for friction: a reversal passes within one or two samples."
    else:
        hint = ""
    severity: Severity = "problem" if log.sample_time > UNUSABLE_STEP else decide(bool(hint))
    return Finding(severity, "sample rate", words + hint, {"rate_hz": rate, "sample_time": log.sample_time})


def _jitter(log: Log) -> Finding:
    jitter = log.intake.jitter
    figures = {"jitter": jitter, "longest_step": log.intake.longest_step}
    if not log.intake.resampled:
        return Finding("info", "jitter", "The time stamps are regular; no value was touched.", figures)
    words = f"The time stamps are irregular (RMS jitter {jitter:.1%} of a step): the data were put on a uniform grid."
    if jitter > MUCH_JITTER:
        words += " Effects faster than a few samples (delay, lag) cannot be told from the jitter."
    return Finding(decide(jitter > MUCH_JITTER), "jitter", words, figures)


def _length(log: Log) -> Finding:
    short = log.duration < SHORT_S or log.size < FEW_SAMPLES
    words = f"{log.size} samples over {log.duration:.4g} s."
    if short:
        words += " That is little: several reversals and a range of speeds are needed to tell effects apart."
    return Finding(decide(short), "duration", words, {"samples": float(log.size), "duration": log.duration})


def _gaps(log: Log) -> Iterator[Finding]:
    lost = sum(stop - start for start, stop in log.gaps)
    if lost:
        share = lost / log.size
        words = (
            f"{len(log.gaps)} gaps, {lost * log.sample_time:.3g} s in all ({share:.1%} of the record), are left out."
        )
        yield Finding(
            "warning", "gaps", words, {"gaps": float(len(log.gaps)), "share": share, "seconds": lost * log.sample_time}
        )


def _repairs(log: Log) -> Iterator[Finding]:
    for symbol, count in log.intake.repaired.items():
        share = count / max(log.intake.rows, 1)
        words = f"{symbol}: {count} missing values ({share:.2%}) were filled in."
        yield Finding(decide(share > MANY_REPAIRED), "missing values", words, {"count": float(count), "share": share})
    if log.intake.dropped:
        share = log.intake.dropped / (log.intake.rows + log.intake.dropped)
        words = f"{log.intake.dropped} rows ({share:.2%}) repeat a time stamp or have none, and were left out."
        yield Finding(
            decide(share > MANY_REPAIRED), "repeated rows", words, {"count": float(log.intake.dropped), "share": share}
        )
