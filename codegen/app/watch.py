"""``stiction watch``: the generated observer on a running machine, compared with the certified bound."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from codegen.app.derived import Derived, Source, derived_from
from codegen.base.border import verb
from codegen.base.errors import BadInput, Place
from codegen.base.interrupt import on_interrupt
from codegen.base.result import Result, named
from codegen.base.text import render
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.outcome import Certificate, Refusal
from codegen.logs.description import Naming
from codegen.replay.engine import Engine
from codegen.replay.live import Stop, called, is_recorded, live_blocks, pieces
from codegen.replay.samples import Block, Samples
from codegen.replay.watch import Alarm, Limit, Tally, Watch, is_watchable, too_slow
from codegen.spec.quantity import read_quantity

DWELL = 10
"""Consecutive samples out of the bound after which an alarm begins."""


@dataclass(frozen=True, repr=False)
class Watched(Result):
    """The result of ``watch``.

    Attributes:
        limits: the signals and their bounds, which are compared from ``settle`` seconds after a reversal on.
        alarms: times at which an estimate was out of its bound for longer than the dwell time.
        fault: the error at the row at which reading ended, or None.
        useless: the error that nothing could be compared, or None.
        notes: on how the log was read, and why nothing was compared.
    """

    template = "watched"
    name: str
    limits: tuple[Limit, ...]
    settle: float
    dwell: float
    tally: Tally
    alarms: tuple[Alarm, ...]
    ended: str
    fault: BadInput | None = None
    useless: BadInput | None = None
    notes: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        judged = f"{self.tally.judged} of {self.tally.samples}"
        return {"machine": self.name, "samples judged": judged, "alarms": len(self.alarms)}

    @property
    def content(self) -> dict[str, Any]:
        tally = self.tally
        worst = zip(self.limits, tally.worst, strict=True)
        return {
            "format": "stiction-watch/1",
            "name": self.name,
            **named(tally, "samples judged outside faults"),
            **named(tally, "from=first to=last"),
            **named(self, "settle dwell"),
            "limits": [
                {**named(limit, "where bound steady unit"), "worst": share * limit.bound} for limit, share in worst
            ],
            "alarms": [alarm.content for alarm in self.alarms],
            "ended": self.ended,
            "notes": list(self.notes),
            "fault": None if self.fault is None else self.fault.parts,
        }


@verb
def watch(
    source: Source,
    log: str | Path,
    columns: Mapping[str, str] | None = None,
    dwell: float | str | None = None,
    follow: bool = False,
    on_alarm: Callable[[Alarm], None] | None = None,
    given: Iterator[bytes] | None = None,
) -> Watched:
    """Run the observer over rows as they arrive, until they end or Ctrl-C is pressed.

    Args:
        log: ``-`` for standard input or a CSV file, read as rows arrive; or a log of another format, read whole.
        columns: how the log names its columns.
        dwell: time for which an estimate must be out of its bound, s or a text such as ``10ms``; 10 samples by default.
        follow: wait at the end of the file for more.
        on_alarm: called with each alarm when it begins.
        given: the bytes of the log, in place of the file.

    Raises:
        BadInput: for a bad spec, one without a certified bound, or a log without a usable row.
    """
    machine = derived_from(source)
    bounds = _usable_bounds(machine)
    period = float(machine.observer.sample_time)
    patience = DWELL if dwell is None else max(round(_seconds(dwell) / period), 1)
    engine = Engine(machine.program, machine.sources)
    watched = Watch(machine.spec, machine.observer, machine.program, bounds, engine, period, patience)
    settle = watched.settle * period
    stop = Stop()
    blocks, read_notes = _opened(machine, log, columns, follow, given, stop)
    ended, fault = "the rows ended", None
    with on_interrupt(stop.request):
        try:
            for block in blocks:
                for alarm in watched.take(block):
                    if on_alarm is not None:
                        on_alarm(alarm)
        except KeyboardInterrupt:
            ended = "interrupted"
        except BadInput as error:
            if not watched.tally.samples:
                raise
            ended, fault = "a row could not be read", error
    notes = [*read_notes()]
    why, useless = watched.uncompared(), None
    if why is not None:
        notes.append(why)
        found = "no sample that can be compared with the bound"
        expected = f"sliding in one direction for more than {settle:.4g} s, within the envelope"
        useless = BadInput(Place(called(str(log))), found, expected, code="LOG015")
    name, limits, tally, alarms = machine.spec.name, watched.limits, watched.tally, tuple(watched.alarms)
    return Watched(name, limits, settle, patience * period, tally, alarms, ended, fault, useless, tuple(notes))


def _opened(
    machine: Derived, log: str | Path, columns: Naming, follow: bool, given: Iterator[bytes] | None, stop: Stop
) -> tuple[Iterator[Block], Callable[[], Sequence[str]]]:
    """The samples of a log in blocks until Ctrl-C, and, once they were read, the notes on how; arguments as ``watch``.

    Raises BadInput for ``follow`` with a log that is no text.
    """
    spec, program, period = machine.spec, machine.program, float(machine.observer.sample_time)
    if given is None and is_recorded(log):
        if follow:
            found, expected = f"{log}, which is no text", "a CSV file, whose rows are appended"
            raise BadInput("--follow", found, expected, code="CALL002")
        samples = Samples(spec, program, period, Path(log), None, columns)
        return stop.until_requested(samples.whole(None)), lambda: samples.notes
    notes: list[str] = []
    rows = stop.until_requested(given if given is not None else pieces(str(log), follow))
    return live_blocks(spec, program, period, str(log), rows, columns, notes), lambda: notes


def _usable_bounds(machine: Derived) -> tuple[ErrorBound, ...]:
    """The certified bounds in newtons; BadInput if there are none, or if no sample could be compared with them."""
    spec, system, outcome = machine.spec, machine.system, machine.outcome
    bounds = outcome.bounds if isinstance(outcome, Certificate) else ""
    if isinstance(bounds, str):
        found, reason = "no bound in newtons", bounds
        if isinstance(outcome, Refusal):
            found, reason = "no certificate", outcome.reason
        expected = f"an observer that `stiction certify` bounds in newtons; it says of this one: {reason}"
        raise BadInput(spec.place("observer"), found, expected, code="SPEC037")
    if not is_watchable(system):
        found = "a law with states"
        raise BadInput(spec.place("friction"), found, "a friction law of zero memory", code="SPEC020")
    if (slow := too_slow(bounds)) is not None:
        found = (
            f"{slow.contact} slides at most at {slow.fastest:.3g} {slow.unit} in the envelope, and an estimate is "
            f"compared above {slow.seen:.3g} {slow.unit}"
        )
        expected = "a wider envelope of velocities, or less noise and drift: nothing could be judged"
        raise BadInput(spec.place("envelope"), found, expected, code="SPEC037")
    return bounds


def _seconds(dwell: float | str) -> float:
    """The dwell time, zero or more, s."""
    expected = "zero or a positive time, such as 0.01 or 10ms"
    try:
        time = float(read_quantity(dwell, "s", Place("--dwell"))) if isinstance(dwell, str) else float(dwell)
    except BadInput:
        raise BadInput("--dwell", f"`{dwell}`", expected, code="CALL001") from None
    if not (isfinite(time) and time >= 0):
        raise BadInput("--dwell", f"{time:g} s", expected, code="CALL001")
    return time


def alarm_text(alarm: Alarm) -> str:
    """An alarm in one line."""
    return render("text/alarm.txt.j2", a=alarm)
