"""Preflight: findings on whether a log can be diagnosed with a spec."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.logs.audit.force_audit import SIGN_OF, audit_force
from codegen.logs.audit.input_audit import is_constant
from codegen.logs.audit.scales import LONGEST_STEP
from codegen.logs.column_names import written_column
from codegen.logs.log import Finding, Log, Severity
from codegen.logs.motion import Motion, Steady, measured_motion, steady_speeds
from codegen.spec.model import Spec

SLOW_HZ = 90.0
"""Sample rate below which friction at a reversal is missed."""
LONG_STEP, SHORTEST_STEP = 0.1, 1e-6
"""Sample times in s beyond which the unit of time is in doubt."""
_UNITS_OF_TIME = ((1e5, ("nanoseconds", "1e-9")), (100.0, ("microseconds", "1e-6")), (0.0, ("milliseconds", "0.001")))
"""Step above which time may be in a unit → its name and its factor to s."""
SHORT_S, FEW_SAMPLES = 5.0, 500
"""Duration and number of samples below which a log is short."""
MUCH_JITTER = 0.05
"""RMS jitter, over a step, that is a warning."""
MANY_REPAIRED = 0.001
"""Share of rows repaired or left out that is a warning."""
FEW_REVERSALS, MOSTLY_STILL = 4, 0.8
"""Number of reversals below which, and share of standstill above which, a motion is a warning."""
COARSE = 0.1
"""Apparent speed of one encoder step in a sample, over the top speed, from which on the encoder is coarse."""
ENCODER_OFF = 0.2
"""Relative deviation of the visible encoder step from the declared one that is a warning."""
MANY_FINER = 0.05
"""Share of moves by less than half of the declared encoder step that is a warning."""
WRAP, WRAP_OVER_REST, FEW_JUMPS = 0.5, 5.0, 0.02
"""Wrap-around: least jump over the range, least jump over the largest other move, largest share of jumps."""
FAR_INSIDE = 0.01
"""Share of the envelope's bound below which a signal's scale is in doubt."""
MUCH_AT_LIMIT, TWO_LEVELS = 0.01, 0.9
"""Shares of the time at an input's extremes from which on it is limited, and switches between two levels."""
REPEATS_REPORTED, REPEATS_WARNED = 0.005, 0.05
"""Shares of repeated rows that are reported, and that are a warning."""
Kept = NDArray[np.int64]
"""Indices of the samples that lie in no gap."""


ONE_TURN = 0.05
"""Largest deviation of a jump from 2π, relative: the motion of a sample is missing in it."""


def preflight(log: Log, spec: Spec) -> tuple[Finding, ...]:
    """Audit a log against its spec.

    Returns:
        Findings on the record, the motion, the inputs, and the sign and scale of forces; in this order.

    Raises:
        BadInput: if the spec's mechanics cannot be built.
    """
    motion = measured_motion(log)
    steady = steady_speeds(log, motion.velocities, motion.usable)
    kept = _kept(log)
    return (
        *_on_record(log, reverses=len(steady) < len(spec.coordinates)),
        *_on_motion(log, spec, motion, kept),
        *_on_steady(steady, spec),
        *_on_input(log, spec, kept),
        *audit_force(log, spec, motion, frozenset(s.coordinate for s in steady)),
    )


def column_problems(log: Log, spec: Spec) -> tuple[Finding, ...]:
    """The problems of columns that ``preflight`` finds: numbers that are stored otherwise, or wrap, or else signs,
    scales and the order of columns by the balance of forces, which needs a continuous position. Of its warnings that
    on an input without its sign: the others are on the spec, or say that the columns are right.
    """
    kept = _kept(log)
    stored = [*log.raw_data.findings, *(f for j in range(len(spec.coordinates)) for f in _wraps(log, spec, kept, j))]
    if found := tuple(f for f in stored if f.severity == "problem"):
        return found
    motion = measured_motion(log)
    steady = frozenset(s.coordinate for s in steady_speeds(log, motion.velocities, motion.usable))
    audited = audit_force(log, spec, motion, steady)
    return tuple(f for f in audited if f.severity == "problem" or f.topic.startswith(SIGN_OF))


