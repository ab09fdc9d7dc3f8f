"""Layout of the table in a text file: separator, names of the columns, units and first row.

The first rows are found first: lines of numbers with equally many fields. The names are in the line above them, or
above a line of units; a description may state the line, and a scope's export has a key for it. Earlier lines are
ignored. Units are then found in one way for all of these: see ``_Head.units``.
"""

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import islice, product

from codegen.base.errors import BadInput, Place
from codegen.base.user_text import brief
from codegen.logs.binding import time_columns
from codegen.logs.formats.cells import (
    COMMENT,
    COMMENT_MARKS,
    SEPARATORS,
    WORDS,
    all_fields,
    decimal_sign,
    delimiter_of,
    fields,
    filled_fields,
    is_missing,
    is_number,
    is_row,
    is_value,
    restart_period,
    significant,
    stamp,
)
from codegen.logs.formats.row_forms import Form, find_form
from codegen.logs.formats.source import listing
from codegen.logs.formats.text_lines import EXPECTED, LINES_SEARCHED
from codegen.spec.column_units import LONGEST_UNIT, in_usual_case
from codegen.spec.units import is_unit

ROWS_ALIKE = 3
"""Number of alike lines that are rows of a table."""
END = "EOF"
"""A line that ends a table."""
UNIT_KEYS = ("unit", "units", "einheit")
"""Keys of a property that is the unit of its column."""
_UNIT_LABEL = re.compile(r"(?:(?:y|v|vertical)[ _]?)?(?:units?|einheit(?:en)?)(?:[ _]?labels?)?:?", re.IGNORECASE)
"""The first field of a line of units: ``Unit``, ``Y_Unit_Label`` of LabVIEW, ``VUnit`` of oscilloscopes."""
_UNIT_COMMENT = re.compile(r"\s*(?:#|%|//)\s*(?i:units?|einheit(?:en)?)\s*[:=]?\s*(.+)")
"""``# units: s, mm, N``"""
_PROPERTY = re.compile(r"([A-Za-z]+): ?(.*)")
"""A property of a column below its name, ``Unit: mm``, as Simulink's Data Inspector writes them."""
_NAME = re.compile(rf"\S+(?:\s+[\[(][^\])]{{0,{LONGEST_UNIT}}}[\])])?")
"""A word as a column's name, perhaps with a unit in brackets behind it."""
_SCOPE_NAMES = ("name", "channel name", "channel")
"""The first fields of the line of names in a scope's export."""
_TWINCAT_ABOVE, _TWINCAT_UNDER = "starttime of export", "sampletime[ms]"
"""The first fields of lines above and below the names that only TwinCAT's exports have. Their times are in ms, or
Windows' FILETIME."""


@dataclass(frozen=True)
class Layout:
    """The layout of a table in a text file.

    Attributes:
        line: of the header, or of the first row if there is no header; counted from 1.
        first: index of the first line after header and units.
        units: (name, its text in the line of units).
        decimal: the decimal separator; empty if a comma may be that or separate thousands.
        decimal_stated: whether a description states it.
        head: texts of the header, of the lines between it and the rows, and ``END``: where such a line comes again
            among the rows, it is no row.
        started: column, counted from 0, that holds dates or times of day → that of the first row.
        form: conversion of the lines to plain ones, which all other attributes are about; None if lines are plain.
        times: column → column of its time, both counted from 0; empty if all columns have the same time.
        tick: unit of ``times`` in s; the times in s are the first column. None: they keep the file's unit.
        unread: names of a line before the header that could be the header too, each with why it is no column.
    """

    names: tuple[str, ...]
    line: int
    first: int
    delimiter: str
    units: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    decimal: str = "."
    decimal_stated: bool = False
    head: frozenset[str] = frozenset()
    started: tuple[tuple[int, datetime], ...] = ()
    form: Form | None = None
    times: tuple[int, ...] = ()
    tick: float | None = 1.0
    unread: tuple[tuple[str, str], ...] = ()

    def plain(self, lines: list[str]) -> list[str]:
        """The lines in plain form, as many as given."""
        return lines if self.form is None else self.form.plain_lines(lines)


