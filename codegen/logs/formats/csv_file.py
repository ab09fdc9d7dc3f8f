"""Text tables of numbers, perhaps with a preamble, a header line, a line of units, and comments after #.

Also a long table: a row for each value, with its time and the name of its signal.
"""

import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput, Place
from codegen.base.user_text import brief
from codegen.logs.binding import column_of, time_of
from codegen.logs.description import LogDescription
from codegen.logs.formats.cells import MINUS, NUMBER, fields, is_row, value_of
from codegen.logs.formats.row_forms import transposed_rows, whole_lines
from codegen.logs.formats.series import Signal, joined
from codegen.logs.formats.source import Allowance, BlockFile, Columns, File, LogFile, NotStreamed, listing
from codegen.logs.formats.table import END, Layout, find_layout, is_remark, starts_as_row
from codegen.logs.formats.text_lines import EXPECTED, lines_of, text_of

SHARE_DAMAGED = 0.01
"""Largest share of damaged rows that ``missing: fill`` leaves out."""
LEFT_OUT = "; `missing: fill` in meta.yaml beside the log leaves out single damaged rows"
MOST_ROWS = 50_000_000
"""Largest number of lines of a text file that is read."""
_DIGITS = frozenset("0123456789")
_NUMBER_STARTS = _DIGITS | frozenset("+-.")
"""First characters of a number: a line that begins with one is no comment and no header."""
_NUMBER_START = re.compile(r"\s*[+-]?\.?\d", re.ASCII)
_TRAILING_COMMENT = re.compile(r"(?:^|\s|(?<=\d))#(?!(n/a|nan|nv|value!|wert!|div/0!)).*", re.IGNORECASE)
"""A comment at the end of a row; #N/A, #NAN, #VALUE! and the like are missing values."""
_WITH_UNIT = re.compile(r"[+-]?[\d.,]+\s*[A-Za-z°µ%][\w°µ%/*^·⋅]*")
"""A number followed by its unit."""
_GROUPED = re.compile(r"[+-]?\d{1,3}([.,' \u00a0\u2009\u202f’]\d{3})+([.,]\d+)?", re.ASCII)
"""A number with separators between thousands."""


