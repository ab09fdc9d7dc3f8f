"""Replay of an observer over a log, block by block: the file of its estimates, and a summary of them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, refuse_unknown
from codegen.base.files import Waiting, refuse_ending, refuse_target
from codegen.base.result import Result
from codegen.logs.formats.source import NotStreamed
from codegen.program import Program
from codegen.replay.engine import Engine, Faults
from codegen.replay.log_warnings import EnvelopeCheck, excessive_friction
from codegen.replay.samples import Block, Irregular, Samples
from codegen.spec import Spec

Add = Callable[[Array, Array, NDArray[np.intc]], None]
"""Takes the times, estimates and fault flags of a block."""


@contextmanager
def open_writer(path: Path | None, columns: Sequence[str], flagged: bool) -> Iterator[Add]:
    """Context with a function that writes blocks to a file, whose format is given by its ending.

    If the work in the context fails, the target stays as it was.

    Args:
        path: None writes nothing.
        flagged: whether the fault flags are written too.

    Raises:
        BadInput: for another ending than .csv and .npy, or a folder that cannot be made or written.
    """
    if path is None:
        yield lambda time, estimates, faults: None
        return
    writers = {".csv": _csv_writer, ".npy": _npy_writer}
    refuse_ending(path, writers)
    refuse_target(path)
    with Waiting(path, "a folder that can be written, with room") as file:
        add, end = writers[path.suffix.lower()](file, columns, flagged)
        yield add
        end()
        file.take_place()


def read_estimates(path: Path) -> dict[str, Array]:
    """The columns of a file that ``open_writer`` wrote, by name: ``t`` in s, the estimates, and ``fault``; read-only.

    Raises BadInput if it cannot be read.
    """
    try:
        if path.suffix.lower() == ".npy":
            table = np.load(path)
            if table.dtype.names is None:
                raise ValueError("an array without names of columns")
            columns = {name: table[name] for name in table.dtype.names}
        else:
            with path.open(encoding="utf-8") as file:
                names = file.readline().strip().split(",")
                if names[0] != "t":
                    raise ValueError(f"`{names[0]}` in place of the column `t`")
                table = np.loadtxt(file, delimiter=",", ndmin=2, comments=None).T
            kinds = [np.intc if name == "fault" else np.float64 for name in names]
            columns = {name: c.astype(kind) for name, c, kind in zip(names, table, kinds, strict=True)}
    except (OSError, ValueError) as error:
        raise BadInput(str(path), f"unreadable ({error})", "the estimates that replay wrote", code="FILE001") from None
    for column in columns.values():
        column.setflags(write=False)  # the result keeps them: a change in place would appear in every later reading
    return columns


def _csv_writer(file: Waiting, columns: Sequence[str], flagged: bool) -> tuple[Add, Callable[[], None]]:
    """Writer of CSV in the format of a simulated log: a header, then numbers in the shortest round-trip form."""
    names = ["t", *columns, *(["fault"] if flagged else [])]
    file.write(f"{','.join(names)}\n".encode())

    def add(time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        lines = [",".join(map(repr, row)) for row in np.column_stack([time, estimates]).tolist()]
        if flagged:
            lines = [f"{line},{flag}" for line, flag in zip(lines, faults.tolist(), strict=True)]
        file.write(("\n".join(lines) + "\n").encode())

    return add, lambda: None


def _npy_writer(file: Waiting, columns: Sequence[str], flagged: bool) -> tuple[Add, Callable[[], None]]:
    """Writer of a structured .npy array."""
    names = ["t", *columns]
    dtype = np.dtype([*((name, "<f8") for name in names), *([("fault", "<i4")] if flagged else [])])
    rows = 0

    def head() -> None:
        """Write the header; NumPy pads it, so that it can be replaced by one with the final length."""
        described = {"descr": dtype.descr, "fortran_order": False, "shape": (rows,)}
        np.lib.format.write_array_header_2_0(file, described)

    def add(time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        nonlocal rows
        rows += len(time)
        block = np.empty(len(time), dtype=dtype)
        for name, values in zip(names, (time, *estimates.T), strict=True):
            block[name] = values
        if flagged:
            block["fault"] = faults
        file.write(block.tobytes())

    def end() -> None:
        file.stream.seek(0)
        head()

    head()
    return add, end


FRICTION = "F_hat"
"""Prefix of the names of friction estimates."""


@dataclass(frozen=True)
class Peak:
    """The value of largest magnitude of an estimate.

    Attributes:
        value: signed, in ``unit``; NaN if no sample gave a finite one.
        time: s.
    """

    name: str
    unit: str
    value: float
    time: float


@dataclass(frozen=True, repr=False)
class Replayed(Result):
    """Result of ``replay``.

    Attributes:
        samples: number of steps.
        duration: from the first sample to the last, s.
        starts: number of initialisations: 1, and 1 more for each gap in the log.
        faults: number of samples at which the observer held its estimates, or whose estimates are not finite.
        peaks: the largest value of each friction estimate.
        step_seconds, seconds: mean computing time of one step, and time of the whole replay, s.
        notes: preprocessing of the log, in words.
        path: file of the estimates, or None.
        warnings: signals outside the spec's envelope, and friction far above the declared one.
        units: output, and ``t`` → its unit.
    """

    template = "replayed"
    name: str
    samples: int
    duration: float
    starts: int
    faults: int
    peaks: tuple[Peak, ...]
    step_seconds: float
    seconds: float
    notes: tuple[str, ...]
    path: Path | None
    warnings: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def summary(self) -> Mapping[str, object]:
        peaks = {f"largest {p.name}": f"{p.value:.4g} {p.unit}" for p in self.peaks}
        return {"machine": self.name, "samples": self.samples, "faults": self.faults, **peaks}

    @cached_property
    def estimates(self) -> dict[str, Array]:
        """Name → array (samples,): ``t`` in s, the outputs, ``fault`` where the observer has it.

        Read from ``path`` when first asked for, and kept, so the arrays are read-only. Raises BadInput for a replay
        without ``out``, which writes no estimates, or a file that cannot be read.
        """
        if self.path is None:
            expected = "a file as `out`, a .csv or .npy, from which they are read"
            raise BadInput(
                "replay()", "no estimates, which a replay without `out` does not keep", expected, code="CALL001"
            )
        return read_estimates(self.path)

    @property
    def content(self) -> dict[str, Any]:
        return {"format": "stiction-replay/1", **asdict(self), "path": None if self.path is None else str(self.path)}


def replay_log(
    spec: Spec,
    program: Program,
    engine: Engine,
    samples: Samples,
    declared: Mapping[str, float],
    path: Path | None = None,
    only: Sequence[str] = (),
) -> Replayed:
    """Run an observer over a log.

    Args:
        declared: friction output → the largest friction that the spec declares, where there is one.
        path: CSV or .npy for the estimates; None writes nothing.
        only: the outputs to write; all by default.

    Raises:
        BadInput: for a log or an output that cannot be used; nothing is written then.
    """
    began, names = perf_counter(), [name for name, _, _ in program.outputs]
    for name in only:
        refuse_unknown(name, names, "--only", "no output", code="CALL001")
    chosen = [k for k, name in enumerate(names) if name in only or not only]
    why: Irregular | None = None
    try:
        seen = _run(_Summary(spec, program, declared), program, engine, samples.streamed(), path, chosen)
        if seen.samples:
            return seen.result(program, samples, path, began)
    except Irregular as error:
        why = error
    except NotStreamed:
        why = None
    seen = _run(_Summary(spec, program, declared), program, engine, samples.whole(why), path, chosen)
    return seen.result(program, samples, path, began)


class _Summary:
    """Counts and extremes of the estimates so far."""

    def __init__(self, spec: Spec, program: Program, declared: Mapping[str, float]) -> None:
        self.envelope, self.declared = EnvelopeCheck(spec, program), declared
        outputs = [(name, unit) for name, unit, _ in program.outputs]
        self.friction = [k for k, (name, _) in enumerate(outputs) if name.startswith(FRICTION)]
        self.named = [outputs[k] for k in self.friction]
        self.largest, self.at = np.full(len(self.friction), np.nan), np.full(len(self.friction), np.nan)
        self.samples = self.starts = self.faults = 0
        self.first = self.last = 0.0
        self.stepping = 0.0

    def add(self, block: Block, estimates: Array, faults: Faults) -> None:
        if not self.samples:
            self.first = float(block.time[0])
        self.last = float(block.time[-1])
        self.samples += len(block.time)
        self.starts += block.fresh
        self.faults += int(np.count_nonzero((faults != 0) | ~np.isfinite(estimates).all(axis=1)))
        self.envelope.add(block, estimates)
        for j, k in enumerate(self.friction):
            size = np.where(np.isfinite(estimates[:, k]), np.abs(estimates[:, k]), -1.0)
            row = int(np.argmax(size))
            if size[row] >= 0 and not size[row] <= abs(self.largest[j]):
                self.largest[j], self.at[j] = estimates[row, k], block.time[row]

    def result(self, program: Program, samples: Samples, path: Path | None, began: float) -> Replayed:
        peaks = tuple(
            Peak(name, unit, float(value), float(at))
            for (name, unit), value, at in zip(self.named, self.largest, self.at, strict=True)
        )
        excessive = excessive_friction([(p.name, p.unit, p.value) for p in peaks], self.declared)
        return Replayed(
            name=program.name,
            samples=self.samples,
            duration=self.last - self.first,
            starts=self.starts,
            faults=self.faults,
            peaks=peaks,
            step_seconds=self.stepping / max(self.samples, 1),
            seconds=perf_counter() - began,
            notes=tuple(samples.notes),
            path=path,
            warnings=(*self.envelope.warnings, *excessive),
            units={"t": "s", **{name: unit for name, unit, _ in program.outputs}},
        )


def _run(
    seen: _Summary, program: Program, engine: Engine, blocks: Iterator[Block], path: Path | None, chosen: list[int]
) -> _Summary:
    """``seen``, after a run over the blocks; the chosen outputs are written to ``path``."""
    columns = [program.outputs[k][0] for k in chosen]
    every = chosen == list(range(len(program.outputs)))
    block = next(blocks, None)  # errors in the log are raised before a file is created
    if block is None:
        return seen
    with open_writer(path, columns, engine.holds) as write:
        while block is not None:
            before = perf_counter()
            estimates, faults = engine.take(block)
            seen.stepping += perf_counter() - before
            seen.add(block, estimates, faults)
            write(block.time, estimates if every else estimates[:, chosen], faults)
            block = next(blocks, None)
    return seen
