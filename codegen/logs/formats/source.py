"""Base classes of log formats: a file gives the names of its columns, and loads some of them."""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import logging
import sys
import traceback
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from codegen.base import input_files
from codegen.base.errors import BadInput, Place
from codegen.base.user_text import brief
from codegen.logs.description import EMPTY_DESCRIPTION, LogDescription

LARGEST = 1_000_000_000
"""Most bytes of a log that is read whole, and of all logs of one call when unpacked."""
LARGEST_STREAM = 100_000_000_000
"""Most bytes of a log that is read in blocks."""
MOST_MEMORY = 2_000_000_000
"""Most memory of a library for a file, in bytes."""


@dataclass(frozen=True)
class Columns:
    """Numbers of some columns of a file.

    Attributes:
        values: (N, c), as in the file; NaN for a missing value.
        lines: (N,) line numbers of the rows counted from 1, or None where the format has none.
    """

    file: str
    names: tuple[str, ...]
    values: NDArray[np.float64]
    lines: NDArray[np.int64] | None = None

    def place(self, row: int, column: int | None = None) -> Place:
        """Place of a value; a format without lines counts elements from 1, as MATLAB does."""
        name = "" if column is None else brief(self.names[column])
        if self.lines is not None:
            return Place(self.file, int(self.lines[row]), name)
        return Place(self.file, None, f"{name or 'sample'}({row + 1})")

    def rows(self, keep: NDArray[np.bool_]) -> Columns:
        """The rows where ``keep``, (N,), is true."""
        return Columns(self.file, self.names, self.values[keep], None if self.lines is None else self.lines[keep])


class Allowance:
    """Limit of the unpacked bytes of all logs of one call: ``LARGEST``."""

    def __init__(self) -> None:
        self._taken: dict[Path, int] = {}

    def take(self, path: Path, size: int, expected: str) -> None:
        """Count the bytes of a file, in place of an earlier count of it.

        Raises BadInput if the file, or all logs together, are too large.
        """
        self._taken[path] = size
        total = sum(self._taken.values())
        if total > LARGEST:
            others = f", {total} bytes with the other logs" if total > size else ""
            expected = f"{expected}; at most {LARGEST} bytes in all"
            raise BadInput(Place(str(path)), f"{size} bytes when unpacked{others}", expected, code="LOG010")


class File:
    """A file or folder that is read; ``expected`` describes its format, for messages."""

    expected = "a log file"

    def __init__(self, path: Path, expected: str = "") -> None:
        self.path, self.expected = path, expected or self.expected

    @property
    def place(self) -> Place:
        return Place(str(self.path))

    def fault(self, found: str, expected: str = "", column: str = "", code: str = "LOG001") -> BadInput:
        """The error for a fault of the file, or of a column of it."""
        place = Place(str(self.path), None, brief(column, 80)) if column else self.place
        return BadInput(place, found, expected or self.expected, code=code)

    def opened(self, largest: int = LARGEST_STREAM) -> IO[bytes]:
        """The file's bytes as a stream; see ``input_files.opened``."""
        return input_files.opened(self.path, self.expected, largest)

    def read_bytes(self) -> bytes:
        """All of its bytes, at most ``LARGEST``. Raises BadInput as ``input_files.read_bytes``, or if it is empty."""
        data = input_files.read_bytes(self.path, self.expected, LARGEST)
        if not data or data.isspace():
            raise self.fault("an empty file", code="LOG009")
        return data

    def library(self, module: str, extra: str) -> Any:
        """A module of an optional dependency. Raises BadInput where it is not installed."""
        try:
            return importlib.import_module(module)
        except ImportError as error:
            found = f"a log that needs the package `{module.partition('.')[0]}`, which cannot be imported ({error})"
            raise self.fault(found, f"it installed: pip install 'stiction[{extra}]'", code="TOOL003") from None

    @contextlib.contextmanager
    def reading(self, expected: str = "") -> Iterator[None]:
        """Call a library on the file with limited memory and no output; every exception becomes a BadInput.

        A library raises any exception for a damaged file; all of them mean the same here. ``expected``: what the file
        should hold, for a message; ``self.expected`` by default. Raises BadInput for every exception but BadInput
        itself.
        """
        with bounded(), quiet():
            try:
                yield
            except BadInput:
                raise
            except Exception as error:
                words = brief(str(error).strip(), 100) or "no words"
                found = f"a damaged file ({type(error).__name__}: {words})"
                if isinstance(error, MemoryError):
                    found = f"a file whose reading takes more than {MOST_MEMORY} bytes"
                _release(error)
                raise self.fault(found, expected) from None


