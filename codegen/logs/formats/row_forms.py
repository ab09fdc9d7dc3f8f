"""Special forms of text tables: a name before each number, lists in a field, or a line for each signal.

Each form is converted to plain rows before the table is read.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from string import ascii_letters

ROWS = 3
MOST_SIGNALS, FEWEST_VALUES = 64, 200
"""Most lines of a transposed table, and least number of values in each."""
LINES_SEARCHED = 1000
_NUMBER = (
    r"[+-]?(?:\d++,\d++(?=\s|$)|\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?(?=[\s,;})\]]|$)"
    r"|[+-]?(?:nan|inf)(?=[\s,;})\]]|$)"
)
_NAME = r"[A-Za-z_][\w.\-/]*(?:\[\d+\])?"
_NAMED = re.compile(rf"\s*({_NAME})(?:\s*[:=]\s*|\s+)({_NUMBER})[\s,;]*", re.ASCII | re.IGNORECASE)
"""``name:0.1``, ``name = 0.1`` or ``name 0,1``, with the separator after it."""
_PAIR = re.compile(rf"""(?<![\w.\-/])({_NAME})["']?\s*[:=]\s*({_NUMBER})""", re.ASCII | re.IGNORECASE)
"""``name: 0.1`` within other text."""
_BEGUN = re.compile(r"\W*(?:[A-Z]+\W+)?(\d{4}-\d\d-\d\d[T ][\d:.,]+|\d\d?:\d\d:\d\d[\d.,]*|\d{9,}\.\d+)\W+", re.ASCII)
"""Beginning of a logger's line: a level, and a time."""
_ARROW = re.compile(r"(\d\d?:\d\d:\d\d[.,]\d+) -> ")
"""Beginning of a line of a serial monitor."""
STAMP = "stamp"
"""The column of the times with which lines begin."""
_LIST = re.compile(r'"?[\[(]([^][()"]*)[\])]"?')
"""``[0.1, 0.2]``, ``(0.1, 0.2)`` or ``[0.1 0.2]``, in quotes or not."""
_SEPARATED = re.compile(r"\s*[,;\s]\s*")
_ELEMENT = re.compile(r"[+-]?(\d|\.\d|nan|inf)", re.IGNORECASE)


@dataclass(frozen=True)
class NamedRows:
    """Rows such as ``angle:0.1,torque:0.2``.

    Attributes:
        names: of the numbers, in their order.
        index: of the first row among the lines.
    """

    names: tuple[str, ...]
    index: int

    def plain(self, line: str) -> str:
        """The numbers of a row with tabs between them; empty for a line that is no such row."""
        pairs = _pairs(line)
        return "\t".join(n.replace(",", ".") for _, n in pairs) if self.names == tuple(a for a, _ in pairs) else ""


def named_rows(lines: Sequence[str]) -> NamedRows | None:
    """The first rows in which at least two numbers have names; None if the first lines have none."""
    alike, names = 0, tuple[str, ...]()
    for i, line in enumerate(islice(lines, LINES_SEARCHED)):
        found = tuple(name for name, _ in _pairs(line))
        if not line.strip():
            continue
        alike = alike + 1 if len(found) > 1 and found == names else int(len(found) > 1)
        names = found
        if alike == ROWS:
            first = next(k for k in range(i + 1) if tuple(name for name, _ in _pairs(lines[k])) == names)
            return NamedRows(names, first)
    return None


def _pairs(line: str) -> list[tuple[str, str]]:
    """(name, number) pairs of a line, with the time at its beginning; empty if it has other numbers."""
    pairs, at = [], 0
    while at < len(line):
        found = _NAMED.match(line, at)
        if found is None:
            break
        pairs.append((found[1], found[2]))
        at = found.end()
    if at == len(line):
        return pairs
    begun = _BEGUN.match(line)
    rest = line[begun.end() :] if begun else line
    pairs = [(name, number) for name, number in _PAIR.findall(rest)]
    if not pairs or re.search(r"(?<![\w.])[+-]?\d", _PAIR.sub("", rest)):
        return []
    return [(STAMP, begun[1]), *pairs] if begun else pairs


def after_arrows(lines: Sequence[str], delimiter_of: Callable[[str], str]) -> Callable[[str], str] | None:
    """The conversion of lines such as ``12:00:00.002 -> 0.1,0.2`` to plain fields; None for other lines."""
    first = list(islice((line for line in lines if line.strip()), ROWS))
    if len(first) < ROWS or not all(map(_ARROW.match, first)):
        return None
    rest = _ARROW.sub("", first[-1])
    delimiter = delimiter_of(rest)
    put = rf"\1{delimiter if delimiter in rest else ' '}"
    return lambda line: _ARROW.sub(put, line)


