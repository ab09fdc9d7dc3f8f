"""CSV logs: a header line with names, then rows of numbers; comma, semicolon or tab, comments after #."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.errors import BadInput, Place
from codegen.logs.source import Columns, Source, listing, read_bytes, shown

EXPECTED = "a CSV log: a header line with names, then rows of numbers"
_MISSING = {"", "na", "n/a", "nan", "null", "none", "-"}
_NUMBER = re.compile(
    r"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|inf|infinity|nan)\Z", re.ASCII | re.IGNORECASE
)


@dataclass(frozen=True)
class CsvSource:
    """An opened CSV file: its header is read, its body is text still.

    Attributes:
        file: name of the file.
        names: the header's names.
        header_line: where the header stands, counted from 1.
        delimiter: one character.
        lines: every line of the file without its end.
        first: index into ``lines`` of the first line after the header.
        before: lines of the file before ``lines``, for messages.
    """

    file: str
    names: tuple[str, ...]
    header_line: int
    delimiter: str
    lines: list[str]
    first: int
    before: int = 0

    @property
    def place(self) -> Place:
        return Place(self.file, self.header_line)

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns: at the speed of numpy when all is well, row by row to find what is not.

        Raises:
            BadInput: for a column name that stands twice, no rows, a row of another length, or text as a number.
        """
        for name in wanted:
            if self.names.count(name) > 1:
                raise BadInput(
                    self.place, f"{self.names.count(name)} columns called `{shown(name)}`", "names that stand once"
                )
        indices = [self.names.index(name) for name in wanted]
        body = self.lines[self.first :]
        kept = [i for i, line in enumerate(body) if line and not line.isspace() and line.lstrip()[0] != "#"]
        if not kept:
            raise BadInput(self.place, "a header and no rows", "rows of numbers after it")
        if len(kept) < len(body):
            body = [body[i] for i in kept]
        numbers = np.array(kept, dtype=np.int64) + self.before + self.first + 1
        values = self._fast(body, indices)
        if values is None:
            values = self._careful(body, numbers, indices)
        return Columns(self.file, tuple(wanted), values, numbers)

    def _fast(self, body: list[str], indices: list[int]) -> NDArray[np.float64] | None:
        """The (N, c) numbers, or None where anything needs a closer look."""
        separators = len(self.names) - 1
        if any(line.count(self.delimiter) != separators for line in body):
            return None
        try:
            return np.loadtxt(body, delimiter=self.delimiter, usecols=indices, comments=None, ndmin=2, dtype=np.float64)
        except (ValueError, OverflowError):
            return None

    def _careful(self, body: list[str], numbers: NDArray[np.int64], indices: list[int]) -> NDArray[np.float64]:
        width = len(self.names)
        values = np.empty((len(body), len(indices)))
        for k, text in enumerate(body):
            place = Place(self.file, int(numbers[k]))
            fields = _fields(text.split("#", 1)[0], self.delimiter, place)
            if len(fields) != width:
                found = f"{len(fields)} {'value' if len(fields) == 1 else 'values'} in the row"
                raise BadInput(place, found, f"{width}, one for each of {listing(self.names)}")
            for j, index in enumerate(indices):
                values[k, j] = self._number(fields[index], int(numbers[k]), index)
        return values

    def _number(self, text: str, line: int, index: int) -> float:
        text = text.strip()
        if _NUMBER.match(text):
            return float(text)
        if text.lower() in _MISSING:
            return float("nan")
        other = text.replace(",", ".")
        nearest = other if other != text and _NUMBER.match(other) else None
        expected = "a number with a decimal point"
        raise BadInput(Place(self.file, line, shown(self.names[index])), f"`{shown(text)}`", expected, nearest)


def open_csv(path: Path) -> Source:
    """Open a CSV file and read its header.

    Raises:
        BadInput: if it cannot be read, is empty, binary, not UTF-8, or has no header line.
    """
    file = str(path)
    data = read_bytes(path, EXPECTED)
    zero = data.find(b"\0")
    if zero >= 0:
        line = data.count(b"\n", 0, zero) + 1
        raise BadInput(Place(file, line), f"byte {zero} is zero: binary data or UTF-16", f"{EXPECTED}, in UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise BadInput(Place(file, line), f"byte {error.start} is not UTF-8", f"{EXPECTED}, in UTF-8") from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return with_header(file, lines)


def with_header(file: str, lines: list[str]) -> CsvSource:
    """Find the header: the first line that is neither blank nor a comment, or the comment right above the numbers."""
    comment: int | None = None
    for index, line in enumerate(lines):
        stripped = line.strip()
        if not stripped:
            continue
        if stripped.startswith("#"):
            comment = index
            continue
        delimiter = _delimiter(line)
        place = Place(file, index + 1)
        names = tuple(n.strip() for n in _fields(line, delimiter, place))
        if not all(_NUMBER.match(n) for n in names):
            _check_header(names, line, place)
            return CsvSource(file, names, index + 1, delimiter, lines, index + 1)
        if comment is not None:
            place = Place(file, comment + 1)
            named = tuple(n.strip() for n in _fields(lines[comment].strip().lstrip("#"), delimiter, place))
            if len(named) == len(names) and not any(_NUMBER.match(n) for n in named):
                return CsvSource(file, named, comment + 1, delimiter, lines, index)
        raise BadInput(
            Place(file, index + 1), f"numbers (`{shown(line)}`)", "a header line with the columns' names first"
        )
    raise BadInput(Place(file), "comments and no header", EXPECTED)


def _check_header(names: tuple[str, ...], line: str, place: Place) -> None:
    if len(names) == 1 and len(line.split()) > 1:
        raise BadInput(place, f"one column `{shown(line)}`", "names separated by comma, semicolon or tab")


def _delimiter(header: str) -> str:
    """The separator that stands most often in the header; a comma if none does."""
    return max((",", ";", "\t"), key=header.count)


def _fields(text: str, delimiter: str, place: Place) -> list[str]:
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [""])
    except csv.Error as error:
        raise BadInput(place, f"a line that cannot be split ({error})", EXPECTED) from None
