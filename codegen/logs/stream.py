"""Long logs some rows at a time, so that memory stays bounded however long they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from typing import Protocol

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.csv_file import EXPECTED, LONGEST_LINE, CsvSource, open_lines
from codegen.logs.description import LogDescription
from codegen.logs.npy_file import open_npy
from codegen.logs.parquet_file import open_parquet
from codegen.logs.source import LARGEST_STREAM, Allowance, Columns, Opened
from codegen.logs.table import COMMENT

CHARACTERS = 1 << 22


class NotStreamed(Exception):
    """The log must be read whole, which also finds the words for what is wrong with it."""


class Stream(Opened, Protocol):
    """A log file whose rows come in blocks."""

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

    @property
    def units(self) -> Mapping[str, str]:
        return self.head.units

    @property
    def notes(self) -> Sequence[str]:
        return self.head.layout.notes

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        head, before = self.head, 0
        with _opened(self.path) as stream:
            for text in _chunks(stream):
                lines = text.split("\n")
                if not lines[-1]:
                    lines.pop()
                first = max(0, head.first - before)
                if any(line and not line.isspace() and not COMMENT.match(line) for line in lines[first:]):
                    yield CsvSource(head.file, head.layout, lines, first, before).load(wanted)
                before += len(lines)


def open_csv_stream(path: Path, description: LogDescription) -> CsvStream:
    """Open a CSV file and find its header in the first block.

    Raises:
        BadInput: if there is no table that can be found.
        NotStreamed: if it cannot be opened as text.
    """
    with _opened(path) as stream:
        text = next(_chunks(stream), "")
    if not text.strip():
        raise NotStreamed
    return CsvStream(path, open_lines(str(path), text.split("\n"), description))


def _open_npy_stream(path: Path, description: LogDescription) -> Stream:
    return open_npy(path)


def _open_parquet_stream(path: Path, description: LogDescription) -> Stream:
    return open_parquet(path, Allowance(), description)


STREAMS: Mapping[str, Callable[[Path, LogDescription], Stream]] = {
    ".csv": open_csv_stream,
    ".tsv": open_csv_stream,
    ".txt": open_csv_stream,
    ".npy": _open_npy_stream,
    ".parquet": _open_parquet_stream,
}
"""Endings of the formats that can be read in blocks; the others are read whole."""


def open_stream(path: Path, description: LogDescription | None = None) -> Stream:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener = STREAMS.get(path.suffix.lower())
    if opener is None:
        raise NotStreamed
    return opener(path, description or LogDescription())


def _opened(path: Path) -> TextIOWrapper:
    try:
        return TextIOWrapper(opened(path, EXPECTED, LARGEST_STREAM), encoding="utf-8-sig")
    except BadInput:
        raise NotStreamed from None


def _chunks(stream: TextIOWrapper) -> Iterator[str]:
    """Whole lines, some megabytes at a time, with every line end as \\n."""
    while True:
        try:
            text = stream.read(CHARACTERS)
            if text and not text.endswith("\n"):
                end = stream.readline(LONGEST_LINE)
                if len(end) == LONGEST_LINE:
                    raise NotStreamed
                text += end
        except (OSError, UnicodeDecodeError):
            raise NotStreamed from None
        if "\0" in text:
            raise NotStreamed
        if not text:
            return
        yield text
