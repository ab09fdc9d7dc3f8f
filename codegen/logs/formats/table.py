"""Layout of the table in a text file: separator, header line, line of units and first row.

The first rows are found first: lines of numbers with equally many fields. The header is the line above them, or above a
line of units. Lines before the header are ignored.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import islice, product

from codegen.base.errors import BadInput, Place
from codegen.base.user_text import shown
from codegen.logs.binding import time_columns
from codegen.logs.formats.row_forms import Form, find_form
from codegen.logs.formats.source import listing
from codegen.logs.formats.stamps import restart_period, stamp
from codegen.logs.formats.text_lines import EXPECTED
from codegen.spec.column_units import LONGEST_UNIT, in_usual_case
from codegen.spec.units import is_unit

LINES_SEARCHED = 1000
"""Lines at the start of a file among which the first rows of numbers must stand."""
ROWS_ALIKE = 3
LONGEST_PREAMBLE = 20
"""Most lines of a preamble that may look like a table of names and values."""
SEPARATORS = (",", ";", "\t", "|")
COMMENT = re.compile(
    r"\s*+(#(?!(n/a|nan|nv|value!|wert!|div/0!))|%|//|(?=[^|+]*[|+])(?=.*---)[\s|+:=-]++$)", re.IGNORECASE
)
"""Beginning of a comment, but not of a row whose first value is missing; or a rule such as ``|---|---|``."""
END = "EOF"
"""A line that ends a table."""
MINUS = "\N{MINUS SIGN}"
_NO_VALUE = (
    "na n/a n.a. nan nat null (null) nil none missing undef undefined invalid bad <na> - -- --- . ? \\n "
    "#n/a #nan #nv #value! #wert! #div/0!"
)
_NOT_FINITE = "nan(ind) 1.#ind 1.#qnan 1.#inf 1.#j ∞"
MISSING = {"", *_NO_VALUE.split(), *(f"{sign}{word}" for sign in ("", "-") for word in _NOT_FINITE.split())}
NUMBER = re.compile(
    r"[+-]?(\d++\.?\d*+([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|inf|infinity|nan)\Z", re.ASCII | re.IGNORECASE
)
HEX = re.compile(r"0[xX][0-9a-fA-F]{1,16}\Z", re.ASCII)
WORDS = {"true": 1.0, "false": 0.0}
_DIGITS = re.compile(r"[+-]?(\d+|[.,]\d+)([.,]\d+)*(e[+-]?\d+)?\Z", re.ASCII | re.IGNORECASE)
"""A number with any separators of decimals and thousands."""
_DECIMAL_COMMA = r"(\d*,(\d{1,2}|\d{4,})|0?,\d{3}|\d{4,},\d{3}|\d+,\d+[eE][+-]?\d+)"
"""A number whose comma cannot separate thousands."""


@dataclass(frozen=True)
class Layout:
    """The layout of a table in a text file.

    Attributes:
        line: of the header, or of the first row if there is no header; counted from 1.
        first: index of the first line after header and units.
        units: name → its text in the line of units.
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


def is_row(line: str) -> bool:
    """Whether a plain line can be a row: not blank, and no comment."""
    return bool(line.strip()) and not COMMENT.match(line)


def starts_as_row(texts: Sequence[str]) -> bool:
    """Whether the first field of a line is a number, a missing value or a time."""
    first = texts[0].strip() if texts else ""
    return _is_number(first) or first.lower() in MISSING or stamp(first) is not None


def is_remark(texts: Sequence[str], width: int) -> bool:
    """Whether a line among rows that begin with a number is text, such as a message of the device that writes them.

    It begins otherwise, and has another number of fields than the rows, or no number.
    """
    return not starts_as_row(texts) and (len(texts) != width or not any(map(_is_number, texts)))


