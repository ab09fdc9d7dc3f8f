"""Parquet logs, LeRobot's among them: a column a column, the entries of vector columns as ``observation.state[2]``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.log import Array
from codegen.logs.source import LARGEST_STREAM, Allowance, Columns, ColumnsOfFile, listing, shown

EXPECTED = "a Parquet log with a row a sample: columns of numbers, or of lists of equally many"
ROWS = 1 << 16
LONGEST_LIST = 256
TICKS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
COMMAND, STATE = "action", "observation.state"
"""LeRobot's columns of what a policy or a leader arm asked of the servos, and of what these measured."""


@dataclass(frozen=True)
class ParquetSource(ColumnsOfFile):
    """An opened file.

    Attributes:
        columns: name → (column of the file, entry of its lists or None).
        rows: as the file states them.
    """

    columns: Mapping[str, tuple[str, int | None]]
    rows: int
    allowance: Allowance

    @property
    def asked(self) -> Mapping[str, str]:
        """Columns of positions that were asked for → the column where the measured one stands."""
        asked = {name: name.replace(COMMAND, STATE, 1) for name, (whole, _) in self.columns.items() if whole == COMMAND}
        return {name: state for name, state in asked.items() if state in self.columns}

    def load(self, wanted: Sequence[str]) -> Columns:
        """All rows of the wanted columns.

        Raises:
            BadInput: for a damaged file, lists of another length, or too many numbers.
        """
        if not self.rows:
            raise BadInput(self.place, "a table without rows", EXPECTED, code="LOG009")
        self.allowance.take(self.path, 8 * self.rows * len(wanted), EXPECTED)
        values = np.concatenate([block.values for block in self.blocks(wanted)])
        return Columns(str(self.path), tuple(wanted), values, None)

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """The wanted columns, some rows at a time; no other column is decoded."""
        used = list(dict.fromkeys(self.columns[name][0] for name in wanted))
        with opened(self.path, EXPECTED, LARGEST_STREAM) as stream:
            with reading(self.path, EXPECTED):
                batches = _parquet(stream).iter_batches(ROWS, columns=used, use_threads=False)
            before, origins = 0, dict[str, int]()
            while (batch := self._next(batches)) is not None:
                values = np.empty((batch.num_rows, len(wanted)))
                for j, name in enumerate(wanted):
                    column, entry = self.columns[name]
                    with reading(self.path, EXPECTED):
                        numbers = _from_first(batch.column(used.index(column)), origins, column)
                        values[:, j] = self._numbers(numbers, entry, name, before)
                before += batch.num_rows
                yield Columns(str(self.path), tuple(wanted), values, None)

    def _next(self, batches: Iterator[Any]) -> Any:
        with reading(self.path, EXPECTED):
            return next(batches, None)

    def _numbers(self, column: Any, entry: int | None, name: str, before: int) -> Array:
        if entry is None:
            return _floats(column)
        lengths = np.asarray(column.value_lengths().fill_null(0), dtype=np.int64)
        short = lengths <= entry
        if short.any():
            row = int(np.argmax(short))
            place = Place(str(self.path), None, f"{shown(name)}({before + row + 1})")
            raise BadInput(place, f"a list of {lengths[row]}", "lists as long as the first one", code="LOG005")
        starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
        found: Array = _floats(column.flatten())[starts + entry]
        return found


def open_parquet(path: Path, allowance: Allowance, description: LogDescription) -> ParquetSource:
    """Open a file and find its columns of numbers.

    Raises:
        BadInput: where its library is not installed, or for a file that is none, damaged or without numbers.
    """
    library("pyarrow.parquet", "parquet", path)
    columns: dict[str, tuple[str, int | None]] = {}
    unread: dict[str, str] = {}
    with opened(path, EXPECTED, LARGEST_STREAM) as stream, reading(path, EXPECTED):
        file = _parquet(stream)
        for kind in file.schema_arrow:
            number, length = _kind(kind.type), _length(kind.type, partial(_first, file, kind.name))
            if number:
                columns[kind.name] = (kind.name, None)
            elif 0 < length <= LONGEST_LIST:
                columns |= {f"{kind.name}[{k}]": (kind.name, k) for k in range(length)}
            else:
                unread[kind.name] = f"it holds {shown(str(kind.type))}, no numbers"
        rows = int(file.metadata.num_rows)
    if not columns:
        raise BadInput(Place(str(path)), f"no numbers in the columns {listing(list(unread))}", EXPECTED, code="LOG001")
    return ParquetSource(path, columns, unread, rows, allowance)


def _parquet(stream: Any) -> Any:
    """A reader that holds a page at a time; its memory is the system's, where a limit holds."""
    import pyarrow
    from pyarrow import parquet

    pyarrow.set_memory_pool(pyarrow.system_memory_pool())
    return parquet.ParquetFile(stream, buffer_size=1 << 20, pre_buffer=False)


def _kind(kind: Any) -> bool:
    """Whether its values are numbers, times or durations."""
    from pyarrow import types

    simple = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    return bool(simple or types.is_timestamp(kind) or types.is_duration(kind))


def _length(kind: Any, first: Any) -> int:
    """Entries of each list: as the type has it, else as the first row has it; 0 for no list of numbers."""
    from pyarrow import types

    if types.is_fixed_size_list(kind):
        return int(kind.list_size) if _kind(kind.value_type) else 0
    if types.is_list(kind) or types.is_large_list(kind):
        return len(first() or []) if _kind(kind.value_type) else 0
    return 0


def _first(file: Any, name: str) -> Any:
    batch = next(file.iter_batches(1, columns=[name], use_threads=False), None)
    return batch.column(0)[0].as_py() if batch is not None and batch.num_rows else None


def _from_first(column: Any, origins: dict[str, int], name: str) -> Any:
    """Times as seconds from the first one, since a double does not hold today in nanoseconds; others as they are."""
    import pyarrow
    from pyarrow import compute, types

    if not (types.is_timestamp(column.type) or types.is_duration(column.type)):
        return column
    ticks = column.cast(pyarrow.int64())
    first = next((value.as_py() for value in ticks if value.is_valid), 0)
    origin = origins.setdefault(name, first)
    return compute.divide(compute.subtract(ticks, origin).cast(pyarrow.float64()), TICKS[column.type.unit])


def _floats(column: Any) -> Array:
    """(N,); NaN where a value is missing."""
    import pyarrow

    return np.asarray(column.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False), dtype=np.float64)
