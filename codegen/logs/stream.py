"""Long logs some rows at a time, so that memory stays bounded however long they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import TextIOWrapper
from pathlib import Path

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.csv_file import EXPECTED, LONGEST_LINE, CsvSource, open_csv, open_lines
from codegen.logs.description import SAYS_NOTHING, LogDescription
from codegen.logs.readers import format_of
from codegen.logs.row_forms import upright
from codegen.logs.source import LARGEST_STREAM, Allowance, BlockFile, Columns, LogFile

CHARACTERS = 1 << 22


class NotStreamed(Exception):
    """The log must be read whole, which also finds the words for what is wrong with it."""


class CsvStream(LogFile):
    """A text table whose header is found in the first block.

    Raises:
        BadInput: if there is no table that can be found.
        NotStreamed: if it cannot be opened as text.
    """

    def __init__(self, path: Path, description: LogDescription) -> None:
        super().__init__(path, None, description)
        with _opened(path) as stream:
            text = next(_chunks(stream), "")
        if not text.strip():
            raise NotStreamed
        lines = text.split("\n")
        if self.description.long or upright(lines):
            raise NotStreamed
        self._head = open_lines(str(path), lines, self.description)
        if self._head.layout.times:
            raise NotStreamed
        self.names, self.units, self.said = self._head.names, self._head.units, [*self._head.layout.notes]

    @property
    def place(self) -> Place:
        return self._head.place

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        head, before = self._head, 0
        with _opened(self.path) as stream:
            for text in _chunks(stream):
                lines = text.split("\n")
                if not lines[-1]:
                    lines.pop()
                first = max(0, head.first - before)
                if any(map(head.layout.is_row, lines[first:])):
                    yield CsvSource(head.file, head.layout, lines, first, before).load(wanted)
                before += len(lines)


def open_stream(path: Path, description: LogDescription | None = None) -> LogFile:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener, described = format_of(path), description or SAYS_NOTHING
    if opener is open_csv:
        return CsvStream(path, described)
    if isinstance(opener, type) and issubclass(opener, BlockFile):
        return opener(path, Allowance(), described)
    raise NotStreamed


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