@dataclass(frozen=True)
class _Rows:
    """The first rows of numbers.

    Attributes:
        width: number of fields up to the last one that is not empty.
        most: number of fields, empty ones at the end included.
        numbered: whether the first field is a row number.
    """

    index: int
    delimiter: str
    width: int
    most: int
    numbered: bool = False


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

    Raises:
        BadInput: for no header and no numbers, two lines that may be the header, or a header that is not there.
    """
    form = find_form(lines, delimiter_of, header, named)
    made = lines if form is None else form.plain_lines(lines)
    if form is not None and form.names:
        found = Layout(form.names, form.index + 1, form.index, "\t")
    else:
        found = _with_own_times(_with_units_above(_table(file, made, header, named, asked), made), clock)
    if form is not None and form.units and not found.units:
        stated = tuple((found.names[k], unit) for k, unit in form.units if k < len(found.names))
        words = f"the unit behind each number ({listing([unit for _, unit in stated])})"
        found = replace(found, units=stated, notes=(*found.notes, words))
    sign = "." if found.decimal_stated else decimal or _decimal(made[found.first :], found.delimiter)
    notes = [*found.notes, *(() if form is None else form.notes)]
    if sign == ",":
        notes.append("the numbers are read with decimal commas" + (", as described" if decimal else ""))
    started = []
    first = next((made[found.first + i] for i in _significant(made[found.first :])), "")
    for k, text in enumerate(_split(first, found.delimiter)):
        at = stamp(text)
        if at is not None and k < len(found.names):
            started.append((k, at))
            what = "time of day" if restart_period(text) else "date and time of day"
            notes.append(f"column `{shown(found.names[k])}` is {what}: read as seconds from the first row")
    between = slice(found.line - 1, found.first)
    head = frozenset(line for line in (*lines[between], *made[between]) if line.strip()) | {END}
    return replace(
        found,
        notes=tuple(notes),
        decimal=sign,
        decimal_stated=bool(decimal) or found.decimal_stated,
        head=head,
        started=tuple((k, min(at for _, at in started) if found.times else at) for k, at in started),
        form=form,
    )


def _decimal(lines: Sequence[str], delimiter: str) -> str:
    """The decimal separator: a comma, a point, or empty if all commas may separate thousands.

    It is a comma if some comma cannot separate thousands. In a comma-separated file only quoted numbers count.
    """
    edge = re.escape(delimiter) if delimiter else r"\s"
    blanks = rf"[^\S{edge}]*+"  # but those that separate columns, such as tabs
    before, behind = rf'(?:^|[{edge}"]){blanks}[+-]?', rf'{blanks}(?=$|[{edge}"])'
    point = re.compile(rf"{before}\d*\.\d+{behind}", re.ASCII)
    sign = ","
    if delimiter == ",":
        before, behind, sign = r'"\s*[+-]?', r'\s*"', '"'
    clear = re.compile(f"{before}{_DECIMAL_COMMA}{behind}", re.ASCII)
    either = re.compile(rf"{before}\d{{1,3}},\d{{3}}{behind}", re.ASCII)
    found = "."
    for k, line in enumerate(lines):
        if sign in line:
            if clear.search(line):
                return "." if any(point.search(other) for other in lines[: k + 1] if "." in other) else ","
            found = "" if found and either.search(line) else found
    return found


def _or_a_spec(file: str, expected: str) -> str:
    """The expectation of the error for a file without a table, with a hint if it may be the spec."""
    yaml = file.lower().endswith((".yaml", ".yml"))
    return f"{expected}; is this the spec? A command takes the spec first, then the log" if yaml else expected


def _table(
    file: str, lines: Sequence[str], header: int | None, named: Sequence[str], asked: Collection[str] = ()
) -> Layout:
    """The layout of the table in plain lines; see ``find_layout``."""
    start = next(iter(_significant(lines)), None)
    if start is None and header is None:
        raise BadInput(Place(file), "comments and no header", EXPECTED, code="LOG001")
    if header:
        return _at_line(file, lines, header)
    plain = None if start is None or header == 0 else _first_line(file, lines, start)
    tabular = plain is not None and _is_table(lines, plain)
    if plain is not None and tabular and not _ends_early(lines, plain):
        return plain
    rows = _find_rows(lines)
    if plain is not None and tabular and (rows is None or rows.width <= len(plain.names)):
        return plain
    if rows is None:
        if plain is not None and len(plain.names) == 1 and len(plain.names[0].split()) > 1:
            found = f"one column `{shown(plain.names[0])}`"
            expected = _or_a_spec(file, "names separated by comma, semicolon or tab")
            raise BadInput(Place(file, plain.line), found, expected, code="LOG001")
        if plain is not None:
            return plain
        found = f"no rows of numbers in its first {LINES_SEARCHED} lines"
        raise BadInput(Place(file), found, _or_a_spec(file, EXPECTED), code="LOG001")
    scope = None if header == 0 else _scope(lines, rows)
    if scope is not None:
        return scope
    above = None if header == 0 else _above(file, lines, rows, asked)
    if above is not None:
        return above
    if plain is not None and rows.index > plain.line - 1 and len(plain.names) > 1:
        return plain  # a header of another length: the row says so
    return _without_header(file, lines, rows, named)


def fields(text: str, delimiter: str, place: Place) -> list[str]:
    """The fields of a line; raises BadInput if it cannot be split."""
    if not delimiter:
        return [part.strip('"') for part in text.split()]
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [""])
    except csv.Error as error:
        raise BadInput(place, f"a line that cannot be split ({error})", EXPECTED, code="LOG001") from None


def _significant(lines: Sequence[str]) -> Iterator[int]:
    """Indices of the lines that are neither blank nor a comment."""
    return (i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line))


def _is_number(text: str) -> bool:
    plain = text.strip().replace(MINUS, "-")
    return (NUMBER.match(plain) or HEX.match(plain) or _DIGITS.match(plain)) is not None


def _is_row(texts: Sequence[str]) -> bool:
    words = MISSING | WORDS.keys()
    known = (_is_number(t) or t.strip().lower() in words or stamp(t) is not None for t in texts)
    return any(map(_is_number, texts)) and all(known)


def _has_same_columns(texts: Sequence[str], row: Sequence[str]) -> bool:
    """Whether a line has numbers, or missing values, in the fields in which a row has numbers, and as many fields."""
    pairs = [t for t, r in zip(texts, row, strict=False) if _is_number(r)]
    missing = all(_is_number(t) or t.strip().lower() in MISSING for t in pairs)
    return len(texts) == len(row) and any(map(_is_number, pairs)) and missing


def _all_fields(line: str, delimiter: str) -> list[str]:
    """The fields of any line; empty if it cannot be split."""
    try:
        return fields(line, delimiter, Place(""))
    except BadInput:
        return []


def _split(line: str, delimiter: str) -> list[str]:
    """The fields of a line, without empty ones at its end."""
    found = _all_fields(line, delimiter)
    while len(found) > 1 and not found[-1].strip():
        found.pop()
    return found


def _named(texts: Sequence[str]) -> tuple[str, ...]:
    return tuple(text.strip() or str(k + 1) for k, text in enumerate(texts))


def _first_line(file: str, lines: Sequence[str], index: int) -> Layout | None:
    """The layout with the first line, or a comment above it, as the header; None if neither has names."""
    line, place = lines[index], Place(file, index + 1)
    delimiter = delimiter_of(line)
    texts = _split(line, delimiter) or fields(line, delimiter, place)
    behind = next((_split(lines[index + 1 + i], delimiter) for i in _significant(lines[index + 1 :])), [])
    if not (all(map(_is_number, texts)) or _has_same_columns(texts, behind)):
        return Layout(_named(texts), index + 1, index + 1, delimiter)
    comment = next((i for i in range(index - 1, -1, -1) if COMMENT.match(lines[i])), None)
    if comment is not None:
        names = fields(lines[comment].strip().lstrip("#%/"), delimiter, Place(file, comment + 1))
        if len(names) == len(texts) and not any(map(_is_number, names)):
            return Layout(_named(names), comment + 1, index, delimiter)
    return None


def delimiter_of(header: str) -> str:
    """The most frequent separator in the header; a comma if there is none."""
    return max(SEPARATORS, key=header.count)


def _is_table(lines: Sequence[str], layout: Layout) -> bool:
    """Whether the two lines after a header each have a number and as many fields; true if there are none."""
    for i in islice(_significant(lines[layout.first :]), 2):
        texts = _split(lines[layout.first + i], layout.delimiter)
        if len(layout.names) == 1 or len(texts) != len(layout.names) or not any(map(_is_number, texts)):
            return False
    return True


def _ends_early(lines: Sequence[str], layout: Layout) -> bool:
    """Whether the rows after a header are few, as pairs of names and values before another table are."""
    places = [layout.first + i for i in islice(_significant(lines[layout.first :]), LONGEST_PREAMBLE)]
    return any(len(_split(lines[i], layout.delimiter)) != len(layout.names) for i in places)


def _find_rows(lines: Sequence[str]) -> _Rows | None:
    """The first rows of numbers, times and missing values only; else of numbers and texts in the same columns."""
    places = list(islice(_significant(lines), LINES_SEARCHED))
    for texts_too, delimiter in product((False, True), (*SEPARATORS, "")):
        alike: list[int] = []
        last: list[str] = []
        for i in places:
            texts = _split(lines[i], delimiter)
            row = sum(map(_is_number, texts)) > 1 if texts_too else _is_row(texts)
            if len(texts) < 2 or not row:
                alike = []
                continue
            again = _has_same_columns(texts, last) if texts_too else len(texts) == len(last)
            alike = [*alike, i] if alike and again else [i]
            last = texts
            if len(alike) == ROWS_ALIKE or (len(alike) == 2 and i == places[-1]):
                above = [_split(lines[k], delimiter) for k in places[: places.index(alike[0])]]
                most = max(len(last), len(_all_fields(lines[i], delimiter)))
                while above and len(above[-1]) <= most and _has_same_columns(above[-1][: len(last)], last):
                    above.pop()  # rows with a text, as oscilloscopes write first, or with a remark
                begun = [t for k in places[len(above) :][:2] for t in _split(lines[k], delimiter)[:1]]
                return _Rows(places[len(above)], delimiter, len(last), most, begun in (["1", "2"], ["0", "1"]))
    return None


def _above(file: str, lines: Sequence[str], rows: _Rows, asked: Collection[str]) -> Layout | None:
    """The layout with the header above the first rows or a line of units; None if no line names each column.

    One word of a line of units may be no known unit, such as the `Inkr` of a drive's increments. Names in two lines of
    which both repeat some, as pandas writes a header of two levels, become ``joint1.pos``. A line farther above is the
    header if it has more of the names that are asked for, as in a recording with properties of its columns below them.
    """
    end, stated = _properties(lines, rows)
    split = {i: _names_of(line, rows) for i, line in enumerate(lines[:end]) if line.strip()}
    sought = {i: sum(name.strip() in asked for name in texts) for i, texts in split.items()}
    above = [i for i, texts in split.items() if texts or not COMMENT.match(lines[i])]
    index = _index_name(lines[above[-1]], rows) if above else ""
    above = above[-3:-1] if index else above[-2:]
    near = [i for i in reversed(above) if split[i]]
    best = max(sought, key=lambda i: (sought[i], i), default=end)
    if sought.get(best, 0) > max((sought[i] for i in above), default=0):
        return _at_line(file, lines, best + 1)
    if not near or near[0] != above[-1]:
        return None
    at = near[0]
    units = tuple(zip(_named(split[at]), stated, strict=False))
    numbered = _split(lines[above[0]], rows.delimiter) if len(near) < len(above) and _are_units(split[at]) else []
    if len(numbered) == rows.width and not _is_number(numbered[0]) and all(map(_is_number, numbered[1:])):
        names = _named([numbered[0], *[""] * (rows.width - 1)])
        units = tuple(zip(names, map(_plain_unit, split[at]), strict=False))
        words = f"line {above[0] + 1} numbers the columns after the first; they go by their place in a row, from 2"
        layout = _with_notes(lines, Layout(names, above[0] + 1, rows.index, rows.delimiter, units))
        return replace(layout, notes=(*layout.notes, words))
    if len(near) == 2:
        lower, upper = split[near[0]][: rows.width], split[near[1]]
        more = sought[near[1]] - sought[near[0]]
        if (index or len({*lower}) < len(lower)) and len({*upper}) < len(upper):
            pairs = zip(upper[: rows.width], lower, strict=True)
            split[at] = [index or lower[0], *(".".join(filter(None, pair)) for pair in islice(pairs, 1, None))]
        elif _are_units(lower) or more > 0 or (more == 0 and _are_units(lower, but=1)):
            plain = ["" if _UNIT_LABEL.fullmatch(text.strip()) else _plain_unit(text) for text in lower]
            at, units = near[1], tuple(zip(_named(upper), plain, strict=False))
        elif more == 0 and not COMMENT.match(lines[near[1]]) and {*lower} & {*upper} - {""}:
            found = f"two lines that may be the header, this one and line {near[1] + 1} (`{shown(lines[near[1]])}`)"
            expected = f"`header: {near[0] + 1}` or `header: {near[1] + 1}` in meta.yaml beside the log"
            raise BadInput(Place(file, near[0] + 1), found, expected, code="LOG001")
    why = f"line {at + 1} is the header; `header: {{0}}` in meta.yaml beside the log takes line {{0}}"
    others = [i for i in split if i < at and not _are_units(split[i])]
    unread = {name: why.format(i + 1) for i in others for name in _named(split[i])}
    names = _named(split[at])
    return _with_notes(lines, Layout(names, at + 1, rows.index, rows.delimiter, units, unread=tuple(unread.items())))


_PROPERTY = re.compile(r"([A-Za-z]+): ?(.*)")
"""A property of a column below its name, ``Unit: mm``, as Simulink's Data Inspector writes them."""


