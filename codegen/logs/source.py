"""What every log format gives: names of columns, then the numbers of the columns that are wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from codegen.base import input_files
from codegen.base.errors import BadInput, Place
from codegen.base.user_text import one_line

LARGEST = 1_000_000_000
"""Bytes of a log that is read whole, and of all logs of one call when unpacked."""
LARGEST_STREAM = 100_000_000_000
"""Bytes of a log that is read in blocks."""


@dataclass(frozen=True)
class Columns:
    """Numbers of some columns of a file.

    Attributes:
        file: the file's name.
        names: (c) columns as the file calls them.
        values: (N, c), as they stand in the file; NaN where a value is missing.
        lines: (N,) line numbers of the rows counted from 1, or None where the format has none.
    """

    file: str
    names: tuple[str, ...]
    values: NDArray[np.float64]
    lines: NDArray[np.int64] | None

    def place(self, row: int, column: int | None = None) -> Place:
        """Place of a value; a format without lines counts elements from 1, as MATLAB does."""
        name = "" if column is None else shown(self.names[column])
        if self.lines is not None:
            return Place(self.file, int(self.lines[row]), name)
        return Place(self.file, None, f"{name or 'sample'}({row + 1})")

    def rows(self, keep: NDArray[np.bool_]) -> Columns:
        """The rows where ``keep``, (N,), is true."""
        return Columns(self.file, self.names, self.values[keep], None if self.lines is None else self.lines[keep])


class Named(Protocol):
    """A file whose columns have names, and perhaps units."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that there are."""

    @property
    def place(self) -> Place:
        """Where the names stand."""

    @property
    def units(self) -> Mapping[str, str]:
        """Column → the unit that the file itself states; empty where it states none."""


class Opened(Named, Protocol):
    """An opened log file."""

    @property
    def notes(self) -> Sequence[str]:
        """What there is to say of how the file was read."""


class Source(Opened, Protocol):
    """A log file that is read whole."""

    def load(self, wanted: Sequence[str]) -> Columns:
        """The numbers of the wanted columns, each a member of ``names``.

        Raises:
            BadInput: for the first value that is not a number, or columns of different length.
        """


class Unannotated:
    """What a source has to say whose file states no units and whose columns stand plainly in it."""

    @property
    def units(self) -> Mapping[str, str]:
        return {}

    @property
    def notes(self) -> Sequence[str]:
        return ()


@dataclass(frozen=True)
class ColumnsOfFile(Unannotated):
    """A file whose columns are known by name.

    Attributes:
        columns: name → where in the file it is.
        unread: part of the file → why it is no column.
    """

    path: Path
    columns: Mapping[str, Any]
    unread: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.columns)

    @property
    def place(self) -> Place:
        return Place(str(self.path))


class Allowance:
    """The bytes that the logs of one call may hold once they are unpacked: ``LARGEST`` in all."""

    def __init__(self) -> None:
        self._taken: dict[Path, int] = {}

    def take(self, path: Path, size: int, expected: str) -> None:
        """Count what a file holds, in place of what was counted of it before.

        Raises:
            BadInput: if that is too much, for itself or with the other logs.
        """
        self._taken[path] = size
        total = sum(self._taken.values())
        if total > LARGEST:
            others = f", {total} bytes with the other logs" if total > size else ""
            raise BadInput(
                Place(str(path)),
                f"{size} bytes when unpacked{others}",
                f"{expected}; at most {LARGEST} bytes in all",
                code="LOG010",
            )


def read_bytes(path: Path, expected: str) -> bytes:
    """A log file's bytes.

    Raises:
        BadInput: as ``input_files.read_bytes``, or if it is empty; 1 GB at most.
    """
    place = Place(str(path))
    data = input_files.read_bytes(path, expected, LARGEST)
    if not data or data.isspace():
        raise BadInput(place, "an empty file", expected, code="LOG009")
    return data


def shown(text: str, longest: int = 40) -> str:
    """Text of a file fit for a message: one line, printable, not long."""
    printable = one_line(text[: longest + 1])
    return printable if len(printable) <= longest else f"{printable[:longest]}…"


def listing(names: Sequence[str], most: int = 20) -> str:
    """Names for a message, the first twenty of them."""
    words = ", ".join(shown(n) or "(no name)" for n in names[:most])
    return f"{words}, … ({len(names)} in all)" if len(names) > most else words