def is_remark(texts: Sequence[str], width: int) -> bool:
    """Whether a line among rows that begin with a number is text, such as a message of the device that writes them.

    It begins otherwise, and has another number of fields than the rows, or no number.
    """
    return not starts_as_row(texts) and (len(texts) != width or not any(map(is_number, texts)))


def starts_as_row(texts: Sequence[str]) -> bool:
    """Whether the first field of a line is a number, a missing value or a time."""
    return is_value(texts[0] if texts else "")


def find_layout(
    file: str,
    lines: Sequence[str],
    header: int | None,
    named: Sequence[str],
    decimal: str = "",
    asked: Collection[str] = (),
    clock: str = "",
) -> Layout:
    """Find the layout of the table, and the decimal separator.

    Args:
        header: line of the header counted from 1, 0 for a file without one; None if not stated.
        named: names of the columns of a file without a header, in their order; empty if not stated.
        asked: columns that a description names; of two possible headers, the one with more of them is taken.
        clock: the column that a description names as the time.
    """
    form = find_form(lines, header, named)
    made = lines if form is None else form.plain_lines(lines)
    if form is not None and form.names:
        found = Layout(form.names, form.index + 1, form.index, "\t")
    else:
        found = _with_own_times(_table(file, made, header, named, asked), clock)
    if form is not None and form.units and not found.units:
        stated = tuple((found.names[k], unit) for k, unit in form.units if k < len(found.names))
        words = f"the unit behind each number ({listing([unit for _, unit in stated])})"
        found = replace(found, units=stated, notes=(*found.notes, words))
    notes = [*found.notes, *(() if form is None else form.notes)]
    sign = decimal or decimal_sign(made[found.first :], found.delimiter)
    if sign == ",":
        notes.append("the numbers are read with decimal commas" + (", as described" if decimal else ""))
    started = []
    first = next((made[found.first + i] for i in significant(made[found.first :])), "")
    for k, (name, text) in enumerate(zip(found.names, filled_fields(first, found.delimiter), strict=False)):
        if at := stamp(text):
            started.append((k, at))
            what = "time of day" if restart_period(text) else "date and time of day"
            notes.append(f"column `{brief(name)}` is {what}: read as seconds from the first row")
    between = slice(found.line - 1, found.first)
    return replace(
        found,
        notes=tuple(notes),
        decimal=sign,
        decimal_stated=bool(decimal),
        head=frozenset(line for line in (*lines[between], *made[between]) if line.strip()) | {END},
        started=tuple((k, min(at for _, at in started) if found.times else at) for k, at in started),
        form=form,
    )


@dataclass(frozen=True)
class _Rows:
    """The first rows of numbers.

    Attributes:
        index: of the first of them.
        width: number of fields up to the last one that is not empty.
        most: number of fields, empty ones at the end included.
        numbered: whether the first field is a row number.
    """

    index: int
    delimiter: str
    width: int
    most: int
    numbered: bool = False