def _properties(lines: Sequence[str], rows: _Rows) -> tuple[int, list[str]]:
    """Index of the first of the lines of properties directly above the rows, or of the rows; and the units in them."""
    at, units = rows.index, list[str]()
    while at > 0 and (found := _property(_all_fields(lines[at - 1], rows.delimiter), rows.width)):
        units = found[1] if found[0] in _UNIT else units
        at -= 1
    return at, units


def _property(texts: Sequence[str], width: int) -> tuple[str, list[str]] | None:
    """The key in lower case of a line ``,Unit: mm,Unit: N``, and its values; None for another line."""
    found = [_PROPERTY.fullmatch(text.strip()) for text in texts]
    keys = {pair[1].lower() for pair in found if pair}
    if (
        len(texts) != width
        or len(keys) != 1
        or any(text.strip() and not pair for text, pair in zip(texts, found, strict=True))
    ):
        return None
    return keys.pop(), [_plain_unit(pair[2]) if pair else "" for pair in found]


def _index_name(line: str, rows: _Rows) -> str:
    """The one text of a line ``t,,,`` below the header, as pandas writes the name of its first column; else empty."""
    texts = _all_fields(line, rows.delimiter)
    return texts[0].strip() if len(texts) == rows.width > 2 and not any(t.strip() for t in texts[1:]) else ""