class CsvSource(LogFile):
    """An opened text table, of which only the header has been read.

    Args:
        lines: lines of the file or of a part of it, in the plain form of ``layout`` and without line ends.
        first: index into ``lines`` of the first line after the header.
        before: number of lines of the file before ``lines``; messages name lines of the file.
        encoding: notes on the file's encoding.
    """

    expected = EXPECTED

    def __init__(
        self,
        file: str,
        layout: Layout,
        lines: list[str],
        first: int,
        before: int = 0,
        encoding: Sequence[str] = (),
        description: LogDescription | None = None,
    ) -> None:
        super().__init__(Path(file), None, description)
        self.file, self.layout, self.lines, self.first, self.before = file, layout, lines, first, before
        self.names, self.units, self.own_notes = layout.names, dict(layout.units), [*encoding, *layout.notes]
        self.unread, self._started = dict(layout.unread), dict(layout.started)

    @property
    def place(self) -> Place:
        return Place(self.file, self.layout.line)

    @property
    def notes(self) -> Sequence[str]:
        head = self.layout.head - {END}
        repeated = [i for i in range(self.first, len(self.lines)) if self.lines[i] in head]
        if repeated:
            more = f", {len(repeated)} such lines in all" if len(repeated) > 1 else ""
            return (*self.own_notes, f"line {self.before + repeated[0] + 1} repeats the header and is left out{more}")
        return self.own_notes

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns, by NumPy if all lines are regular, else row by row.

        ``wanted``: names, or numbers counted from 1 where a name appears twice.
        """
        for name in wanted:
            if self.names.count(name) > 1:
                twice = [k + 1 for k, other in enumerate(self.names) if other == name]
                expected = f"a name that occurs once, or the number of the column, one of {', '.join(map(str, twice))}"
                raise BadInput(self.place, f"{len(twice)} columns called `{brief(name)}`", expected, code="LOG004")
        indices = [self.names.index(name) if name in self.names else int(name) - 1 for name in wanted]
        return self._on_common_times(wanted, indices) if self.layout.times else self._columns(wanted, indices)

    def _on_common_times(self, wanted: Sequence[str], indices: list[int]) -> Columns:
        """The wanted columns of a table in which each channel has a column of times, joined at common times."""
        own = {name: k for name, k in zip(wanted, indices, strict=True) if k or len(indices) == 1}
        clock = next((name for name in wanted if name not in own), "")
        names = [str(j) for k in own.values() for j in (k, self.layout.times[k])]
        read = dict(zip(names, self._columns(names, list(map(int, names))).values.T, strict=True))
        tick = self.layout.tick
        began = min(read[str(self.layout.times[k])][0] for k in own.values())
        signals = {}
        for name, k in own.items():
            time = read[str(self.layout.times[k])]
            valid = np.isfinite(time)
            signals[name] = Signal(self.names[k], (tick or 1.0) * (time[valid] - began), read[str(k)][valid])
        return joined(self, signals, wanted, clock, in_seconds=tick is not None)

    def _columns(self, wanted: Sequence[str], indices: list[int]) -> Columns:
        """The columns with these indices, row by row as in the file, with the names in ``wanted``."""
        body = self.lines[self.first :]
        head = self.layout.head
        # Most lines begin with a number, and are rows without the slower test for comments and repeated headers.
        kept = [
            i
            for i, line in enumerate(body)
            if (line[:1] in _NUMBER_STARTS and line[:3] != "---") or (is_row(line) and line not in head)
        ]
        if not kept:
            raise BadInput(self.place, "a header and no rows", "rows of numbers after it", code="LOG009")
        kept = self._without_remarks(kept, body)
        if len(kept) < len(body):
            body = [body[i] for i in kept]
        numbers = np.array(kept, dtype=np.int64) + self.before + self.first + 1
        values = self._by_numpy(body, indices)
        if values is None:
            values = self._row_by_row(body, numbers, indices)
        elif self.layout.decimal == "." and not self.layout.decimal_stated:
            padded = any(".000" in line for line in body)
            for j in range(len(indices)):
                if _may_be_grouped(values[:, j], padded):
                    self._refuse_grouped(body, numbers, indices[j])
        return Columns(self.file, tuple(wanted), values, numbers)

    def _by_numpy(self, body: list[str], indices: list[int]) -> NDArray[np.float64] | None:
        """The (N, c) numbers by NumPy, or None if a line is not regular."""
        delimiter, width = self.layout.delimiter, len(self.names)
        if self._started.keys() & indices:
            return None
        if not delimiter:
            if any(len(line.split()) != width for line in body):
                return None
        elif any(line.count(delimiter) != width - 1 for line in body):
            return None
        if self.layout.decimal == ",":
            if delimiter == "," or any("." in line for line in body):
                return None
            body = [line.replace(",", ".") for line in body]
        try:
            return np.loadtxt(
                body, delimiter=delimiter or None, usecols=indices, comments=None, ndmin=2, dtype=np.float64
            )
        except (ValueError, OverflowError):
            return None

    def _refuse_grouped(self, body: list[str], numbers: NDArray[np.int64], index: int) -> None:
        """Raise BadInput for a column of whole numbers and numbers such as 1.234, which may mean 1234."""
        texts = [fields(line, self.layout.delimiter, self.place)[index].strip() for line in body]
        grouped = [k for k, text in enumerate(texts) if "." in text]
        if 0 < len(grouped) < len(texts) and all(_GROUPED.fullmatch(texts[k]) for k in grouped):
            k, whole = grouped[0], next(text for text in texts if "." not in text)
            found = f"`{brief(texts[k])}` in a column of whole numbers such as `{brief(whole)}`"
            expected = "numbers without a sign between thousands; or `decimal: point` in meta.yaml beside the log"
            raise BadInput(Place(self.file, int(numbers[k]), brief(self.names[index])), found, expected, code="LOG005")

    def _without_remarks(self, kept: list[int], body: list[str]) -> list[int]:
        """Indices of the lines that are no text among rows that begin with a number; a note names the first one."""
        split = partial(fields, delimiter=self.layout.delimiter, place=self.place)
        if not starts_as_row(split(body[kept[0]])):
            return kept
        width = len(self.names)
        others = (i for i in kept if body[i][:1] not in _DIGITS and not _NUMBER_START.match(body[i]))
        remarks = {i for i in others if is_remark(split(body[i]), width)}
        for i in sorted(remarks):
            texts = [text.strip() for text in split(body[i])]
            if len(texts) == width > 1 and 2 * sum(text in self.names for text in texts) >= width:
                found = f"another header (`{brief(body[i], 80)}`)"
                expected = "one header; a file for each record"
                raise BadInput(Place(self.file, self.before + self.first + i + 1), found, expected, code="LOG007")
        if remarks:
            first, more = min(remarks), f", and {len(remarks) - 1} more such lines" if len(remarks) > 1 else ""
            words = (
                f"line {self.before + self.first + first + 1} is text, and not read (`{brief(body[first], 40)}`){more}"
            )
            self.own_notes.append(words)
        return [i for i in kept if i not in remarks] if remarks else kept

    def _row_by_row(self, body: list[str], numbers: NDArray[np.int64], indices: list[int]) -> NDArray[np.float64]:
        """The (N, c) numbers of rows that may have comments, missing values, dates or words such as ``true``.

        Under ``missing: fill`` the values of a single damaged row are missing.
        """
        values = np.full((len(body), len(indices)), np.nan)
        damaged: list[BadInput] = []
        for k, text in enumerate(body):
            place = Place(self.file, int(numbers[k]))
            found = fields(_TRAILING_COMMENT.sub("", text) if "#" in text else text, self.layout.delimiter, place)
            try:
                values[k] = self._numbers(found, int(numbers[k]), indices, first=k == 0)
            except BadInput as error:
                damaged.append(error)
                if self.description.missing != "fill" or len(damaged) > SHARE_DAMAGED * len(body):
                    raise damaged[0] from None
        if damaged:
            first, more = damaged[0], f", and {len(damaged) - 1} more such rows" if len(damaged) > 1 else ""
            self.own_notes.append(f"line {first.place.line} is a damaged row, and not read ({first.found}){more}")
        return values

    def _numbers(self, found: list[str], line: int, indices: list[int], first: bool) -> list[float]:
        """The numbers of a row with these fields, perhaps the first row; raises BadInput as ``_row_by_row``."""
        width = len(self.names)
        while len(found) > width and not found[-1].strip():
            found.pop()
        if self.layout.times:
            found += [""] * (width - len(found))
        if len(found) != width:
            words = f"{len(found)} {'value' if len(found) == 1 else 'values'} in the row"
            expected = f"{width}, one for each of {listing(self.names)}"
            if self.layout.delimiter == "," and len(found) > width and not any("." in text for text in found):
                expected += "; decimal commas between commas cannot be read, write the file with semicolons"
            elif not first:
                expected += LEFT_OUT
            raise BadInput(Place(self.file, line), words, expected, code="LOG005")
        return [self._number(found[index], line, index) for index in indices]

    def _number(self, text: str, line: int, index: int) -> float:
        """The number of a field; of a date or time of day the seconds since the first row, NaN for a missing value."""
        text = text.strip().replace(MINUS, "-")
        separator = self.layout.decimal
        plain = text.replace(",", ".") if separator == "," and "." not in text else text
        begun = self._started.get(index)
        pointed = separator == "," and NUMBER.match(text) and "." in text
        if not pointed and (value := value_of(plain, begun)) is not None:
            return value
        place = Place(self.file, line, brief(self.names[index]))
        expected, nearest = self._expected_number(text)
        if begun is not None:
            expected, nearest = "a date or time of day, as in the first row", None
        raise BadInput(place, f"`{brief(text)}`", expected, nearest, code="LOG005")

    def _expected_number(self, text: str) -> tuple[str, str | None]:
        """What a message expects in place of a text that is no number, and the number that was probably meant."""
        separator = self.layout.decimal
        if ":" in text or text.count("/") == 2 or (text.count(".") == 2 and len(text) == 10):
            dates = "2026-03-04 23:59:58.002 (ISO 8601); or `sample_time: SECONDS` in meta.yaml beside the log"
            return f"a number, or date and time of day as {dates}, without a column of time", None
        other = re.sub("[dD]", "E", text).replace(",", ".")
        nearest = other if other != text and NUMBER.match(other) else None
        key = "`decimal: comma` in meta.yaml beside the log"
        if _GROUPED.fullmatch(text) and (separator != "." or text.count(",") != 1 or "." in text):
            may = f"; if its comma stands before decimals, {key}" if not separator else ""
            also = (
                "; `decimal: point` in meta.yaml beside the log if it stands before decimals"
                if separator == ","
                else ""
            )
            return f"a number without a sign between its thousands{may}{also}", None
        if separator == ",":
            return "a number with a decimal comma, as the others in the file (or `decimal: point`, see the docs)", None
        if nearest:
            grouped = ", or without a sign between thousands" if _GROUPED.fullmatch(text) else ""
            commas = f"; {key} reads decimal commas" if "," in text else ""
            return f"a number with a decimal point{grouped}{commas}", None if grouped else nearest
        if re.fullmatch("[0-9a-f]{4,16}", text, re.IGNORECASE):
            return "a number, if hexadecimal with 0x before it", None
        if _WITH_UNIT.fullmatch(text):
            return "a number without its unit, which `units:` in meta.yaml beside the log states", None
        return f"a number with a decimal point{'' if self.description.missing == 'fill' else LEFT_OUT}", None


def _may_be_grouped(values: NDArray[np.float64], padded: bool) -> bool:
    """Whether the points of a column may be thousands separators, as in 998, 999, 1.000, 1.001.

    They may be if some numbers are whole and below 1000, and all others have three decimals and are at least 1. A
    column that increases with points read as decimal points has decimal points: the numbers above would decrease.

    Args:
        values: of the column, with the points read as decimal points.
        padded: whether some numbers of the table end in ``.000``, which are whole as numbers but not as texts.
    """
    size = np.abs(values[np.isfinite(values)])
    whole = size == np.floor(size)
    if np.all(np.diff(values[np.isfinite(values)]) > 0):
        return False
    split = ~whole & (size >= 1) & (np.abs(1000 * size - np.round(1000 * size)) < 1e-6)
    return bool((split.any() or padded) and whole.any() and (split | whole).all() and (size < 1000).all())


def open_csv(path: Path, allowance: Allowance, description: LogDescription) -> CsvSource:
    """Open a text file and find its table."""
    file = File(path, EXPECTED)
    data = file.read_bytes()
    allowance.take(path, len(data), EXPECTED)
    rows = data.count(b"\n") + data.count(b"\r")
    if rows > MOST_ROWS:
        raise file.fault(f"{rows} lines", f"{EXPECTED}; at most {MOST_ROWS} lines", code="LOG010")
    text, notes = text_of(str(path), data)
    lines = whole_lines(text.split("\n"))
    turned = transposed_rows(lines) if description.header is None else None
    if turned is not None:
        notes = (*notes, "each line is a signal: the table is transposed, and its rows are counted as lines")
    return _without_incomplete_end(open_lines(str(path), turned or lines, description, notes))


def _without_incomplete_end(source: CsvSource) -> CsvSource:
    """The table without its last line if that is incomplete, as after a loss of power."""
    last, layout = len(source.lines) - 1, source.layout
    if last <= source.first or layout.times or not is_row(line := source.lines[last]):
        return source
    if line.count('"') % 2 or len(fields(line, layout.delimiter, Place(""))) < len(source.names):
        source.lines = source.lines[:last]
        source.own_notes.append(f"line {last + 1}, the last one, is cut off and not read")
    return source


def open_lines(file: str, lines: list[str], description: LogDescription, encoding: Sequence[str] = ()) -> CsvSource:
    """The table in lines of a file; raises as ``find_layout``."""
    named = tuple(description.columns) if description.listed else ()
    asked, clock = set(description.columns.values()), description.columns.get("t", "")
    layout = find_layout(file, lines, description.header, named, description.decimal, asked, clock)
    notes = [*encoding, *_left_out(layout, lines)]
    return CsvSource(file, layout, layout.plain(lines), layout.first, encoding=notes, description=description)


def _left_out(layout: Layout, lines: list[str]) -> list[str]:
    """A note on the parts of rows that the conversion to plain lines leaves out; empty if it leaves out nothing."""
    texts = [] if layout.form is None else map(layout.form.left, lines)
    left = [(i + 1, text) for i, text in enumerate(texts) if text.strip() and i >= layout.first]
    more = f", nor are such parts of {len(left) - 1} more lines" if len(left) > 1 else ""
    return [f"`{brief(text, 60)}` of line {number} is not read{more}" for number, text in left[:1]]


class LongTable(LogFile):
    """The signals of a table in long format, joined at common times."""

    def __init__(self, table: CsvSource, description: LogDescription) -> None:
        super().__init__(table.path, None, description)
        self.table = table
        self._time = time_of(table, description)
        long = description.long
        assert long is not None
        self._value = column_of(table, long.value, description.place("long.value"))
        named = column_of(table, long.name, description.place("long.name"))
        index = table.names.index(named)
        self._rows: dict[str, list[int]] = {}
        for i, line in enumerate(table.lines):
            if i >= table.first and line not in table.layout.head and is_row(line):
                texts = fields(line, table.layout.delimiter, table.place)
                self._rows.setdefault(texts[index].strip() if index < len(texts) else "", []).append(i)
        self.names = (self._time, *self._rows)
        self.units = {self._time: table.units.get(self._time, "")}
        self.own_notes = list(table.notes)

    @property
    def place(self) -> Place:
        return self.table.place

    def load(self, wanted: Sequence[str]) -> Columns:
        signals = {name: self._signal(name) for name in wanted if name != self._time}
        return joined(self, signals, wanted, self._time, in_seconds=False)

    def _signal(self, name: str) -> Signal:
        """A signal from its own rows; the other lines become blank, so that messages still count lines correctly."""
        lines = [""] * len(self.table.lines)
        for i in self._rows[name]:
            lines[i] = self.table.lines[i]
        part = CsvSource(self.table.file, self.table.layout, lines, self.table.first)
        values = part.load([self._time, self._value]).values
        return Signal(name, values[:, 0], values[:, 1])


BLOCK_BYTES = 1 << 22
"""Bytes of the file that are read at a time."""


class CsvStream(BlockFile):
    """A text table that is read block by block; its header must be in the first block.

    Raises:
        BadInput: if there is no table that can be found.
        NotStreamed: if it cannot be opened as text.
    """

    expected = EXPECTED

    def find(self) -> None:
        lines = next(self._lines(), [])
        if self.description.long or not any(map(str.strip, lines)) or transposed_rows(lines):
            raise NotStreamed
        self._head = open_lines(str(self.path), lines, self.description)
        if self._head.layout.times:
            raise NotStreamed
        self.names, self.units = self._head.names, self._head.units
        self.own_notes += self._head.layout.notes

    @property
    def place(self) -> Place:
        return self._head.place

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        head, before = self._head, 0
        for lines in self._lines():
            first, plain = max(0, head.first - before), head.layout.plain(lines)
            if any(map(is_row, plain[first:])):
                block = CsvSource(head.file, head.layout, plain, first, before, description=self.description)
                loaded = block.load(wanted)
                self.own_notes += block.notes[len(head.layout.notes) :]  # of this block: lines that are left out
                yield loaded
            before += len(lines)

    def _lines(self) -> Iterator[list[str]]:
        """The lines of each block."""
        try:
            with self.opened() as stream:
                yield from lines_of(iter(partial(stream.read, BLOCK_BYTES), b""), str(self.path), self.own_notes)
        except (BadInput, OSError):
            raise NotStreamed from None