def _table(file: str, lines: Sequence[str], header: int | None, named: Sequence[str], asked: Collection[str]) -> Layout:
    """The layout of the table in plain lines; see ``find_layout``."""
    start = next(iter(significant(lines)), None)
    if start is None and header is None:
        raise BadInput(Place(file), "comments and no header", EXPECTED, code="LOG001")
    if header:
        return _at_line(file, lines, header)
    plain = None if start is None or header == 0 else _first_line(file, lines, start)
    rows = _find_rows(lines)
    if plain is not None and _is_table(lines, plain) and (rows is None or rows.width <= len(plain.names)):
        return plain
    if rows is None and (single := _one_column(lines)) is not None:
        named_above = plain is not None and len(plain.names) == 1 and plain.first == single.index
        return plain if plain is not None and named_above else _without_header(file, lines, single, named)
    if rows is None:
        if plain is not None and (len(plain.names) > 1 or _NAME.fullmatch(plain.names[0])):
            return plain
        yaml = file.lower().endswith((".yaml", ".yml"))
        hint = "; is this the spec? A command takes the spec first, then the log" if yaml else ""
        if plain is not None:
            found = f"one column `{brief(plain.names[0])}`"
            expected = f"names separated by comma, semicolon or tab{hint}"
            raise BadInput(Place(file, plain.line), found, expected, code="LOG001")
        found = f"no rows of numbers in its first {LINES_SEARCHED} lines"
        raise BadInput(Place(file), found, f"{EXPECTED}{hint}", code="LOG001")
    if header is None:
        head = _Head(file, lines, rows)
        if (layout := head.scope() or head.above(asked)) is not None:
            return layout
        if plain is not None and rows.index > plain.line - 1 and len(plain.names) > 1:
            return plain  # a header of another length: the row says so
    return _without_header(file, lines, rows, named)


def _first_line(file: str, lines: Sequence[str], index: int) -> Layout | None:
    """The layout with the first line, or a comment above it, as the header; None if neither has names."""
    line = lines[index]
    delimiter = delimiter_of(line)
    texts = filled_fields(line, delimiter) or fields(line, delimiter, Place(file, index + 1))
    first = next((index + 1 + i for i in significant(lines[index + 1 :])), index + 1)
    head = _Head(file, lines, _Rows(first, delimiter, len(texts), len(texts)))
    behind = filled_fields(lines[first], delimiter) if first < len(lines) else []
    if not (all(map(is_number, texts)) or _has_same_columns(texts, behind)):
        return head.layout(index, _named(texts))
    comment = next((i for i in range(index - 1, -1, -1) if COMMENT.match(lines[i])), None)
    if comment is not None and (names := head.names.get(comment)):
        return replace(head.layout(comment, _named(names)), first=index)
    return None


def _is_table(lines: Sequence[str], layout: Layout) -> bool:
    """Whether the two lines after a header each have a number and as many fields; true if there are none."""
    below = lines[layout.first :]
    rows = [filled_fields(below[i], layout.delimiter) for i in islice(significant(below), 2)]
    width = len(layout.names)
    return not rows or (width > 1 and all(len(texts) == width and any(map(is_number, texts)) for texts in rows))


def _find_rows(lines: Sequence[str]) -> _Rows | None:
    """The first rows of numbers, times and missing values only; else of numbers and texts in the same columns."""
    places = list(islice(significant(lines), LINES_SEARCHED))
    for texts_too, delimiter in product((False, True), (*SEPARATORS, "")):
        alike: list[int] = []
        last: list[str] = []
        for i in places:
            texts = filled_fields(lines[i], delimiter)
            row = sum(map(is_number, texts)) > 1
            if not texts_too:
                row = any(map(is_number, texts)) and all(is_value(t) or t.strip().lower() in WORDS for t in texts)
            if len(texts) < 2 or not row:
                alike = []
                continue
            again = _has_same_columns(texts, last) if texts_too else len(texts) == len(last)
            alike = [*alike, i] if alike and again else [i]
            last = texts
            if len(alike) == ROWS_ALIKE or (len(alike) == 2 and i == places[-1]):
                above = [filled_fields(lines[k], delimiter) for k in places[: places.index(alike[0])]]
                most = max(len(last), len(all_fields(lines[i], delimiter)))
                while above and len(above[-1]) <= most and _has_same_columns(above[-1][: len(last)], last):
                    above.pop()  # rows with a text, as oscilloscopes write first, or with a remark
                begun = [t for k in places[len(above) :][:2] for t in filled_fields(lines[k], delimiter)[:1]]
                return _Rows(places[len(above)], delimiter, len(last), most, begun in (["1", "2"], ["0", "1"]))
    return None