_SAMPLE_TIME = "sampletime[ms]"
_NAME = ("name", "channel name", "channel")


def _scope(lines: Sequence[str], rows: _Rows) -> Layout | None:
    """The layout of a scope's export: lines ``KEY;value;value;KEY;value`` with a KEY in each column of time.

    TwinCAT's has times in ms, or as Windows' FILETIME. In other exports the names must follow KEYs.
    """
    about: dict[str, tuple[int, list[str]]] = {}
    for i, line in enumerate(lines[: rows.index]):
        texts = [text.strip() for text in _split(line, rows.delimiter)]
        if texts and len(texts) <= rows.width:
            about[texts[0].lower()] = i, texts + [""] * (rows.width - len(texts))
    key = next((key for key in _NAME if key in about), "")
    if not key:
        return None
    at, names = about[key]
    times = [k for k, text in enumerate(names) if text == names[0]]
    if (_SAMPLE_TIME not in about and len(times) < 2) or at > about.get(_SAMPLE_TIME, (at,))[0]:
        return None
    own = False
    for i in islice(_significant(lines[rows.index :]), LINES_SEARCHED):
        texts = _split(lines[rows.index + i], rows.delimiter)
        own = own or (len(texts) == rows.width and len({texts[k] for k in times}) > 1)
    called = [str(k + 1) if k in times else name for k, name in enumerate(names)]
    called[0] = "Time"
    first = _split(lines[rows.index], rows.delimiter)[0].strip()
    in_ms = _SAMPLE_TIME in about and len(first.split(",")[0].split(".")[0]) < 15
    units = {"Time": "ms"} if in_ms and not own else {}
    given = about.get("unit", (0, [""] * rows.width))[1]
    bare = {name: _plain_unit(u) for k, (name, u) in enumerate(zip(called, given, strict=True)) if k not in times}
    units |= {name: unit for name, unit in bare.items() if unit.lower() not in ("", "none")}
    table = Layout(_named(called), at + 1, rows.index, rows.delimiter, tuple(units.items()))
    words = f"the file is a scope's export{', its times in ms' if in_ms else ''}"
    layout = _with_notes(lines, table)
    before = tuple(max(j for j in times if j <= k) for k in range(rows.width)) if own else ()
    tick = (1e-3 if in_ms else 1e-7) if _SAMPLE_TIME in about else 1.0
    return replace(layout, notes=(words, *layout.notes), times=before, tick=tick)