def _kept(log: Log) -> Kept:
    return np.concatenate([np.arange(start, stop) for start, stop in log.segments])


def _warning_if(warn: bool) -> Severity:
    """``warning`` if ``warn``, else ``info``."""
    return "warning" if warn else "info"


def _on_record(log: Log, reverses: bool) -> Iterator[Finding]:
    """Findings on time stamps and completeness; ``reverses``: whether a coordinate changes its speed."""
    yield _rate(log, reverses)
    yield _jitter(log)
    yield _length(log)
    yield from _gaps(log)
    yield from _repairs(log)
    yield from _stale_rows(log.raw_data.repeated, log.raw_data.stale)
    yield from log.raw_data.findings
    for note in log.notes:
        yield Finding("info", "reading", f"Reading: {note}.")


def _rate(log: Log, reverses: bool) -> Finding:
    """The sample rate, and whether the unit of time is in doubt."""
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
    if least > LONG_STEP and reverses:
        unit, factor = next(words for step, words in _UNITS_OF_TIME if least > step)
        hint = f" That is slow for friction: is time in {unit}? (`scale: {{t: {factor}}}` in meta.yaml beside the log)"
    elif most < SHORTEST_STEP and "t" in log.raw_data.inferred_units:
        hint = f" No drive is sampled as fast{log.raw_data.time_unit}. (`units: {{t: s}}` in meta.yaml beside the log)"
    elif most < SHORTEST_STEP:
        hint = " No drive is sampled as fast: is time in days? (`scale: {t: 86400}` in meta.yaml beside the log)"
    elif rate < SLOW_HZ and reverses:
        hint = f" That is slow for friction: {which} within one or two samples."
    else:
        hint = ""
    unusable = (least > LONGEST_STEP and reverses) or most < SHORTEST_STEP
    severity: Severity = "problem" if unusable else _warning_if(bool(hint))
    return Finding(severity, "sample rate", words + hint, figures)


def _jitter(log: Log) -> Finding:
    jitter = log.raw_data.jitter
    figures = {"jitter": jitter, "longest_step": log.raw_data.longest_step}
    if not log.raw_data.resampled:
        return Finding("info", "jitter", "The time stamps are regular; no value was touched.", figures)
    words = f"The time stamps are irregular (RMS jitter {jitter:.1%} of a step): the data were put on a uniform grid."
    if jitter > MUCH_JITTER:
        words += " They hide effects faster than a few samples (delay, lag)."
    return Finding(_warning_if(jitter > MUCH_JITTER), "jitter", words, figures)


def _length(log: Log) -> Finding:
    parts = log.records or (log,)
    samples, seconds = sum(part.used for part in parts), sum(part.duration for part in parts)
    short = seconds < SHORT_S or samples < FEW_SAMPLES
    words = f"{samples} samples over {seconds:.4g} s{f', in {len(parts)} records' if len(parts) > 1 else ''}."
    if short:
        words += " That is little: several reversals and a range of speeds are needed to tell effects apart."
    return Finding(_warning_if(short), "duration", words, {"samples": float(samples), "duration": seconds})


def _gaps(log: Log) -> Iterator[Finding]:
    gaps = [gap for gap in log.gaps if gap not in log.joints]
    lost = sum(stop - start for start, stop in gaps)
    if lost:
        share = lost / (log.used + lost)
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        words = f"{count}, {lost * log.sample_time:.3g} s in all ({share:.1%} of the record), left out."
        figures = {"gaps": float(len(gaps)), "share": share, "seconds": lost * log.sample_time}
        yield Finding("warning", "gaps", words, figures)


def _repairs(log: Log) -> Iterator[Finding]:
    for symbol, count in log.raw_data.repaired.items():
        share = count / max(log.raw_data.rows, 1)
        words = f"{symbol}: {count} missing values ({share:.2%}) were filled in."
        yield Finding(
            _warning_if(share > MANY_REPAIRED), "missing values", words, {"count": float(count), "share": share}
        )
    if log.raw_data.dropped:
        share = log.raw_data.dropped / (log.raw_data.rows + log.raw_data.dropped)
        words = f"{log.raw_data.dropped} rows ({share:.2%}) repeat a time stamp or have none, and were left out."
        figures = {"count": float(log.raw_data.dropped), "share": share}
        yield Finding(_warning_if(share > MANY_REPAIRED), "repeated rows", words, figures)


