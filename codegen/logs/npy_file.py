"""NumPy logs: an .npy file with a structured array, one field of numbers a column; read in place, not into memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codegen.errors import BadInput, Place
from codegen.logs.source import Columns, Source, shown

EXPECTED = "an .npy log: a structured array with a field of numbers for each column"
ROWS = 1 << 16


@dataclass(frozen=True)
class NpySource:
    """An opened array."""

    file: str
    array: Any

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.array.dtype.names)

    @property
    def place(self) -> Place:
        return Place(self.file)

    def load(self, wanted: Sequence[str]) -> Columns:
        """All rows of the wanted columns.

        Raises:
            BadInput: for an empty array.
        """
        if not len(self.array):
            raise BadInput(self.place, "an array without rows", EXPECTED)
        return self._rows(wanted, 0, len(self.array))

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """The wanted columns, some rows at a time."""
        for start in range(0, len(self.array), ROWS):
            yield self._rows(wanted, start, start + ROWS)

    def _rows(self, wanted: Sequence[str], start: int, stop: int) -> Columns:
        values = np.column_stack([np.asarray(self.array[name][start:stop], dtype=np.float64) for name in wanted])
        return Columns(self.file, tuple(wanted), values, None)


def open_npy(path: Path) -> NpySource:
    """Open an .npy file.

    Raises:
        BadInput: if it cannot be read or is no structured array of numbers in one dimension.
    """
    place = Place(str(path))
    if not path.is_file():
        raise BadInput(place, "a folder" if path.is_dir() else "no such file", EXPECTED)
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError as error:
        raise BadInput(place, f"unreadable ({error.strerror or error})", EXPECTED) from None
    except (ValueError, EOFError) as error:
        raise BadInput(place, f"no array ({shown(str(error), 80)})", EXPECTED) from None
    if not isinstance(array, np.ndarray) or array.dtype.names is None or array.ndim != 1:
        raise BadInput(place, "an array without names of columns", EXPECTED)
    for name in array.dtype.names:
        if array.dtype[name].kind not in "fiub" or array.dtype[name].shape:
            raise BadInput(place, f"the field `{shown(name)}` of type {array.dtype[name]}", EXPECTED)
    return NpySource(str(path), array)


def open_npy_log(path: Path) -> Source:
    """``open_npy`` for the registry of formats."""
    return open_npy(path)