def _with_own_times(found: Layout, clock: str) -> Layout:
    """The layout of ``time,x,time,w``: the times of columns logged at another rate stand before them.

    The name that comes again is a usual one of a time, or ``clock``.
    """
    times = [k for k, name in enumerate(found.names) if name == found.names[0]]
    if found.times or len(times) < 2 or not (time_columns(found.names[:1]) or found.names[0] == clock):
        return found
    names = tuple(str(k + 1) if k in times[1:] else name for k, name in enumerate(found.names))
    before = tuple(max(j for j in times if j <= k) for k in range(len(names)))
    words = f"{len(times)} columns `{shown(names[0])}`: each has the times of the columns after it"
    return replace(found, names=names, times=before, tick=None, notes=(*found.notes, words))


_UNIT_LABEL = re.compile(r"(?:(?:y|v|vertical)[ _]?)?(?:units?|einheit(?:en)?)(?:[ _]?labels?)?:?", re.IGNORECASE)
"""The first field of a line of units before the rows: ``Y_Unit_Label`` of LabVIEW, ``VUnit`` of oscilloscopes."""


def _with_units_above(found: Layout, lines: Sequence[str]) -> Layout:
    """The layout with the units of a line above the rows, if there is no line of units below the header.

    It is a comment, ``# units: s, mm, N``, or a line with a label and the units in the places of their columns.
    """
    if found.units:
        return found
    start = next((found.first + i for i in _significant(lines[found.first :])), found.first)
    for line in lines[:start]:
        stated = re.fullmatch(r"\s*(?:#|%|//)\s*(?i:units?|einheit(?:en)?)\s*[:=]?\s*(.+)", line)
        if stated:
            for delimiter in (*SEPARATORS, ""):
                texts = _split(stated[1], delimiter)
                if len(texts) == len(found.names) and _are_units(texts):
                    units = tuple(zip(found.names, map(_plain_unit, texts), strict=True))
                    return replace(found, units=units, notes=(*found.notes, f"the units of a comment ({stated[1]})"))
        label, *texts = (found.delimiter and _split(line, found.delimiter)) or [""]
        if _UNIT_LABEL.fullmatch(label.strip()) and len(texts) <= len(found.names) and _are_units(texts):
            first = 0 if len(texts) == len(found.names) else 1  # the label stands beside all, or for the time
            pairs = zip(found.names[first:], map(_plain_unit, texts), strict=False)
            units = tuple((name, unit) for name, unit in pairs if unit)
            words = f"the units of the line `{shown(label)}` ({listing([unit for _, unit in units])})"
            return replace(found, units=units, notes=(*found.notes, words))
    return found


