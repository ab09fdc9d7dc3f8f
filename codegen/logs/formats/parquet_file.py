"""Parquet logs, for example of LeRobot.

A column of numbers is a column of the log. Each entry of a column of lists is one, called ``observation.state[2]``.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.user_text import brief
from codegen.logs.formats.source import BlockFile, Columns, listing

ROWS = 1 << 16
"""Rows of a block."""
LONGEST_LIST = 256
"""Most entries of a list that are taken as columns."""
TICKS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Arrow's unit of a time → its ticks in a second."""
COMMAND, STATE = "action", "observation.state"
"""LeRobot's columns: the positions that a policy or a leader arm commands, and those that the servos measure."""


class ParquetFile(BlockFile):
    """An opened file, with its columns and the entries of columns of lists."""

    expected = "a Parquet log with a row a sample: columns of numbers, or of lists of equally many"

    def find(self) -> None:
        self.library("pyarrow.parquet", "parquet")
        self._columns: dict[str, tuple[str, int | None]] = {}
        with self.opened() as stream, self.reading():
            file = _parquet(stream)
            names = file.schema_arrow.names
            if len(set(names)) < len(names):  # a block would have more columns than asked for
                twice = next(name for name in names if names.count(name) > 1)
                raise self.fault(f"two columns called `{brief(twice)}`", "each name once", code="LOG004")
            for column in file.schema_arrow:
                length = _length(file, column)
                if _is_number(column.type):
                    self._columns[column.name] = column.name, None
                elif 0 < length <= LONGEST_LIST:
                    self._columns |= {f"{column.name}[{k}]": (column.name, k) for k in range(length)}
                else:
                    self.unread[column.name] = f"it holds {brief(str(column.type))}, no numbers"
            self.rows = int(file.metadata.num_rows)
        if not self._columns:
            raise self.fault(f"no numbers in the columns {listing(list(self.unread))}")
        self.names = tuple(self._columns)
        commands = [name for name, (whole, _) in self._columns.items() if whole == COMMAND]
        states = {name: name.replace(COMMAND, STATE, 1) for name in commands}
        self.commands = {name: state for name, state in states.items() if state in self._columns}

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """The wanted columns in blocks; other columns are not decoded."""
        used = list(dict.fromkeys(self._columns[name][0] for name in wanted))
        with self.opened() as stream:
            with self.reading():
                batches = _parquet(stream).iter_batches(ROWS, columns=used, use_threads=False)
            before, origins = 0, dict[str, int]()
            while True:
                with self.reading():
                    batch = next(batches, None)
                if batch is None:
                    return
                values = np.empty((batch.num_rows, len(wanted)))
                for j, name in enumerate(wanted):
                    column, entry = self._columns[name]
                    with self.reading():
                        numbers = _from_first(batch.column(used.index(column)), origins, column)
                        values[:, j] = _floats(numbers) if entry is None else self._entry(numbers, entry, name, before)
                before += batch.num_rows
                yield Columns(str(self.path), tuple(wanted), values)

    def _entry(self, lists: Any, entry: int, name: str, before: int) -> Array:
        """An entry of each list of a batch, (N,); ``before``: rows of the file before the batch."""
        lengths = np.asarray(lists.value_lengths().fill_null(0), dtype=np.int64)
        short = lengths <= entry
        if short.any():
            row = int(np.argmax(short))
            found, expected = f"a list of {lengths[row]}", "lists as long as the first one"
            raise self.fault(found, expected, f"{brief(name)}({before + row + 1})", "LOG005")
        starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
        found_values: Array = _floats(lists.flatten())[starts + entry]
        return found_values


def _parquet(stream: Any) -> Any:
    """A reader that loads one page at a time, from the memory pool to which the limit of the process applies."""
    import pyarrow
    from pyarrow import parquet

    pyarrow.set_memory_pool(pyarrow.system_memory_pool())
    return parquet.ParquetFile(stream, buffer_size=1 << 20, pre_buffer=False)


def _is_number(kind: Any) -> bool:
    """Whether the values of a type are numbers, times or durations."""
    from pyarrow import types

    simple = types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind)
    return bool(simple or types.is_timestamp(kind) or types.is_duration(kind))


def _length(file: Any, column: Any) -> int:
    """Entries of a column's lists, by its type or by its first row; 0 for a column without lists of numbers."""
    from pyarrow import types

    kind = column.type
    fixed = types.is_fixed_size_list(kind)
    if not (fixed or types.is_list(kind) or types.is_large_list(kind)) or not _is_number(kind.value_type):
        return 0
    if fixed:
        return int(kind.list_size)
    batch = next(file.iter_batches(1, columns=[column.name], use_threads=False), None)
    return len(batch.column(0)[0].as_py() or []) if batch is not None and batch.num_rows else 0


def _from_first(column: Any, origins: dict[str, int], name: str) -> Any:
    """A column with times as seconds after the file's first one; numbers unchanged.

    Nanoseconds since 1970 have more digits than a double, so the first time is subtracted in integers. ``origins``:
    column → its first time in ticks; the entry of this column is added.
    """
    import pyarrow
    from pyarrow import compute, types

    if not (types.is_timestamp(column.type) or types.is_duration(column.type)):
        return column
    ticks = column.cast(pyarrow.int64())
    first = next((value.as_py() for value in ticks if value.is_valid), 0)
    origin = origins.setdefault(name, first)
    return compute.divide(compute.subtract(ticks, origin).cast(pyarrow.float64()), TICKS[column.type.unit])


def _floats(column: Any) -> Array:
    """A column's numbers, (N,); NaN for a missing value."""
    import pyarrow

    return np.asarray(column.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False), dtype=np.float64)
