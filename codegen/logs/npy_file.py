"""NumPy logs: an .npy file with a field of numbers a column, or a table of numbers; read in blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.npy_header import Header, read_header
from codegen.logs.source import LARGEST_STREAM, Allowance, Columns, Source, Unannotated, shown

EXPECTED = "an .npy log: a structured array with a field of numbers for each column, or an array N × columns"
ROWS = 1 << 16


@dataclass(frozen=True)
class NpySource(Unannotated):
    """An array whose header is read.

    Attributes:
        allowance: counts what is read whole.
    """

    path: Path
    header: Header
    allowance: Allowance

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.header.dtype.names or ())

    @property
    def place(self) -> Place:
        return Place(str(self.path))

    def load(self, wanted: Sequence[str]) -> Columns:
        """All rows of the wanted columns.

        Raises:
            BadInput: for an empty array, or one that is too large.
        """
        if not self.header.rows:
            raise BadInput(self.place, "an array without rows", EXPECTED, code="LOG009")
        self.allowance.take(self.path, 8 * self.header.rows * len(wanted), EXPECTED)
        values = np.concatenate([block.values for block in self.blocks(wanted)])
        return Columns(str(self.path), tuple(wanted), values, None)

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """The wanted columns, some rows at a time.

        Raises:
            BadInput: if the file has become shorter.
        """
        dtype, left = self.header.dtype, self.header.rows
        with opened(self.path, EXPECTED, LARGEST_STREAM) as stream:
            stream.seek(self.header.offset)
            while left:
                count = min(ROWS, left)
                try:
                    data = stream.read(count * dtype.itemsize)
                except OSError as error:
                    raise BadInput(self.place, f"unreadable ({error.strerror})", EXPECTED, code="FILE001") from None
                if len(data) < count * dtype.itemsize:
                    raise BadInput(self.place, f"{left} rows less than its header says", EXPECTED, code="LOG001")
                rows = np.frombuffer(data, dtype=dtype)
                values = np.column_stack([rows[name].astype(np.float64) for name in wanted])
                yield Columns(str(self.path), tuple(wanted), values, None)
                left -= count


def open_npy(path: Path, allowance: Allowance | None = None) -> NpySource:
    """Open an .npy file.

    Raises:
        BadInput: if it cannot be read, is no table of numbers, or shorter than it says.
    """
    place = Place(str(path))
    with opened(path, EXPECTED, LARGEST_STREAM) as stream:
        try:
            header = read_header(stream)
            size = stream.seek(0, 2)
        except OSError as error:
            raise BadInput(place, f"unreadable ({error.strerror})", EXPECTED, code="FILE001") from None
        except ValueError as error:
            raise BadInput(place, shown(str(error), 80), EXPECTED, code="LOG001") from None
    needed = header.offset + header.rows * header.dtype.itemsize
    if size < needed:
        raise BadInput(place, f"{size} bytes, where its header says {needed}", EXPECTED, code="LOG001")
    return NpySource(path, header, allowance or Allowance())


def open_npy_log(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """``open_npy`` for the registry of formats."""
    return open_npy(path, allowance)