class LogFile(File, ABC):
    """An opened log, whose columns are found by ``find``; a subclass for each format.

    Attributes:
        names: of the columns; loading refuses one that holds no numbers.
        units: column → the unit that the file itself states; empty if it states none.
        own_notes: on how the file was read, so far.
        unread: part of the file → why it is no column.
        commands: column of commanded positions → column of the measured ones, if its name does not say so.
        joints_in_brackets: whether the brackets of a name hold a joint, and no unit.
    """

    joints_in_brackets = False

    def __init__(
        self, path: Path, allowance: Allowance | None = None, description: LogDescription | None = None
    ) -> None:
        super().__init__(path)
        self.allowance, self.description = allowance or Allowance(), description or EMPTY_DESCRIPTION
        self.names: tuple[str, ...] = ()
        self.units: Mapping[str, str] = {}
        self.own_notes: list[str] = []
        self.unread: dict[str, str] = {}
        self.commands: Mapping[str, str] = {}
        self.find()

    def find(self) -> None:
        """Find the columns: set ``names`` and the other attributes. Raises BadInput for a file that cannot be used."""

    @property
    def notes(self) -> Sequence[str]:
        """Notes on how the file was read; complete after loading."""
        return self.own_notes

    @abstractmethod
    def load(self, wanted: Sequence[str]) -> Columns:
        """All rows of the wanted columns, which are members of ``names``.

        Raises BadInput for the first value that is not a number, columns of different length, or too many numbers.
        """

    def take(self, size: int) -> None:
        """Count the bytes that the file holds when unpacked; see ``Allowance.take``."""
        self.allowance.take(self.path, size, self.expected)

    def require_equal(self, lengths: Mapping[str, int]) -> None:
        """Raise BadInput for a column of another length than the first one."""
        first, rows = next(iter(lengths.items()))
        for name, count in lengths.items():
            if count != rows:
                raise self.fault(f"{count} values", f"{rows} values as in `{brief(first)}`", name, "LOG011")


class NotStreamed(Exception):
    """The log cannot be read in blocks; reading it whole also reports its faults."""


class BlockFile(LogFile):
    """A log that is read by its ``blocks``; ``rows`` is the number of rows."""

    rows = 0

    @abstractmethod
    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """The rows of the wanted columns (``load``), in blocks of rows."""

    def load(self, wanted: Sequence[str]) -> Columns:
        if not self.rows:
            raise self.fault("a table without rows", code="LOG009")
        self.take(8 * self.rows * len(wanted))
        values = np.concatenate([block.values for block in self.blocks(wanted)])
        return Columns(str(self.path), tuple(wanted), values)


def listing(names: Sequence[str], most: int = 20) -> str:
    """Names for a message, the first twenty of them."""
    words = ", ".join(brief(n) or "(no name)" for n in names[:most])
    return f"{words}, … ({len(names)} in all)" if len(names) > most else words


def _release(error: BaseException | None) -> None:
    """Free the objects that a failed call of a library left, while its warnings about them are suppressed."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__
    gc.collect()


@contextlib.contextmanager
def bounded() -> Iterator[None]:
    """Limit the address space, so that compressed data that become too large raise MemoryError."""
    pages = _pages()
    if pages is None:
        yield
        return
    import resource  # Unix alone has it

    used = pages * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    known = [limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([used + MOST_MEMORY, *known]), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _pages() -> int | None:
    """The size of this process's address space in pages, as Linux states it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0])
    except (OSError, ValueError, IndexError):
        return None


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Suppress what the library prints, logs or warns of."""
    before, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
        ):
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
        sys.unraisablehook = hook
