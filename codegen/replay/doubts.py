"""Warnings on a replayed log: signals outside the envelope or against the spec, friction far above the declared one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.certify.bound.friction_bounds import largest_friction
from codegen.logs import read_log
from codegen.logs.audit.envelope import Span
from codegen.logs.audit.preflight import force_problems
from codegen.logs.excerpt import excerpt
from codegen.logs.log import Log
from codegen.observers.equations import Observer
from codegen.program import Program
from codegen.replay.samples import Block
from codegen.spec import Spec
from codegen.spec.numerics import numerical

FAR_ABOVE = 10.0
"""Times the largest declared friction: an estimate beyond is rather of a wrong log. The estimate of a right log that
begins in motion is up to four times it at the start."""


MOST_BYTES = 20_000_000
"""Size of a log up to which its forces are balanced: that takes a second, and a replay of a larger log no more."""


def contradictions(
    spec: Spec, path: Path, description: str | Path | None, columns: Mapping[str, str] | None
) -> tuple[str, ...]:
    """What contradicts the spec in signs, scales or the order of a log's columns, as the preflight says it.

    None of a log that is larger than ``MOST_BYTES``, that no diagnosis takes, or whose forces cannot be computed.
    """
    try:
        if path.is_file() and path.stat().st_size > MOST_BYTES:
            return ()
        return _contradictions(spec, excerpt(read_log(path, spec, description=description, columns=columns))[0])
    except (BadInput, OSError):
        return ()


@numerical("the force balance on the log")
def _contradictions(spec: Spec, log: Log) -> tuple[str, ...]:
    return tuple(finding.words for finding in force_problems(log, spec))


class Doubts:
    """The envelope's signals among the inputs and outputs of an observer, counted block by block."""

    def __init__(self, spec: Spec, program: Program) -> None:
        self._inputs: list[tuple[int, Span]] = []
        self._estimates: list[tuple[int, Span]] = []
        inputs = [field.name for field in program.inputs]
        outputs = [name for name, _, _ in program.outputs]
        for name, unit in _signals(spec).items():
            if name not in spec.envelope:
                continue
            low, high = (float(end) for end in spec.envelope[name])
            if name in inputs:
                self._inputs.append((inputs.index(name), Span(name, unit, low, high)))
            elif f"{name}_hat" in outputs and name in spec.velocities:
                self._estimates.append((outputs.index(f"{name}_hat"), Span(f"{name}_hat", unit, low, high)))

    def add(self, block: Block, estimates: Array) -> None:
        for k, span in self._inputs:
            span.add(block.rows[:, k])
        for k, span in self._estimates:
            span.add(estimates[:, k])

    @property
    def words(self) -> tuple[str, ...]:
        """A line for each signal that leaves the envelope."""
        found = (span.finding for _, span in (*self._inputs, *self._estimates))
        return tuple(finding.words for finding in found if finding is not None)


def _signals(spec: Spec) -> dict[str, str]:
    """The signals that a log and an observer have, and their units."""
    positions = {c.name: c.unit for c in spec.coordinates}
    velocities = {c.velocity: f"{c.unit}/s" for c in spec.coordinates}
    return positions | velocities | {i.name: i.unit for i in spec.inputs}


def declared_friction(spec: Spec, observer: Observer) -> dict[str, float]:
    """The largest friction in the envelope by the declared laws, of each friction output for which there is one.

    None if it cannot be computed, such as one beyond a double: a replay does not need it.
    """
    try:
        return _declared_friction(spec, observer)
    except BadInput:
        return {}


@numerical("the largest friction in the envelope")
def _declared_friction(spec: Spec, observer: Observer) -> dict[str, float]:
    system = observer.system
    each = largest_friction(spec, observer)
    found = {f"F_hat_{c.name}": float(b) for c, b in zip(system.contacts, each, strict=True) if b is not None}
    distribution = system.distribution.subs(observer.values)
    for i, x in enumerate(spec.positions):
        parts = [(u, b) for u, b in zip(distribution.row(i), each, strict=True) if u != 0]
        if parts and all(b is not None and not u.free_symbols for u, b in parts):
            found[f"F_hat_on_{x}"] = sum(abs(float(u)) * float(b or 0) for u, b in parts)
    return {name: largest for name, largest in found.items() if largest > 0}


def far_above(peaks: Sequence[tuple[str, str, float]], declared: Mapping[str, float]) -> Iterator[str]:
    """A line on the estimate that is the most times its largest declared friction, if that is far above it.

    Args:
        peaks: name, unit and largest value of each friction estimate.
        declared: as of ``declared_friction``.
    """
    found = [(abs(value) / declared[name], name, unit) for name, unit, value in peaks if name in declared]
    times, name, unit = max(found, key=lambda one: one[0], default=(0.0, "", ""))
    if times > FAR_ABOVE:
        yield (
            f"|{name}| reaches {times:.4g} times the largest friction that the spec declares within its envelope, "
            f"{declared[name]:.4g} {unit}: check units, signs and the order of columns in the log."
        )