def whole_lines(lines: list[str]) -> list[str]:
    """The lines, with a quoted name that spans several lines joined in the last of them."""
    made, held = lines, ""
    for i, line in enumerate(islice(lines, LINES_SEARCHED)):
        if not held and (line.count('"') % 2 == 0 or not line.lstrip().startswith(('"', *ascii_letters))):
            continue
        made = made if made is not lines else list(lines)
        held = f"{held} {line}" if held else line
        whole = held.count('"') % 2 == 0
        made[i] = held if whole else ""
        held = "" if whole else held
    return lines if held else made


@dataclass(frozen=True)
class ListRows:
    """Rows with lists of numbers in some fields.

    Attributes:
        header: index of the line with the names, and that line with a name for each element, ``q[0]``, ``q[1]``; None
            if no line has a name for each field.
        delimiter: between the fields.
    """

    header: tuple[int, str] | None
    delimiter: str

    def plain(self, line: str) -> str:
        """A row with its elements as fields."""
        return _LIST.sub(lambda found: (self.delimiter or " ").join(_elements(found[1])), line)


def list_rows(lines: Sequence[str], delimiter_of: Callable[[str], str]) -> ListRows | None:
    """The first rows with lists of numbers in some fields; None if the first lines have none."""
    places = [i for i, line in enumerate(islice(lines, LINES_SEARCHED)) if line.strip()]
    run: list[int] = []
    for i in places:
        held = [len(_elements(found[1])) for found in _LIST.finditer(lines[i]) if _ELEMENT.match(found[1].lstrip())]
        run = [*run, i] if any(n > 1 for n in held) else []
        if len(run) == ROWS:
            break
    if len(run) < ROWS:
        return None
    row, above = lines[run[0]], [i for i in places if i < run[0]]
    masked = _LIST.sub("_", row)
    delimiter = delimiter_of(masked)
    rows = ListRows(None, delimiter)
    if not above:
        return rows
    names = _fields(lines[above[-1]].strip().lstrip("#%/"), delimiter)
    lengths = [len(_elements(found[1])) for found in _LIST.finditer(row)]
    fields = _fields(masked, delimiter)
    if len(names) != len(fields):
        return rows
    of = iter(lengths)
    given = [
        [name] if field != "_" else [f"{name}[{k}]" for k in range(next(of))]
        for name, field in zip(names, fields, strict=True)
    ]
    return ListRows((above[-1], (delimiter or " ").join(name for part in given for name in part)), delimiter)


def transposed_rows(lines: Sequence[str]) -> list[str] | None:
    """The rows of a transposed table, which has a line for each signal; names are before the numbers or in a comment.

    Returns:
        A header, if there are names, and the rows, with tabs between fields; None if the table is not transposed.
    """
    rows = list(islice((line for line in lines if line.strip()), 2 * MOST_SIGNALS))
    comments = [line.strip().lstrip("#%/") for line in rows if line.lstrip().startswith(("#", "%", "//"))]
    rows = [line.strip() for line in rows if not line.lstrip().startswith(("#", "%", "//"))]
    if not 1 < len(rows) <= MOST_SIGNALS:
        return None
    delimiter = next((mark for mark in ";\t|," if mark in rows[0]), "")
    signals = [_fields(line.strip(delimiter or None), delimiter) for line in rows]
    width = len(signals[0])
    if width < FEWEST_VALUES or any(len(texts) != width or not _ELEMENT.match(texts[-1]) for texts in signals):
        return None
    given = [texts.pop(0) for texts in signals if not _ELEMENT.match(texts[0])]
    in_comments = [names for comment in comments if len(names := _fields(comment, delimiter)) == len(signals)]
    names = given if len(given) == len(signals) else next(iter(in_comments), [])
    return ["\t".join(row) for row in ([names] if names else []) + list(map(list, zip(*signals, strict=True)))]


def _fields(line: str, delimiter: str) -> list[str]:
    return [text.strip().strip('"') for text in (line.split(delimiter) if delimiter else line.split())]


def _elements(text: str) -> list[str]:
    return [part.strip("'") for part in _SEPARATED.split(text.strip()) if part]
