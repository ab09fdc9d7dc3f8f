"""What every log format gives: names of columns, then the numbers of the columns that are wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from codegen.errors import BadInput, Place

LARGEST = 1_000_000_000


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
        """Where a value stands; a format without lines counts elements from 1, as MATLAB does."""
        name = "" if column is None else shown(self.names[column])
        if self.lines is not None:
            return Place(self.file, int(self.lines[row]), name)
        return Place(self.file, None, f"{name or 'sample'}({row + 1})")

    def rows(self, keep: NDArray[np.bool_]) -> Columns:
        """The rows where ``keep``, (N,), is true."""
        return Columns(self.file, self.names, self.values[keep], None if self.lines is None else self.lines[keep])


class Source(Protocol):
    """An opened log file."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that there are."""

    @property
    def place(self) -> Place:
        """Where the names stand."""

    def load(self, wanted: Sequence[str]) -> Columns:
        """The numbers of the wanted columns, each a member of ``names``.

        Raises:
            BadInput: for the first value that is not a number, or columns of different length.
        """


def read_bytes(path: Path, expected: str) -> bytes:
    """A log file's bytes.

    Raises:
        BadInput: if it is absent, a folder, unreadable, empty or larger than 1 GB.
    """
    place = Place(str(path))
    try:
        if path.is_dir():
            raise BadInput(place, "a folder", expected)
        if not path.is_file():
            raise BadInput(place, "no such file", expected)
        size = path.stat().st_size
        if size > LARGEST:
            raise BadInput(place, f"{size} bytes", f"{expected} of at most {LARGEST} bytes")
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(place, f"unreadable ({error.strerror})", expected) from None
    except ValueError as error:  # a zero byte in the name
        raise BadInput(Place(shown(str(path))), f"no file name ({error})", expected) from None
    if not data.strip():
        raise BadInput(place, "an empty file", expected)
    return data


def shown(text: str, longest: int = 40) -> str:
    """Text of a file fit for a message: one line, printable, not long."""
    printable = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text[: longest + 1])
    return printable if len(printable) <= longest else f"{printable[:longest]}…"


def listing(names: Sequence[str], most: int = 20) -> str:
    """Names for a message, the first twenty of them."""
    words = ", ".join(shown(n) or "(no name)" for n in names[:most])
    return f"{words}, … ({len(names)} in all)" if len(names) > most else words