def _names_of(line: str, rows: _Rows) -> list[str]:
    """A line's fields if it can be the header: as many as the rows have, with at least one text and no number.

    Row numbers may have no name, as in tables of R; a comment may have an additional name, as in LabVIEW's files. In a
    comment, names may have another separator than the rows, with units in brackets or without.
    """
    text = line.strip(" " if rows.delimiter == "\t" else None).lstrip("#%/")  # a first name may be empty
    ways = [_split(text, rows.delimiter)]
    count = len(_all_fields(text, rows.delimiter))
    spaced = [_split(text, ""), re.findall(rf"\S+(?:\s+[\[(][^\])]{{0,{LONGEST_UNIT}}}[\])])?", text)]
    if COMMENT.match(line):
        others = [_split(text.strip(), other) for other in SEPARATORS if other != rows.delimiter]
        ways = [*(ways if rows.delimiter else []), *others, *spaced]
    elif not rows.delimiter:
        ways = spaced
    return next((names for names in (_as_names(texts, rows, count) for texts in ways) if names), [])


def _as_names(texts: list[str], rows: _Rows, count: int) -> list[str]:
    """The texts if they can be names of the columns; else [].

    Args:
        count: number of fields, empty ones at the end included: a few of the last columns may have no name.
    """
    if rows.numbered and len(texts) == rows.width - 1 and count < rows.width:
        texts = ["", *texts]
    unnamed = min(count, rows.width) - len(texts)
    texts = [*texts, *[""] * unnamed] if unnamed < len(texts) else texts
    if len(texts) == rows.width + 1 and texts[-1].strip().lower() == "comment":
        texts.pop()
    named = texts[: rows.width]  # behind them an oscilloscope writes its settings
    if not rows.width <= len(texts) <= rows.most or any(map(_is_number, named)) or not any(t.strip() for t in named):
        return []
    return texts