def _stale_rows(share: float, in_motion: float) -> Iterator[Finding]:
    """Findings on rows that repeat the one before, as if a bus is read faster than its values are updated."""
    words = (
        f"{share:.1%} of the rows repeat the motion of the row before ({in_motion:.1%} of those in fast motion). Such "
        "rows are stale, unless the machine stands still or its measuring step is coarse."
    )
    if many := in_motion >= REPEATS_WARNED:
        words += " They look like a delay of a row or two, which this log cannot show."
    if max(share, in_motion) >= REPEATS_REPORTED:
        yield Finding(_warning_if(many), "stale rows", words, {"share": share, "in_motion": in_motion})


def _on_motion(log: Log, spec: Spec, motion: Motion, kept: Kept) -> Iterator[Finding]:
    """Findings on each coordinate."""
    if not motion.usable.any():
        words = f"No stretch of the log is long enough to differentiate at a cut-off of {motion.cutoff_hz:.3g} Hz."
        yield Finding("problem", "motion", words, {"cutoff_hz": motion.cutoff_hz})
        return
    for j in range(len(spec.coordinates)):
        yield _encoder(log, spec, motion, j)
        yield _coordinate(log, spec, motion, kept, j)
        yield from _wraps(log, spec, kept, j)
    yield from _envelope(log, spec, motion, kept)


def _encoder(log: Log, spec: Spec, motion: Motion, j: int) -> Finding:
    """The quantisation step of a position, visible and declared."""
    c = spec.coordinates[j]
    seen = log.raw_data.smallest_step[j] if log.raw_data.smallest_step else 0.0
    declared = log.encoder_step[j] if log.encoder_step else 0.0
    noise = float(np.std((log.positions - motion.positions)[motion.usable, j]))
    figures = {"seen": seen, "declared": declared, "noise_rms": noise}
    topic, step = f"resolution of {c.name}", seen or declared
    if declared and seen and abs(seen / declared - 1) > ENCODER_OFF:
        words = f"{c.name} moves in steps of {seen:.4g} {c.unit}, while the description says {declared:.4g}."
        return Finding("warning", topic, words, figures)
    moves = _moves(log, j)[_moves(log, j) > 1e-6 * declared]
    finer = float(np.mean(moves < declared / 2)) if len(moves) else 0.0
    if finer > MANY_FINER and declared and not (seen or log.raw_data.resampled):
        figures |= {"finer": finer}
        words = (
            f"{c.name} moves by less than half of the described step, {declared:.4g} {c.unit}, in {finer:.0%} of the "
            f"rows in which it moves: is `encoder_step` in {c.unit}, and of this column?"
        )
        return Finding("warning", topic, words, figures)
    if not step:
        words = f"{c.name} shows no measuring step; noise above {motion.cutoff_hz:.3g} Hz: RMS {noise:.3g} {c.unit}."
        return Finding("info", topic, words, figures)
    top = float(np.abs(motion.velocities[motion.usable, j]).max())
    creep = step * 2 * motion.cutoff_hz  # the speed that one step within half a period of the cut-off amounts to
    words = f"{c.name} is measured in steps of {step:.4g} {c.unit}."
    if creep > COARSE * top:
        words += f" That is coarse: one step looks like {creep:.2g} {c.unit}/s, where the top speed is {top:.2g}."
    return Finding(_warning_if(creep > COARSE * top), topic, words, figures)


def _moves(log: Log, j: int) -> Array:
    """By how much a position changes from sample to sample, without its sign."""
    return np.asarray(np.abs(np.concatenate([np.diff(log.positions[a:b, j]) for a, b in log.segments])))


