"""Long logs some rows at a time, so that memory stays bounded however long they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from typing import Protocol

from codegen.errors import Place
from codegen.logs.csv_file import CsvSource, with_header
from codegen.logs.npy_file import open_npy
from codegen.logs.source import Columns

CHARACTERS = 1 << 22


class NotStreamed(Exception):
    """The log must be read whole, which also finds the words for what is wrong with it."""


class Stream(Protocol):
    """An opened log whose rows come in blocks."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that there are."""

    @property
    def place(self) -> Place:
        """Where the names stand."""

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        """Numbers of the wanted columns, in the order of the file.

        Raises:
            BadInput: for a value that is not a number, or a row of another length.
            NotStreamed: for bytes that are no text.
        """


@dataclass(frozen=True)
class CsvStream:
    """A CSV file whose header is read.

    Attributes:
        head: the header as a source whose lines end with it.
    """

    path: Path
    head: CsvSource

    @property
    def names(self) -> tuple[str, ...]:
        return self.head.names

    @property
    def place(self) -> Place:
        return self.head.place

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        head, before = self.head, 0
        with _opened(self.path) as stream:
            for text in _chunks(stream):
                lines = text.split("\n")
                if not lines[-1]:
                    lines.pop()
                first = max(0, head.first - before)
                if any(line and not line.isspace() and line.lstrip()[0] != "#" for line in lines[first:]):
                    yield CsvSource(head.file, head.names, head.header_line, head.delimiter, lines, first, before).load(
                        wanted
                    )
                before += len(lines)


def open_csv_stream(path: Path) -> CsvStream:
    """Open a CSV file and find its header in the first block.

    Raises:
        BadInput: if there is no header line.
        NotStreamed: if it cannot be opened as text.
    """
    with _opened(path) as stream:
        text = next(_chunks(stream), "")
    if not text.strip():
        raise NotStreamed
    return CsvStream(path, with_header(str(path), text.split("\n")))


STREAMS: Mapping[str, Callable[[Path], Stream]] = {
    ".csv": open_csv_stream,
    ".tsv": open_csv_stream,
    ".txt": open_csv_stream,
    ".npy": open_npy,
}
"""Endings of the formats that can be read in blocks; the others are read whole."""


def open_stream(path: Path) -> Stream:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener = STREAMS.get(path.suffix.lower())
    if opener is None:
        raise NotStreamed
    return opener(path)


def _opened(path: Path) -> TextIOWrapper:
    try:
        return path.open(encoding="utf-8-sig")
    except (OSError, ValueError):
        raise NotStreamed from None


def _chunks(stream: TextIOWrapper) -> Iterator[str]:
    """Whole lines, some megabytes at a time, with every line end as \\n."""
    while True:
        try:
            text = stream.read(CHARACTERS)
            text += stream.readline() if text and not text.endswith("\n") else ""
        except (OSError, UnicodeDecodeError):
            raise NotStreamed from None
        if "\0" in text:
            raise NotStreamed
        if not text:
            return
        yield text
