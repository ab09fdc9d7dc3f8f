"""Long logs some rows at a time, so that memory stays bounded however long they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from codegen.base.errors import BadInput, Place
from codegen.logs.csv_file import CsvSource, open_csv, open_lines
from codegen.logs.description import SAYS_NOTHING, LogDescription
from codegen.logs.readers import format_of
from codegen.logs.row_forms import upright
from codegen.logs.source import Allowance, BlockFile, Columns, OpenedLog
from codegen.logs.text_lines import EXPECTED, lines_of

PIECE = 1 << 22
"""Bytes that are read at once."""


class NotStreamed(Exception):
    """The log must be read whole, which also finds the words for what is wrong with it."""


class CsvStream(OpenedLog):
    """A text table whose header is found in the first block.

    Raises:
        BadInput: if there is no table that can be found.
        NotStreamed: if it cannot be opened as text.
    """

    expected = EXPECTED

    def find(self) -> None:
        lines = next(self._lines(), [])
        if self.description.long or not any(map(str.strip, lines)) or upright(lines):
            raise NotStreamed
        self._head = open_lines(str(self.path), lines, self.description)
        if self._head.layout.times:
            raise NotStreamed
        self.names, self.units = self._head.names, self._head.units
        self.said += self._head.layout.notes

    @property
    def place(self) -> Place:
        return self._head.place

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        head, before = self._head, 0
        for lines in self._lines():
            first = max(0, head.first - before)
            if any(map(head.layout.is_row, lines[first:])):
                yield CsvSource(head.file, head.layout, lines, first, before).load(wanted)
            before += len(lines)

    def _lines(self) -> Iterator[list[str]]:
        try:
            with self.opened() as stream:
                yield from lines_of(iter(partial(stream.read, PIECE), b""), str(self.path), self.said)
        except (BadInput, OSError):
            raise NotStreamed from None


def open_stream(path: Path, description: LogDescription | None = None) -> OpenedLog:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener, described = format_of(path), description or SAYS_NOTHING
    if opener is open_csv:
        return CsvStream(path, Allowance(), described)
    if isinstance(opener, type) and issubclass(opener, BlockFile):
        return opener(path, Allowance(), described)
    raise NotStreamed