def _coordinate(log: Log, spec: Spec, motion: Motion, kept: Kept, j: int) -> Finding:
    """Range, speed, reversals and standstill of a coordinate."""
    c = spec.coordinates[j]
    position, velocity = log.positions[kept, j], motion.velocities[motion.usable, j]
    low, high = float(position.min()) + 0.0, float(position.max()) + 0.0  # no -0
    slow, fast = float(velocity.min()), float(velocity.max())
    reversals, still, threshold = motion.reversals[j], motion.standstill[j], float(motion.threshold[j])
    figures = {"position_min": low, "position_max": high, "velocity_min": slow, "velocity_max": fast}
    figures |= {"reversals": float(reversals), "standstill": still, "threshold": threshold}
    topic = f"motion of {c.name}"
    if high == low or still == 1.0:
        words = f"{c.name} does not move: it stays within {high - low:.3g} {c.unit} of {low:.4g}."
        return Finding("problem" if len(spec.coordinates) == 1 else "warning", topic, words, figures)
    words = (
        f"{c.name} covers {low:.4g} to {high:.4g} {c.unit} at {slow:.3g} to {fast:.3g} {c.unit}/s, with {reversals} "
        f"{'reversal' if reversals == 1 else 'reversals'} and {still:.0%} of the time at standstill."
    )
    hints = []
    if reversals < FEW_REVERSALS:
        hints.append("Few reversals: friction is hard to tell from offsets and springs.")
    if still > MOSTLY_STILL:
        hints.append("It stands still most of the time, when friction can be anything up to its level.")
    if slow > -threshold or fast < threshold:
        hints.append(
            "It moves in one direction only: friction cannot be told from a constant force, nor from cogging where it "
            "depends on the position."
        )
    return Finding(_warning_if(bool(hints)), topic, " ".join([words, *hints]), figures)


def _wraps(log: Log, spec: Spec, kept: Kept, j: int) -> Iterator[Finding]:
    """A finding on a position that wraps around after each turn: it jumps by most of its range between two samples."""
    c = spec.coordinates[j]
    moves = _moves(log, j)
    span = float(np.ptp(log.positions[kept, j]))
    jumps = moves > WRAP * span
    if (
        span > 0
        and 0 < jumps.sum() < FEW_JUMPS * len(moves)
        and moves[jumps].min() > WRAP_OVER_REST * moves[~jumps].max()
    ):
        count, size = int(jumps.sum()), float(np.median(moves[jumps]))
        words = (
            f"{c.name} jumps by {size:.4g} {c.unit} {count} times, as if it wraps around each turn. Unwrap it: "
            f"{_unwrapping(log, spec, j, size)}."
        )
        yield Finding("problem", f"jumps of {c.name}", words, {"count": float(count), "size": size})


def _unwrapping(log: Log, spec: Spec, j: int, size: float) -> str:
    """The line of meta.yaml that unwraps a position: by one turn, if it jumps by about that in a known unit."""
    c, where = spec.coordinates[j], "in meta.yaml beside the log"
    column, unit = log.raw_data.columns.get(c.name), log.units.get(c.name, c.unit)
    turn = {"rad": "2*pi", "deg": "360"}.get(unit) if c.unit == "rad" else None
    if column is None or turn is None or abs(size / (2 * np.pi) - 1) > ONE_TURN:
        return f"`unwrap: {{COLUMN: {size:.4g}}}` {where}, in the column's own unit and exact period"
    return f"`unwrap: {{{written_column(column)}: {turn}}}` {where}, one turn in {unit}"


def _envelope(log: Log, spec: Spec, motion: Motion, kept: Kept) -> Iterator[Finding]:
    """Findings on signals outside the envelope, or far inside."""
    measured: dict[str, tuple[str, Array]] = {}
    for j, c in enumerate(spec.coordinates):
        measured[c.name] = (c.unit, log.positions[kept, j])
        measured[c.velocity] = (f"{c.unit}/s", motion.velocities[motion.usable, j])
        measured[f"{c.velocity}_dot"] = (f"{c.unit}/s^2", motion.accelerations[motion.usable, j])
    for j, i in enumerate(spec.inputs):
        measured[i.name] = (i.unit, log.inputs[kept, j])
    for name, (low_exact, high_exact) in spec.envelope.items():
        if name not in measured:
            continue
        unit, values = measured[name]
        low, high = float(low_exact), float(high_exact)
        span = Span(name, unit, low, high)
        span.add(values)
        if span.finding is not None:
            yield span.finding
        size, bound = float(np.abs(values).max()), max(abs(low), abs(high))
        if 0 < size < FAR_INSIDE * bound:
            words = f"{name} stays below {size:.3g} {unit}, a small part of the spec's envelope [{low:g}, {high:g}]: "
            figures = {"max": size, "bound": bound}
            yield Finding("warning", f"envelope of {name}", words + "is its scale right?", figures)