def _one_column(lines: Sequence[str]) -> _Rows | None:
    """The rows of a file with a number in each line, perhaps below a name; None for another file."""
    places = list(islice(significant(lines), LINES_SEARCHED))
    first = next((k for k, i in enumerate(places) if is_number(lines[i])), len(places))
    numbers = places[first:]
    alike = first < 2 and len(numbers) >= ROWS_ALIKE and all(is_number(lines[i]) for i in numbers)
    return _Rows(numbers[0], ",", 1, 1) if alike else None


def _has_same_columns(texts: Sequence[str], row: Sequence[str]) -> bool:
    """Whether a line has numbers, or missing values, in the fields in which a row has numbers, and as many fields."""
    pairs = [t for t, r in zip(texts, row, strict=False) if is_number(r)]
    missing = all(is_number(t) or is_missing(t) for t in pairs)
    return len(texts) == len(row) and any(map(is_number, pairs)) and missing


class _Head:
    """The lines above the first rows, in which the names and units of the columns are sought.

    Attributes:
        names: line → its texts, if they can be the names of the columns, else [].
        end: index of the first of the lines of properties directly above the rows, or of the rows.
    """

    def __init__(self, file: str, lines: Sequence[str], rows: _Rows) -> None:
        self.file, self.lines, self.rows = file, lines, rows
        self.end = rows.index
        while self.end > 0 and _property(all_fields(lines[self.end - 1], rows.delimiter), rows.width):
            self.end -= 1
        above = range(max(0, self.end - LINES_SEARCHED), self.end)
        self.names = {i: self._names_of(lines[i]) for i in above if lines[i].strip()}

    def _names_of(self, line: str) -> list[str]:
        """The fields of a line if it can be the header: as many as the rows have, with at least one text and no number.

        In a comment, names may have another separator than the rows; among blanks, units in brackets belong to them.
        """
        delimiter, comment = self.rows.delimiter, COMMENT.match(line)
        if comment and not re.search(r"\w", line):
            return []  # a rule such as |---|---|
        text = line.strip(" " if delimiter == "\t" else None).lstrip(COMMENT_MARKS)  # a first name may be empty
        count = len(all_fields(text, delimiter))
        others = [mark for mark in SEPARATORS if mark != delimiter] if comment else []
        ways = [filled_fields(text, delimiter)] if delimiter else []
        ways += [filled_fields(text.strip(), mark) for mark in others]
        if others or not delimiter:
            ways += [filled_fields(text, ""), _NAME.findall(text)]
        return next((names for texts in ways if (names := self._as_names(texts, count))), [])

    def _as_names(self, texts: list[str], count: int) -> list[str]:
        """The texts if they can be names of the columns; else [].

        Row numbers may have no name, as in tables of R; a comment may have an additional name, as in LabVIEW's files.
        ``count``: number of fields, empty ones at the end included: a few of the last columns may have no name.
        """
        rows = self.rows
        if rows.numbered and len(texts) == rows.width - 1 and count < rows.width:
            texts = ["", *texts]
        unnamed = min(count, rows.width) - len(texts)
        texts = [*texts, *[""] * unnamed] if unnamed < len(texts) else texts
        if len(texts) == rows.width + 1 and texts[-1].strip().lower() == "comment":
            texts.pop()
        named = texts[: rows.width]  # behind them an oscilloscope writes its settings
        if not rows.width <= len(texts) <= rows.most or any(map(is_number, named)) or not any(t.strip() for t in named):
            return []
        return texts

    def above(self, asked: Collection[str]) -> Layout | None:
        """The layout with the header above the rows or a line of units; None if no line names each column.

        One word of a line of units may be no known unit, such as the `Inkr` of a drive's increments. A line farther
        above is the header if it has more of the names that are asked for, as with properties of the columns below it.
        """
        names, lines, width = self.names, self.lines, self.rows.width
        sought = {i: sum(name.strip() in asked for name in texts) for i, texts in names.items()}
        near = [i for i, texts in names.items() if texts or not COMMENT.match(lines[i])]
        near = near[-2:]
        best = max(sought, key=lambda i: (sought[i], i), default=self.end)
        if sought.get(best, 0) > max((sought[i] for i in near), default=0):
            return _at_line(self.file, lines, best + 1)
        if not near or not names[near[-1]]:
            return None
        at, upper = near[-1], near[0]  # the same if there is no other
        texts, words = names[at], ""
        if not names[upper] and _are_units(texts):
            first, *numbers = filled_fields(lines[upper], self.rows.delimiter)
            if len(numbers) == width - 1 and not is_number(first) and all(map(is_number, numbers)):
                at, texts = upper, [first, *[""] * (width - 1)]
                words = f"line {at + 1} numbers the columns after the first; they go by their place in a row, from 2"
        elif upper != at and names[upper]:
            lower, more = texts[:width], sought[upper] - sought[at]
            if _are_units(lower) or more > 0 or (more == 0 and _are_units(lower, but=1)):
                at, texts = upper, names[upper]
            elif more == 0 and not COMMENT.match(lines[upper]) and {*lower} & {*names[upper]} - {""}:
                also = f"line {upper + 1} (`{brief(lines[upper])}`)"
                found = f"two lines that may be the header, this one and {also}"
                expected = f"`header: {at + 1}` or `header: {upper + 1}` in meta.yaml beside the log"
                raise BadInput(Place(self.file, at + 1), found, expected, code="LOG001")
        why = f"line {at + 1} is the header, by which it is column {{1}}"
        why += "; `header: {0}` in meta.yaml beside the log takes line {0}"
        others = [i for i in names if i < at and not _are_units(names[i])]
        unread = {name: why.format(i + 1, k) for i in others for k, name in enumerate(_named(names[i]), 1)}
        layout = self.layout(at, _named(texts))
        return replace(layout, unread=tuple(unread.items()), notes=(*layout.notes, *([words] if words else [])))

    def scope(self) -> Layout | None:
        """The layout of a scope's export: lines ``KEY;value;value;KEY;value`` with a KEY in each column of time."""
        rows, about = self.rows, dict[str, tuple[int, list[str]]]()
        for i, line in enumerate(self.lines[: rows.index]):
            texts = [text.strip() for text in filled_fields(line, rows.delimiter)]
            if texts and len(texts) <= rows.width:
                about[texts[0].lower()] = i, texts + [""] * (rows.width - len(texts))
        key = next((key for key in _SCOPE_NAMES if key in about), "")
        if not key:
            return None
        at, texts = about[key]
        above, under = (about.get(name, (at, []))[0] for name in (_TWINCAT_ABOVE, _TWINCAT_UNDER))
        twincat, times = above < at or at < under, [k for k, text in enumerate(texts) if text == texts[0]]
        if not twincat and len(times) < 2:
            return None
        names = tuple("Time" if k == 0 else str(k + 1) if k in times else name for k, name in enumerate(texts))
        layout = self.layout(at, _named(names))
        below = self.lines[rows.index :]
        split = (filled_fields(below[i], rows.delimiter) for i in significant(below))
        own = any(len({row[k] for k in times}) > 1 for row in islice(split, LINES_SEARCHED) if len(row) == rows.width)
        first = filled_fields(below[0], rows.delimiter)[0].strip()
        in_ms = twincat and len(first.split(",")[0].split(".")[0]) < 15
        units = [(name, unit) for name, unit in layout.units if name != "Time"]
        words = f"the file is a scope's export{', its times in ms' if in_ms else ''}"
        return replace(
            layout,
            units=(*([("Time", "ms")] if in_ms and not own else []), *units),
            notes=(words, *layout.notes),
            times=_times_before(times, rows.width) if own else (),
            tick=(1e-3 if in_ms else 1e-7) if twincat else 1.0,
        )

    def layout(self, at: int, names: tuple[str, ...]) -> Layout:
        """The layout with these names from the line ``at``, and notes on lines that are not read and on units."""
        lines, first, words = self.lines, self.rows.index, []
        if any(line.strip() for line in lines[:at] if COMMENT.match(lines[at]) or not COMMENT.match(line)):
            before = "1 line" if at == 1 else f"{at} lines"
            words.append(f"the header is line {at + 1} ({listing(names)}), {before} before it")
        units, whence = self.units(at, names)
        if sum(map(is_row, lines[at + 1 : first])) > 1:
            but = ", but for units" if units else ""
            words.append(f"lines {at + 2} to {first} between the header and the rows are not read{but}")
        if units:
            words.append(f"{whence} ({listing([unit for _, unit in units])})")
        return Layout(names, at + 1, first, self.rows.delimiter, units, tuple(words))

    def units(self, at: int, names: Sequence[str]) -> tuple[tuple[tuple[str, str], ...], str]:
        """(name, unit) of the columns, and where they are stated; a name that comes twice is the column's number.

        The header is the line ``at``. The units are in the first of these: properties above the rows; a comment such as
        ``# units: s, mm, N``; a line with the label ``Unit`` and the units in their places; a line between header and
        rows that is the only one, or of units alone.
        """
        delimiter, below = self.rows.delimiter, "a line of units under the header"
        names = [name if names.count(name) == 1 else str(k + 1) for k, name in enumerate(names)]
        for line in self.lines[self.end : self.rows.index]:
            if (found := _property(all_fields(line, delimiter), len(names))) and found[0] in UNIT_KEYS:
                return _units_of(names, found[1]), below
        for i, line in enumerate(self.lines[: self.rows.index]):
            if stated := _UNIT_COMMENT.fullmatch(line):
                for mark in (*SEPARATORS, ""):
                    texts = filled_fields(stated[1], mark)
                    if len(texts) == len(names) and _are_units(texts):
                        return _units_of(names, texts), "the units of a comment"
            label, *texts = filled_fields(line, delimiter) or [""]
            under = i > at and len(texts) == len(names) - 1  # it may hold other words
            if _UNIT_LABEL.fullmatch(label.strip()) and len(texts) <= len(names) and (under or _are_units(texts)):
                first = 0 if len(texts) == len(names) else 1  # the label stands beside all, or for the time
                return _units_of(names[first:], texts), f"the units of the line `{brief(label)}`"
        between = [i for i in self.names if at < i]
        for i in between:
            texts = self.names[i][: self.rows.width]
            if texts and (len(between) == 1 or _are_units(texts)):
                return _units_of(names, texts), below
        return (), ""


