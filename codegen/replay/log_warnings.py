"""Warnings on a replayed log: faults that the preflight finds, signals outside the envelope, excessive friction."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.certify.bound.friction_bounds import largest_friction
from codegen.logs import read_log
from codegen.logs.audit.preflight import Span, column_problems
from codegen.logs.excerpt import excerpt
from codegen.logs.log import Log
from codegen.observers.equations import Observer
from codegen.program import Program
from codegen.replay.samples import Block
from codegen.spec import Spec
from codegen.spec.numerics import numerical

FAR_ABOVE = 10.0
"""Ratio of an estimate to the largest declared friction above which the log is probably wrong. A correct log that
begins in motion has ratios up to four at its start, where the estimate has not settled."""

MOST_BYTES = 20_000_000
"""Largest log whose balance of forces is computed, which takes a second; the replay of a larger one takes no longer."""


def preflight_warnings(
    spec: Spec, path: Path, description: str | Path | None, columns: Mapping[str, str] | None, faults: int = 0
) -> tuple[str, ...]:
    """Findings of the preflight on wrapped or wrongly stored numbers, and on wrong signs, scales or exchanged columns.

    Signs, scales and exchanges are found by the balance of forces M a = g − F.

    Empty for a log that is larger than ``MOST_BYTES``, and where the forces cannot be computed. If ``diagnose`` refuses
    the log and samples of it were invalid, the refusal is the warning: it names the column and what to do. ``faults``:
    number of samples at which the observer held its estimates.
    """
    try:
        if path.is_file() and path.stat().st_size > MOST_BYTES:
            return ()
        return _column_warnings(spec, excerpt(read_log(path, spec, description=description, columns=columns))[0])
    except BadInput as refused:
        invalid = "1 sample was" if faults == 1 else f"{faults} samples were"
        words = f"{invalid} invalid, and `stiction diagnose` refuses this log: {refused}"
        return (words,) if faults else ()
    except OSError:
        return ()


@numerical("the force balance on the log")
def _column_warnings(spec: Spec, log: Log) -> tuple[str, ...]:
    return tuple(finding.words for finding in column_problems(log, spec))


class EnvelopeCheck:
    """Count of samples outside the envelope, for each signal of the envelope that the observer reads or estimates."""

    def __init__(self, spec: Spec, program: Program) -> None:
        self._inputs: list[tuple[int, Span]] = []
        self._estimates: list[tuple[int, Span]] = []
        inputs = [field.name for field in program.inputs]
        outputs = [name for name, _, _ in program.outputs]
        for name, unit in spec.units.items():
            if name not in spec.envelope:
                continue
            low, high = (float(end) for end in spec.envelope[name])
            if name in inputs:
                self._inputs.append((inputs.index(name), Span(name, unit, low, high)))
            elif f"{name}_hat" in outputs and name in spec.velocities:
                self._estimates.append((outputs.index(f"{name}_hat"), Span(f"{name}_hat", unit, low, high)))

    def add(self, block: Block, estimates: Array) -> None:
        """Count the samples of a block; ``estimates`` are (N, outputs)."""
        for k, span in self._inputs:
            span.add(block.rows[:, k])
        for k, span in self._estimates:
            span.add(estimates[:, k])

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line for each signal that leaves the envelope."""
        found = (span.finding for _, span in (*self._inputs, *self._estimates))
        return tuple(finding.words for finding in found if finding is not None)


def declared_friction(spec: Spec, observer: Observer) -> dict[str, float]:
    """Friction output → the largest friction in the envelope by the declared laws, in the output's unit.

    Outputs without a finite one are left out; empty if it cannot be computed, as the replay itself does not need it.
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
    distribution = observer.distribution
    for i, x in enumerate(spec.positions):
        parts = [(u, b) for u, b in zip(distribution.row(i), each, strict=True) if u != 0]
        if parts and all(b is not None and not u.free_symbols for u, b in parts):
            found[f"F_hat_on_{x}"] = sum(abs(float(u)) * float(b or 0) for u, b in parts)
    return {name: largest for name, largest in found.items() if largest > 0}


def excessive_friction(peaks: Sequence[tuple[str, str, float]], declared: Mapping[str, float]) -> Iterator[str]:
    """A warning if an estimate exceeds ``FAR_ABOVE`` times its largest declared friction; the worst one only.

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
