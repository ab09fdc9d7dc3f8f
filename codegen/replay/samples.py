"""A log as inputs of the observer at its sample time: read in blocks if the time stamps are regular, else whole."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.logs import LogDescription, read_log
from codegen.logs.binding import Binding, bind
from codegen.logs.counters import corrected, require_columns
from codegen.logs.description import Naming
from codegen.logs.file_formats import open_stream
from codegen.logs.formats.source import LARGEST, BlockFile, Columns, NotStreamed, listing
from codegen.logs.log import Log
from codegen.logs.readers import log_description, log_names
from codegen.logs.term import columns_of, compute
from codegen.logs.uniform import GAP_STEPS, JITTER
from codegen.program import Program
from codegen.spec import Spec

ROWS = 1 << 16
"""Most samples of a block, of a log that is read whole."""


@dataclass(frozen=True)
class Block:
    """Consecutive samples.

    Attributes:
        time: (N,) s.
        rows: (N, inputs) in the Program's order.
        fresh: whether the observer is initialised from the first row: at the start, and after a gap.
    """

    time: Array
    rows: Array
    fresh: bool


def blocks_between(time: Array, rows: Array, fresh: Sequence[int]) -> Iterator[Block]:
    """The samples (N,), (N, inputs) in blocks that begin at the rows ``fresh``, which are in ascending order."""
    for start, stop in pairwise([*dict.fromkeys((0, *fresh)), len(time)]):
        yield Block(time[start:stop], rows[start:stop], start in fresh)


def steps_of_time(time: Array, before: float, period: float) -> Array:
    """The step of time to each row (N,), s.

    ``before``: time of the row before, s; NaN for the first rows of a log. The first row then counts as one sample.
    """
    steps = np.diff(time, prepend=before)
    if np.isnan(before) and np.isfinite(time[0]):
        steps[0] = period
    return steps


class Irregular(Exception):
    """The rows of the log cannot be used as they are; ``place`` and ``found`` are for a message."""

    def __init__(self, place: Place, found: str) -> None:
        super().__init__(place, found)
        self.place, self.found = place, found


class Samples:
    """The samples of a log for an observer.

    Attributes:
        period: the observer's sample time, s.
        notes: preprocessing of the log, in words; complete after the last block.
    """

    def __init__(
        self, spec: Spec, program: Program, period: float, path: Path, description: str | Path | None, columns: Naming
    ) -> None:
        self.period, self.notes = period, list[str]()
        self._spec, self._path, self._holds = spec, path, program.holds
        self._inputs = [field.name for field in program.inputs]
        self._description, self._columns = description, columns

    def streamed(self) -> Iterator[Block]:
        """The rows of the file as they are, in blocks.

        Raises:
            BadInput: for a log that cannot be used.
            Irregular: for a step of time that is neither the sample time within 1 % nor a gap, or a non-finite value
                where the observer does not handle invalid samples; ``whole`` can read such a log.
            NotStreamed: for a format that can only be read whole.
        """
        described = log_description(self._path, self._description)
        stream = open_stream(self._path, described.with_columns(self._spec, self._columns))
        apart = described.beside or described.missing == "join"
        if apart or described.unwrap or described.rows or described.late:
            raise NotStreamed  # rows depend on other rows, and columns may be in other files
        binding = bind(stream, self._spec, described, self._columns)
        if set(binding.integrated) & set(self._inputs):
            raise NotStreamed
        require_columns(stream.names, described)
        self._require_inputs(binding.terms, stream.place)
        yield from self._blocks(stream, binding, described)
        self.notes = [*stream.notes, *binding.notes, *(finding.words for finding in binding.findings)]

    def whole(self, why: Irregular | None) -> Iterator[Block]:
        """The log resampled to a uniform grid, as in a diagnosis; the observer is initialised after each gap.

        ``why``: why the rows could not be used as they are. Raises BadInput for a log that cannot be used, or whose
        sample time is not the observer's.
        """
        if why is not None and self._path.is_file() and self._path.stat().st_size > LARGEST:
            expected = f"steps of {self.period:g} s within {JITTER:.0%} (a log of more than 1 GB is not resampled)"
            raise BadInput(why.place, why.found, expected, code="LOG008")
        log = read_log(self._path, self._spec, description=self._description, columns=self._columns)
        if not abs(log.sample_time / self.period - 1) <= JITTER:
            step, stated = log.sample_time, log.raw_data.time_unit
            found = f"a sample every {step:.6g} s{stated}, where the observer takes {self.period:.6g} s"
            scale = log.description.stated_scale("t", self._spec) * self.period / step
            in_unit = f"`scale: {{t: {scale:.6g}}}` in meta.yaml beside the log, where its time is in another unit"
            expected = f"a log at the observer's sample time: {in_unit}; or `sample_time: {step:.6g}` in the spec"
            raise BadInput(Place(str(self._path)), found, expected, code="LOG013")
        self.notes = [*log.notes, *(finding.words for finding in log.raw_data.findings)]
        values = self._of_log(log)
        for start, stop in log.segments:
            for first in range(start, stop, ROWS):
                last = min(first + ROWS, stop)
                yield Block(log.time[first:last], values[first:last], first == start)

    def _blocks(self, stream: BlockFile, binding: Binding, described: LogDescription) -> Iterator[Block]:
        """The rows of a stream in blocks, split at gaps."""
        timed = "t" in binding.terms
        symbols = (["t"] if timed else []) + self._inputs
        scale = np.array([binding.scale[s] for s in symbols])
        count, before = 0, float("nan")
        terms = {s: binding.terms[s] for s in symbols}
        for raw in stream.blocks(columns_of(terms)):
            columns = compute(corrected(raw, described), terms)
            values = columns.values * scale
            if timed:
                time, rows = values[:, 0].copy(), np.ascontiguousarray(values[:, 1:])
            else:
                assert described.sample_rate_hz is not None  # ``bind`` refuses a log with neither
                time, rows = np.arange(count, count + len(values)) / described.sample_rate_hz, values
            gaps, wrong = self._gaps(columns, time, before), ~np.isfinite(rows)
            if wrong.any() and (described.missing == "fill" or not self._holds):
                row, column = np.argwhere(wrong)[0].tolist()
                raise Irregular(columns.place(row, column + timed), "a value that is not finite")
            yield from blocks_between(time, rows, gaps if count else [0, *gaps])
            count, before = count + len(time), float(time[-1])

    def _gaps(self, columns: Columns, time: Array, before: float) -> list[int]:
        """Indices of rows after a gap. Irregular if a step is neither the sample time nor a gap, or half are gaps."""
        steps = steps_of_time(time, before, self.period)
        wrong = ~(np.abs(steps / self.period - 1) <= JITTER)
        gaps = wrong & (steps > GAP_STEPS * self.period) & (2 * np.count_nonzero(wrong) < len(wrong))
        other = wrong & ~gaps
        if other.any():
            k = int(np.argmax(other))
            words = f"a step of {steps[k]:.6g} s" if np.isfinite(time[k]) else "a time that is not finite"
            raise Irregular(columns.place(k, 0), words)
        return np.flatnonzero(gaps).tolist()

    def _require_inputs(self, known: Container[str], place: Place) -> None:
        for name in self._inputs:
            if name not in known:
                found, how = f"no column `{name}`", f"`columns: {{{name}: ...}}` in meta.yaml beside the log"
                what = "the measured velocity, an input of this observer"
                expected = f"{what}: {how}, or `--column {name}=...`; it has {listing(log_names(self._path))}"
                raise BadInput(place, found, expected, code="LOG003")

    def _of_log(self, log: Log) -> Array:
        """(N, inputs) of a log."""
        spec = self._spec
        found = dict(zip(spec.positions, log.positions.T, strict=True))
        if log.velocities is not None:
            found |= dict(zip(spec.velocities, log.velocities.T, strict=True))
        found |= dict(zip([i.name for i in spec.inputs], log.inputs.T, strict=True))
        self._require_inputs(found, Place(str(self._path)))
        return np.column_stack([found[name] for name in self._inputs])