def _units_of(names: Sequence[str], texts: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """(name, unit) of the columns for which a text is given."""
    return tuple((name, unit) for name, text in zip(names, texts, strict=False) if (unit := _plain_unit(text)))


def _property(texts: Sequence[str], width: int) -> tuple[str, list[str]] | None:
    """The key in lower case of a line ``,Unit: mm,Unit: N``, and its values; None for another line."""
    found = [_PROPERTY.fullmatch(text.strip()) for text in texts]
    keys = {pair[1].lower() for pair in found if pair}
    others = any(text.strip() and not pair for text, pair in zip(texts, found, strict=True))
    if len(texts) != width or len(keys) != 1 or others:
        return None
    return keys.pop(), [pair[2] if pair else "" for pair in found]


def _are_units(texts: Sequence[str], but: int = 0) -> bool:
    """Whether all texts but ``but`` are units, in brackets or not; empty ones do not count."""
    given = [_plain_unit(t) for t in texts if t.strip()]
    units = sum(text in ("-", "%", "1", "") or (len(text) <= LONGEST_UNIT and is_unit(text)) for text in given)
    return units >= max(1, 2 * but, len(given) - but)


def _plain_unit(text: str) -> str:
    """A unit without brackets around it or a remark after it, as in ``deg (Angle)``; ``Sec`` becomes ``sec``.

    Empty for the label of a line of units, and for ``none``.
    """
    unit = in_usual_case(re.sub(r"(?<=\S)\s+\([A-Za-z ]+\)$", "", text.strip()).strip("[](){}").strip())
    return "" if _UNIT_LABEL.fullmatch(unit) or unit.lower() == "none" else unit


def _at_line(file: str, lines: Sequence[str], header: int) -> Layout:
    """The layout with the header on the line that a description states."""
    count = len(lines) - (not lines[-1])
    if header > count or not lines[header - 1].strip():
        found = "a blank line" if header <= count else f"{count} lines"
        expected = f"the header on line {header}, as described"
        raise BadInput(Place(file, min(header, count)), found, expected, code="LOG013")
    rows = _find_rows(lines[header:])
    line = lines[header - 1].strip().lstrip(COMMENT_MARKS)
    delimiter = rows.delimiter if rows else delimiter_of(line)
    names = _named(filled_fields(line, delimiter))
    first = header + (rows.index if rows else 0)
    between = [all_fields(lines[header + i], delimiter) for i in significant(lines[header:first])]
    if any(is_number(texts[0]) or stamp(texts[0]) for texts in between if texts):
        first = header  # a row that is damaged
    return _Head(file, lines, _Rows(first, delimiter, len(names), len(names))).layout(header - 1, names)


def _with_own_times(found: Layout, clock: str) -> Layout:
    """The layout of ``time,x,time,w``: the times of columns logged at another rate stand before them.

    The name that comes again is a usual one of a time, or ``clock``.
    """
    times = [k for k, name in enumerate(found.names) if name == found.names[0]]
    if found.times or len(times) < 2 or not (time_columns(found.names[:1]) or found.names[0] == clock):
        return found
    names = tuple(str(k + 1) if k in times[1:] else name for k, name in enumerate(found.names))
    units = tuple((names[0] if name == "1" else name, unit) for name, unit in found.units)  # no longer a repeated name
    words = f"{len(times)} columns `{brief(names[0])}`: each has the times of the columns after it"
    notes = (*found.notes, words)
    before = _times_before(times, len(names))
    return replace(found, names=names, units=units, times=before, tick=None, notes=notes)


def _times_before(times: Sequence[int], width: int) -> tuple[int, ...]:
    """Of each column the last column of times up to it."""
    return tuple(max(j for j in times if j <= k) for k in range(width))


def _without_header(file: str, lines: Sequence[str], rows: _Rows, named: Sequence[str]) -> Layout:
    """The layout of a file without a header; the last columns may be empty in the first rows and filled later."""
    split = (all_fields(lines[i + rows.index], rows.delimiter) for i in significant(lines[rows.index :]))
    filled = (k + 1 for texts in split if len(texts) == rows.most for k, text in enumerate(texts) if text.strip())
    width = rows.width if rows.most == rows.width else max(filled, default=rows.width)
    if named and len(named) not in (rows.width, width):
        found = f"{width} columns without a header line"
        expected = f"{len(named)}, one for each of {listing(named)}"
        raise BadInput(Place(file, rows.index + 1), found, expected, code="LOG013")
    names = tuple(named) or tuple(str(k + 1) for k in range(width))
    words = "its columns go by their numbers, counted from 1"
    if named:
        words = f"its columns are {listing(names)} as described"
    return Layout(names, rows.index + 1, rows.index, rows.delimiter, (), (f"the file has no header line: {words}",))


def _named(texts: Iterable[str]) -> tuple[str, ...]:
    """The names of columns: a text, or the column's number from 1."""
    return tuple(text.strip() or str(k + 1) for k, text in enumerate(texts))