def _with_notes(lines: Sequence[str], layout: Layout) -> Layout:
    """The layout with notes on lines that are not read, and on units."""
    words = []
    if any(line.strip() for line in lines[: layout.line - 1]):
        before = "1 line" if layout.line == 2 else f"{layout.line - 1} lines"
        words.append(f"the header is line {layout.line} ({listing(layout.names)}), {before} before it")
    below = [i for i in range(layout.line, layout.first) if lines[i].strip()]
    if len(below) > 1:
        but = ", but for units" if layout.units else ""
        words.append(f"lines {layout.line + 1} to {layout.first} between the header and the rows are not read{but}")
    if layout.units:
        words.append(f"a line of units under the header ({listing([u or '-' for _, u in layout.units])})")
    return replace(layout, notes=tuple(words))


def _are_units(texts: Sequence[str], but: int = 0) -> bool:
    """Whether all texts but ``but`` are units, in brackets or not; empty ones do not count."""
    given = [_plain_unit(t) for t in texts if t.strip()]
    units = sum(text in ("-", "%", "1", "") or (len(text) <= LONGEST_UNIT and is_unit(text)) for text in given)
    return units >= max(1, 2 * but, len(given) - but)


def _plain_unit(text: str) -> str:
    """A unit without brackets around it or a remark after it, as in ``deg (Angle)``; ``Sec`` becomes ``sec``."""
    return in_usual_case(re.sub(r"(?<=\S)\s+\([A-Za-z ]+\)$", "", text.strip()).strip("[](){}").strip())


def _at_line(file: str, lines: Sequence[str], header: int) -> Layout:
    """The layout with the header on the line that a description states."""
    count = len(lines) - (not lines[-1])
    if header > count or not lines[header - 1].strip():
        found = "a blank line" if header <= count else f"{count} lines"
        expected = f"the header on line {header}, as described"
        raise BadInput(Place(file, min(header, count)), found, expected, code="LOG013")
    rows = _find_rows(lines[header:])
    line = lines[header - 1].strip().lstrip("#%/")
    delimiter = rows.delimiter if rows else delimiter_of(line)
    names = _named(_split(line, delimiter))
    first = header
    units: tuple[tuple[str, str], ...] = ()
    between = [header + i for i in _significant(lines[header : header + rows.index])] if rows else []
    texts = {i: _split(lines[i], delimiter) for i in between}
    if not any(_is_number(t[0]) or stamp(t[0]) for t in texts.values() if t):
        first = header + rows.index if rows else header
        for i, given in texts.items():
            stated = _property(_all_fields(lines[i], delimiter), len(names))
            if stated and stated[0] in _UNIT:
                units = tuple(zip(names, stated[1], strict=True))
            elif (
                len(given) == len(names)
                and not any(map(_is_number, given))
                and (len(texts) == 1 or _is_line_of_units(given))
            ):
                pairs = zip(names, map(_plain_unit, given), strict=True)
                units = tuple((name, unit) for name, unit in pairs if unit.lower() not in _UNIT)
    return _with_notes(lines, Layout(names, header, first, delimiter, units))


_UNIT = ("unit", "units", "einheit")


def _is_line_of_units(texts: Sequence[str]) -> bool:
    """Whether a line is ``Unit;mm;Unit;N``, or one of units alone."""
    return texts[0].strip().strip(":").lower() in _UNIT or _are_units(texts)


def _filled_width(lines: Sequence[str], rows: _Rows) -> int:
    """Number of columns of rows without a header: the last ones may be empty in the first rows and filled later."""
    if rows.most == rows.width:
        return rows.width
    split = (_all_fields(lines[i + rows.index], rows.delimiter) for i in _significant(lines[rows.index :]))
    filled = (k + 1 for texts in split if len(texts) == rows.most for k, text in enumerate(texts) if text.strip())
    return max(filled, default=rows.width)


def _without_header(file: str, lines: Sequence[str], rows: _Rows, named: Sequence[str]) -> Layout:
    """The layout of a file without a header."""
    place = Place(file, rows.index + 1)
    width = _filled_width(lines, rows)
    if named and len(named) not in (rows.width, width):
        found = f"{width} columns without a header line"
        raise BadInput(place, found, f"{len(named)}, one for each of {listing(named)}", code="LOG013")
    names = tuple(named) or tuple(str(k + 1) for k in range(width))
    words = "the file has no header line: its columns go by their numbers, counted from 1"
    if named:
        words = f"the file has no header line: its columns are {listing(names)} as described"
    return Layout(names, rows.index + 1, rows.index, rows.delimiter, (), (words,))