def _on_steady(steady: list[Steady], spec: Spec) -> Iterator[Finding]:
    """Findings on coordinates that run at constant speed."""
    for one in steady:
        c = spec.coordinates[one.coordinate]
        unit = f"{c.unit}/s"
        speeds = f"at {one.slowest:.3g} {unit}"
        if one.records > 1:
            speeds = f"in {one.records} of its {one.of} records, from {one.slowest:.3g} to {one.fastest:.3g} {unit}"
        words = (
            f"{c.name} runs at constant speed, {speeds}. Such a log shows friction over speed and forces that repeat "
            "with position. It does not show inertia, delays or effects at reversals."
        )
        figures = {"share": one.records / one.of, "records": float(one.records)}
        figures |= {"slowest": one.slowest, "fastest": one.fastest}
        yield Finding("info", f"steady speeds of {c.name}", words, figures)


def _on_input(log: Log, spec: Spec, kept: Kept) -> Iterator[Finding]:
    """Findings on each input: zero, constant, or at its limits."""
    for j, i in enumerate(spec.inputs):
        values, topic = log.inputs[kept, j], f"input {i.name}"
        low, high = float(values.min()), float(values.max())
        span, figures = high - low, {"min": low, "max": high, "rms": float(np.sqrt(np.mean(values**2)))}
        if is_constant(values):
            words = f"{i.name} is zero throughout" if high == 0 else f"{i.name} is constant at {low:.4g} {i.unit}"
            severity: Severity = "problem" if len(spec.inputs) == 1 else "warning"
            yield Finding(severity, topic, f"{words}: nothing can be learnt of how it acts.", figures)
            continue
        at_low, at_high = float(np.mean(values <= low + 1e-6 * span)), float(np.mean(values >= high - 1e-6 * span))
        figures |= {"share_at_min": at_low, "share_at_max": at_high}
        words = f"{i.name} runs from {low:.4g} to {high:.4g} {i.unit}, RMS {figures['rms']:.4g}."
        switches = at_low + at_high > TWO_LEVELS
        held = not switches and max(at_low, at_high) > MUCH_AT_LIMIT
        if switches:
            words += " It switches between these two levels."
        if held:
            words += f" It is at its extreme for {at_low + at_high:.1%} of the time, as if limited."
        yield Finding(_warning_if(held), topic, words, figures)


@dataclass
class Span:
    """The range of a signal's values so far, and its range in the envelope.

    Attributes:
        low, high: the envelope's range, in ``unit``.
        least, most: of the finite values.
    """

    name: str
    unit: str
    low: float
    high: float
    least: float = float("inf")
    most: float = float("-inf")
    count: int = 0
    outside: int = 0

    def add(self, values: Array) -> None:
        """Count further values, (N,)."""
        finite = values[np.isfinite(values)]
        if len(finite):
            self.least, self.most = min(self.least, float(finite.min())), max(self.most, float(finite.max()))
            self.count += len(finite)
            self.outside += int(np.count_nonzero((finite < self.low) | (finite > self.high)))

    @property
    def finding(self) -> Finding | None:
        """A warning if a value is outside the envelope, else None."""
        if not self.outside:
            return None
        share = self.outside / self.count
        words = (
            f"{self.name} runs from {self.least:.4g} to {self.most:.4g} {self.unit}, outside the spec's envelope "
            f"[{self.low:g}, {self.high:g}] for {share:.1%} of the time: the certificate does not cover that part."
        )
        figures = {"min": self.least, "max": self.most, "low": self.low, "high": self.high, "share": share}
        return Finding("warning", f"envelope of {self.name}", words, figures)
