"""Condition monitoring: the observer's friction estimate compared with the declared friction law, on a running machine.

``certify`` gives a bound on |estimate − law|, in newtons. It holds while the machine is as declared and every contact
slides in one direction, faster than its own threshold (``slip_speeds``). If the difference exceeds the bound for the
dwell time, the friction has changed, or a force acts that the model does not have: an alarm is raised.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.certify.bound.bounds import ErrorBound, SlipSpeed
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.system import System
from codegen.observers.equations import ErrorVariable, Observer
from codegen.program import Program
from codegen.replay.engine import Engine
from codegen.replay.samples import Block
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import Spec

QUIET = 100
"""Number of dwell times within the bound after which an alarm is cleared and another one can be raised."""


@dataclass(frozen=True)
class Limit:
    """The bound on the error of one friction estimate.

    Attributes:
        output: name of the observer's output.
        where: the friction in words, such as "friction at rail (x)".
        bound: largest error, in ``unit``, from ``settle`` samples after a reversal on: the last of the bounds that
            ``certify`` states for the times after a reversal.
        steady: the smaller bound long after a reversal, to which those decrease.
    """

    output: str
    where: str
    bound: float
    unit: str
    steady: float


@dataclass
class Alarm:
    """An alarm: an estimate was outside its bound for the dwell time.

    Attributes:
        where, bound, unit: as of its ``Limit``.
        since: time of the first sample outside, s.
        raised: time at which the dwell time was over and the alarm was raised, s.
        until: time of the last sample outside, s.
        ended: whether the estimate has since been within its bound for ``QUIET`` dwell times.
        cleared: time at which these were over, s; None before.
        worst: difference from the declared friction of the largest magnitude, with its sign, in ``unit``.
        compared: number of judged samples from ``since`` to ``cleared``, or to the end of the log.
        outside: how many of them were outside the bound.
        period: sample time, s, for the number of decimals of printed times; not in ``content``.
    """

    where: str
    since: float
    raised: float
    worst: float
    bound: float
    unit: str
    until: float
    ended: bool = False
    cleared: float | None = None
    compared: int = 0
    outside: int = 0
    period: float = 0.0

    @property
    def content(self) -> dict[str, Any]:
        """Its part of the JSON object that ``watch`` prints."""
        return {key: value for key, value in asdict(self).items() if key != "period"}


@dataclass
class _Comparison:
    """State of the comparison of one estimate with its bound.

    Attributes:
        count: judged samples in a row outside the bound.
        quiet: judged samples in a row within it.
        since, worst: as of the ``Alarm`` that is raised if the samples outside last for the dwell time.
        alarm: the one that is raised and not cleared.
    """

    count: int = 0
    quiet: int = 0
    since: float = float("nan")
    worst: float = 0.0
    alarm: Alarm | None = None


@dataclass
class Tally:
    """Counts and extremes so far. A sample is judged if the bound applies to it.

    Attributes:
        samples, judged: number of all samples, and of those judged.
        outside: number of samples with an estimated velocity outside the envelope.
        faults: number of invalid samples, at which the observer held its estimates.
        slow: of the others, number of those with a contact no faster than its entry of the bound's ``slip_speeds``.
        early: of the rest, number of those less than ``settle`` samples after a reversal or a sample not judged.
        first, last: times of the first and the last sample, s.
        period: sample time, s.
        worst: for each limit, the largest difference on judged samples as a share of its bound.
    """

    samples: int = 0
    judged: int = 0
    outside: int = 0
    faults: int = 0
    slow: int = 0
    early: int = 0
    first: float = float("nan")
    last: float = float("nan")
    period: float = 0.0
    worst: list[float] = field(default_factory=list)


class Watch:
    """Monitor of an observer's estimates against their bounds, block by block.

    Attributes:
        limits: one for each bound.
        settle: number of samples after a reversal from which on all bounds hold. The bound's own time counts from the
            end of a reversal, the samples here from the first one above every threshold, which may be within it; so
            the samples that the longest proved reversal takes are added.
        alarms: those raised so far, in the order of time.
        tally: counts so far.
    """

    def __init__(
        self,
        spec: Spec,
        observer: Observer,
        program: Program,
        bounds: Sequence[ErrorBound],
        engine: Engine,
        period: float,
        dwell: int,
    ) -> None:
        """The limits of each estimate, from the bounds on its error.

        Args:
            bounds: on every friction error; those proved for the C are used if there are any.
            period: sample time, s.
            dwell: number of judged samples in a row outside a bound that raises an alarm.
        """
        self._engine, self._dwell = engine, max(dwell, 1)
        self.settle = max((round(time / period) for b in bounds for time, _ in b.after[-1:]), default=0)
        self.settle += max((b.reversal.samples for b in bounds if b.reversal), default=0)
        by_name = {error.symbol.name: error for error in observer.errors}
        errors, system = [by_name[b.name] for b in bounds], observer.system
        self.limits = tuple(_limit(b, e, system) for b, e in zip(bounds, errors, strict=True))
        names = [name for name, _, _ in program.outputs]
        self._outputs = [names.index(limit.output) for limit in self.limits]
        self._velocities = [names.index(f"{v}_hat") for v in spec.velocities]
        inputs = [f.name for f in program.inputs]
        self._positions = [inputs.index(x) for x in spec.positions]
        self._speeds = bounds[0].slip_speeds
        self._least = np.array([speed.seen for speed in self._speeds])
        self._too_slow = np.zeros(len(self._speeds), dtype=int)  # samples, of each contact
        self._ranges = np.array([[float(e) for e in spec.envelope.get(v, (-np.inf, np.inf))] for v in spec.velocities])
        self._limited = [v for v in spec.velocities if v in spec.envelope]
        self._declared = _declared(system, errors)
        self._since, self._signs = 0, np.zeros(len(system.contacts))
        self._out = [_Comparison() for _ in self.limits]
        self.alarms: list[Alarm] = []
        self.tally = Tally(period=period, worst=[0.0] * len(self.limits))

    def take(self, block: Block) -> list[Alarm]:
        """Run the observer over a block of samples, and return the alarms raised in it."""
        self._since = 0 if block.fresh else self._since
        estimates, faults = self._engine.take(block)
        x, v = block.rows[:, self._positions], estimates[:, self._velocities]
        friction, slip = np.split(at_points(self._declared, np.hstack([x, v]))[:, :, 0], [len(self.limits)], axis=1)
        apart = estimates[:, self._outputs] - friction
        held = (faults != 0) | ~np.isfinite(apart).all(axis=1)
        left = np.asarray(((v < self._ranges[:, 0]) | (v > self._ranges[:, 1])).any(axis=1))
        begun: list[Alarm] = []
        for k in range(len(block.time)):
            signs = np.sign(slip[k]) * (np.abs(slip[k]) > self._least)
            steady = not held[k] and not left[k] and bool(signs.all()) and bool((signs == self._signs).all())
            self._since, self._signs = self._since + 1 if steady else 0, signs
            if steady and self._since > self.settle:
                self.tally.judged += 1
                begun += self._judge(float(block.time[k]), apart[k])
                continue
            if not steady:  # the counts of samples outside start again; raised alarms stay
                for out in self._out:
                    out.count, out.worst = 0, 0.0 if out.alarm is None else out.worst
            if not held[k] and not left[k]:
                self.tally.slow += not signs.all()
                self._too_slow += signs == 0
                self.tally.early += bool(signs.all())
        tally = self.tally
        tally.first = tally.first if tally.samples else float(block.time[0])
        tally.last, tally.samples = float(block.time[-1]), tally.samples + len(block.time)
        tally.outside, tally.faults = tally.outside + int(left.sum()), tally.faults + int((faults != 0).sum())
        return begun

    def uncompared(self) -> str | None:
        """The reason that applies to most samples why they were not judged, in words; None if one was judged."""
        tally, names = self.tally, " and ".join(self._limited)
        if tally.judged or not tally.samples:
            return None if tally.judged else "nothing was compared: no sample was read"
        of = f"of {tally.samples} samples"
        after = f"{self.settle * tally.period:.4g} s after a reversal, a stop, or a sample that cannot be compared"
        slow = [
            f"{speed.contact} no faster than {speed.seen:.3g} {speed.unit} in {count}"
            for speed, count in zip(self._speeds, self._too_slow, strict=True)
            if count
        ]
        reasons = [
            (
                tally.outside,
                f"{tally.outside} {of} were outside the envelope of {names}: the unit or scale of a column or of time "
                "may be wrong, or two columns exchanged",
            ),
            (tally.faults, f"{tally.faults} {of} were invalid"),
            (tally.slow, f"in {tally.slow} {of} a contact was too slow for the bound: {', '.join(slow)}"),
            (tally.early, f"{tally.early} {of} were less than {after}"),
        ]
        return f"nothing was compared: {max(reasons)[1]}"

    def _judge(self, time: float, apart: Array) -> list[Alarm]:
        """Compare one sample with every bound, and return the alarms that are raised with it."""
        begun = []
        for j, (limit, out) in enumerate(zip(self.limits, self._out, strict=True)):
            value = float(apart[j])
            self.tally.worst[j] = max(self.tally.worst[j], abs(value) / limit.bound)
            if out.alarm is not None:
                out.alarm.compared += 1
            if abs(value) <= limit.bound:
                self._within(out, time)
                continue
            out.count, out.since = out.count + 1, time if out.count == 0 else out.since
            out.quiet = 0
            out.worst = value if abs(value) > abs(out.worst) else out.worst
            if out.alarm is not None:
                out.alarm.worst, out.alarm.until = out.worst, time
                out.alarm.outside += 1
            elif out.count >= self._dwell:
                out.alarm = Alarm(limit.where, out.since, time, out.worst, limit.bound, limit.unit, time)
                out.alarm.compared = out.alarm.outside = out.count
                out.alarm.period = self.tally.period
                self.alarms.append(out.alarm)
                begun.append(out.alarm)
        return begun

    def _within(self, out: _Comparison, time: float) -> None:
        """Count a sample within the bound; enough of them clear an alarm."""
        out.count, out.quiet = 0, out.quiet + 1
        if out.alarm is None:
            out.worst = 0.0
        elif out.quiet >= QUIET * self._dwell:
            out.alarm.ended, out.alarm.cleared = True, time
            out.alarm, out.worst = None, 0.0


def _limit(stated: ErrorBound, error: ErrorVariable, system: System) -> Limit:
    """The output whose error is bounded, with the last and smallest bound after a reversal."""
    bound = stated.after[-1][1]
    if error.contact is None:
        name = system.positions[error.coordinate or 0].name
        return Limit(f"F_hat_on_{name}", f"friction on {name}", bound, stated.unit, stated.steady)
    name, column = system.contacts[error.contact].name, system.distribution[:, error.contact]
    moved = [x.name for x, entry in zip(system.positions, column, strict=True) if entry != 0]
    return Limit(f"a_hat_{name}", f"friction at {name} ({', '.join(moved)})", bound, stated.unit, stated.steady)


def _declared(system: System, errors: Sequence[ErrorVariable]) -> Any:
    """CasADi function of the column (x, v) → the column of the declared friction of each error, and slip velocities."""
    slip = system.slip_velocity
    levels = [c.law.level(Magnitude(u), c.law_parameters) for c, u in zip(system.contacts, slip, strict=True)]
    friction = system.distribution * sympy.Matrix([Sgn(u) * a for u, a in zip(slip, levels, strict=True)])
    wanted = [friction[e.coordinate or 0] if e.contact is None else levels[e.contact] for e in errors]
    return function_of(sympy.Matrix([*wanted, *slip]), (*system.positions, *system.velocities), system.values)


def too_slow(bounds: Sequence[ErrorBound]) -> SlipSpeed | None:
    """A contact that is too slow for the bounds in the whole envelope, so that no sample could be judged; or None."""
    return next((speed for speed in bounds[0].slip_speeds if speed.fastest <= speed.seen), None)


def is_watchable(system: System) -> bool:
    """Whether every contact has a law of zero memory, so that the declared friction is a function of the velocity."""
    return not any(c.law.states for c in system.contacts)
