"""Preflight of the record itself: rate, jitter, length, gaps, repairs."""

from __future__ import annotations

from collections.abc import Iterator

from codegen.logs.counters import repeat_finding
from codegen.logs.finding import Finding, Severity, decide
from codegen.logs.log import Log

SLOW_HZ = 90.0
LONG_STEP = 0.1
UNUSABLE_STEP = 0.5
SHORTEST_STEP = 1e-6
_UNITS_OF_TIME = ((1e5, ("nanoseconds", "1e-9")), (100.0, ("microseconds", "1e-6")), (0.0, ("milliseconds", "0.001")))
SHORT_S = 5.0
FEW_SAMPLES = 500
MUCH_JITTER = 0.05
MANY_REPAIRED = 0.001


def audit_record(log: Log, turns: bool = True) -> Iterator[Finding]:
    """What there is to say of the time stamps and the completeness of a log.

    Args:
        turns: whether some coordinate changes its speed, so that a slow rate loses what happens at reversals.
    """
    yield _rate(log, turns)
    yield _jitter(log)
    yield _length(log)
    yield from _gaps(log)
    yield from _repairs(log)
    yield from repeat_finding(log.intake.repeated, log.intake.stale)
    yield from log.intake.findings
    for note in log.notes:
        yield Finding("info", "reading", f"Reading: {note}.")


def _rate(log: Log, turns: bool) -> Finding:
    steps = [record.sample_time for record in log.records] or [log.sample_time]
    least, most = min(steps), max(steps)
    rate, figures = 1 / most, {"rate_hz": 1 / most, "sample_time": most}
    words = f"Sampled at {rate:.6g} Hz (every {1e3 * most:.6g} ms)."
    which = "a reversal passes"
    if len(steps) > 1:
        slow = sum(1 / step < SLOW_HZ for step in steps)
        words = f"{len(steps)} records, sampled at {rate:.6g} Hz (every {1e3 * most:.6g} ms)."
        if most > least * 1.01:
            words = f"{len(steps)} records, each at its own rate, {rate:.4g} to {1 / least:.4g} Hz."
        which = f"in {slow} of them a reversal passes"
        figures |= {"records": float(len(steps)), "slow": float(slow)}
    if least > LONG_STEP and turns:
        unit, factor = next(words for step, words in _UNITS_OF_TIME if least > step)
        hint = f" That is slow for friction: is time in {unit}? (`scale: {{t: {factor}}}` in a log description)"
    elif most < SHORTEST_STEP and "t" in log.intake.brought:
        hint = f" No drive is sampled as fast{log.intake.time_unit}. (`units: {{t: s}}` in a log description)"
    elif most < SHORTEST_STEP:
        hint = " No drive is sampled as fast: is time in days? (`scale: {t: 86400}` in a log description)"
    elif rate < SLOW_HZ and turns:
        hint = f" That is slow for friction: {which} within one or two samples."
    else:
        hint = ""
    unusable = (least > UNUSABLE_STEP and turns) or most < SHORTEST_STEP
    severity: Severity = "problem" if unusable else decide(bool(hint))
    return Finding(severity, "sample rate", words + hint, figures)


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
    parts = log.records or (log,)
    samples, seconds = sum(part.used for part in parts), sum(part.duration for part in parts)
    short = seconds < SHORT_S or samples < FEW_SAMPLES
    words = f"{samples} samples over {seconds:.4g} s{f', in {len(parts)} records' if len(parts) > 1 else ''}."
    if short:
        words += " That is little: several reversals and a range of speeds are needed to tell effects apart."
    return Finding(decide(short), "duration", words, {"samples": float(samples), "duration": seconds})


def _gaps(log: Log) -> Iterator[Finding]:
    gaps = [gap for gap in log.gaps if gap not in log.joints]
    lost = sum(stop - start for start, stop in gaps)
    if lost:
        share = lost / (log.used + lost)
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        words = f"{count}, {lost * log.sample_time:.3g} s in all ({share:.1%} of the record), left out."
        yield Finding(
            "warning", "gaps", words, {"gaps": float(len(gaps)), "share": share, "seconds": lost * log.sample_time}
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
