"""Special forms of text tables, converted to plain rows before the table is read.

A name before each number, lists in a field, an arrow behind a time, a table in the first column of a spreadsheet, or a
line for each signal.
"""

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from string import ascii_letters

from codegen.logs.formats.cells import COMMENT_MARKS, delimiter_of
from codegen.logs.formats.source import listing
from codegen.logs.formats.text_lines import LINES_SEARCHED, LONGEST_LINE
from codegen.spec.units import is_unit

ROWS = 3
MOST_SIGNALS, FEWEST_VALUES = 64, 200
"""Most lines of a transposed table, and least number of values in each."""
_NUMBER = (
    r"[+-]?(?:\d++,\d++(?=\s|$)|\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?(?=[\s,;})\]]|$)"
    r"|[+-]?(?:nan|inf)(?=[\s,;})\]]|$)"
)
_NAME = r"(?:[A-Za-z_][\w.\-/]*(?:\[\d+\]|\(0x[0-9A-Fa-f]+\))?|\(null\))"
"""Also with an index or a register's number, ``q[0]`` or ``POSITION(0x001)``; ``(null)`` of LinuxCNC is not in use."""
_NAMED = re.compile(rf"\s*({_NAME})(?:\s*[:=]\s*|\s+)({_NUMBER})[\s,;]*", re.ASCII | re.IGNORECASE)
"""``name:0.1``, ``name = 0.1`` or ``name 0,1``, with the separator after it."""
_PAIR = re.compile(rf"""(?<![\w.\-/])({_NAME})["']?\s*[:=]\s*({_NUMBER})""", re.ASCII | re.IGNORECASE)
"""``name: 0.1`` within other text."""
_NO_WORD = re.compile(r"[^\w.\-/ ]")
"""A sign that ends the words before a name."""
_BEGUN = re.compile(
    r"\W*(?:[A-Z]+\W+)?("
    r"\d{4}-\d\d-\d\d[T ][\d:.,]+|(?:\d\d-\d\d |[A-Z][a-z][a-z] +\d\d? )?\d\d?:\d\d:\d\d[\d.,]*"
    r"|\d{9,}\.\d+|(?<=\()\d+(?=\) ))\W+",
    re.ASCII,
)
"""Beginning of a logger's line: a level, and a time, which may be a number in parentheses."""
_HEAD_ENDS = (":", "]", ">", "(")
"""What a logger writes behind a time, a process and its number, before the message."""
_ARROW = re.compile(
    r"\[?((?:\d{4}-\d\d-\d\d[ T])?\d\d?:\d\d:\d\d[.,:]\d+)(?: -> |(?:\]:?|:| >)? +(?=[^\s,;][^;,\t]*[;,\t]))", re.ASCII
)
"""Beginning of a line of a serial monitor or terminal: a time, with an arrow or before a row with separators."""
_LOGGED = re.compile(
    r"\W*((?:\d{4}-\d\d-\d\d[ T])?\d\d?:\d\d:\d\d[.,]\d+)[^\w\n]+[A-Za-z][^\d\n]*?(?:[:\]>]\s*|-\s+)"
    r"(?=[+-]?\.?\d[^;,\t]*[;,\t])",
    re.ASCII,
)
"""Beginning of a logger's line with numbers as its message: a time, and names without digits. A dash has a blank
behind it, or it is the sign of a number."""
_COMMA_TIME = re.compile(r"((?:^|,)\s*(?:\d{4}-\d\d-\d\d[T ])\d\d:\d\d:\d\d),(\d{3})(?=,)", re.ASCII)
"""A field with date and time whose milliseconds stand behind a comma, as Python's logging writes them."""
_QUANTITY = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s+([A-Za-z°µ%][\w°µ%/*^·⋅]*)")
"""A number with its unit behind a blank, ``0.002 sec``."""
STAMP = "stamp"
"""The column of the times with which lines begin."""
_LIST = re.compile(r'"?[\[(]([^][():"]*)[\])]"?')
"""``[0.1, 0.2]``, ``(0.1, 0.2)`` or ``[0.1 0.2]``, in quotes or not; no time of day."""
_ASSIGNED = re.compile(r"\W*([A-Za-z_][\w.]*)[\"']?\s*[:=]\s*[\[(]([^\])]*)[\])][\s,;]*")
"""``q = [0.1, 0.2]``, also in a dictionary."""
_SEPARATED = re.compile(r"\s*[,;\s]\s*")
_DECIMAL_COMMA = re.compile(r"\d,\d+\s*;|\d,\d+\s+[+-]?\d+,\d")
"""A comma in a list whose elements are separated by something else."""
_LEFT_OUT = ("...", "…")
"""What NumPy prints in a long array in place of elements: the number of those behind it is not known."""
_ELEMENT = re.compile(r"[+-]?(\d|\.\d|nan|inf)", re.IGNORECASE)


@dataclass(frozen=True)
class Form:
    """The conversion of lines to plain ones.

    Attributes:
        plain: line → the plain line, empty for no row.
        left: line → the part of it that is not read.
        names: of the numbers, if each row names them; then ``index`` is the first row's.
        units: (column counted from 0, its unit) where each row states it behind the number.
    """

    plain: Callable[[str], str]
    left: Callable[[str], str] = lambda line: ""
    names: tuple[str, ...] = ()
    index: int = 0
    units: tuple[tuple[int, str], ...] = ()
    notes: tuple[str, ...] = ()

    def plain_lines(self, lines: Sequence[str]) -> list[str]:
        """The lines in plain form, as many as given."""
        return list(map(self.plain, lines))


def find_form(lines: Sequence[str], header: int | None, named: Sequence[str]) -> Form | None:
    """The special form of a table; None for a plain one. Arguments as of ``find_layout``."""
    head = list(islice(lines, LINES_SEARCHED))
    given = [line for line in head if line.strip()]
    if len(given) < ROWS:
        return None
    found = _named_rows(head) if header is None and not named else None
    found = found or _list_rows(given) or _after_arrows(given) or _in_first_column(given)
    return found or _comma_times(head, header, named) or _quantities(given) or _ended_by_semicolons(given)


def _named_rows(head: Sequence[str]) -> Form | None:
    """Rows in which at least two numbers have names, such as ``angle:0.1,torque:0.2``, and all others never change."""
    alike, names, other = 0, tuple[str, ...](), ""
    for i, line in enumerate(head):
        if not line.strip():
            continue
        pairs, text = _pairs(line)
        found = tuple(name for name, _ in pairs)
        row = len(found) > 1
        alike = alike + 1 if row and (found, text) == (names, other) else int(row)
        names, other = found, text
        if alike == ROWS:
            plain = partial(_numbers_of, names, other)
            first = next(k for k in range(i + 1) if plain(head[k]))
            if other and not all(plain(more) for more in head[i:] if more.strip()):
                return None  # its other numbers change
            words = f"each row names its numbers ({listing(names)})"
            left = partial(_not_of, names, other)
            return Form(plain, left, names, first, notes=(words,))
    return None


def _numbers_of(names: tuple[str, ...], other: str, line: str) -> str:
    """The numbers of a row with these names, with tabs between them; nothing of a line that is no such row."""
    pairs, text = _pairs(line)
    if names != tuple(name for name, _ in pairs) or text != other:
        return ""
    return "\t".join(number for _, number in pairs)


def _not_of(names: tuple[str, ...], other: str, line: str) -> str:
    """A line that is no row with these names; empty for such a row."""
    return "" if _numbers_of(names, other, line) else line


def _in_first_column(given: Sequence[str]) -> Form | None:
    """Lines ``"a;b",,``: a table that a spreadsheet has not split, with the empty columns behind it."""
    if not all(empty and re.search("[;\t]", first) for first, _, empty in map(_first_field, given)):
        return None
    words = "every line ends in commas, as a spreadsheet leaves them behind a table it has not split"
    return Form(lambda line: _first_field(line)[0], lambda line: _first_field(line)[1], notes=(words,))


def _first_field(line: str) -> tuple[str, str, bool]:
    """The first field of a comma-separated line, the text behind it, and whether the second field is empty."""
    try:
        first, *rest = next(csv.reader([line]), [""]) or [""]
    except csv.Error:
        return line, "", False
    return first, " ".join(text for text in rest if text.strip()), bool(rest) and not rest[0].strip()


def _pairs(line: str) -> tuple[list[tuple[str, str]], str]:
    """(name, number) pairs of a line, with the time at its beginning; and its other text, empty if without numbers.

    Numbers between that time and the message, such as that of a process, do not count.
    """
    pairs, at = [], 0
    while at < len(line):
        found = _NAMED.match(line, at)
        if found is None:
            break
        pairs.append((found[1], found[2]))
        at = found.end()
    if at == len(line):
        return pairs, ""
    begun = _BEGUN.match(line)
    rest = line[begun.end() :] if begun else line
    first = _PAIR.search(rest) if begun else None
    if first is not None and rest[: first.start()].rstrip().endswith(_HEAD_ENDS):
        rest = rest[first.start() :]
    pairs = [(name, number) for name, number in _PAIR.findall(rest)]
    if len({name for name, _ in pairs}) < len(pairs):
        pairs = _with_words_before(rest)
    text = _PAIR.sub("", rest)
    other = text if re.search(r"(?<![\w.])[+-]?\d", text) else ""
    return ([(STAMP, begun[1]), *pairs] if begun and pairs else pairs), other


def _with_words_before(text: str) -> list[tuple[str, str]]:
    """(name, number) pairs of a text, the names with the words before them: ``Target Position: 1, Position: 2``."""
    pairs, end = [], 0
    for found in _PAIR.finditer(text):
        words = _NO_WORD.split(text[end : found.start()])[-1].split()
        pairs.append((" ".join([*words, found[1]]), found[2]))
        end = found.end()
    return pairs


def _after_arrows(given: Sequence[str]) -> Form | None:
    """Lines of a serial monitor or logger, ``12:00:00.002 -> 0.1,0.2`` or ``12:00:00.002 - axis - INFO - 0.1,0.2``."""
    begun = next((form for form in (_LOGGED, _ARROW) if all(map(form.match, given[-ROWS:]))), None)
    if begun is None:
        return None
    rest = begun.sub("", given[-1], count=1)
    delimiter = delimiter_of(rest)
    if any(len(text.split()) > 1 for text in rest.split(delimiter)) or (rest.count(",") == 1 and "." not in rest):
        return None  # decimal commas between blanks
    mark = delimiter if delimiter in rest else " "
    return Form(lambda line: begun.sub(lambda found: found[1].replace(",", ".") + mark, line, count=1))


def _comma_times(head: Sequence[str], header: int | None, named: Sequence[str]) -> Form | None:
    """Comma-separated rows with ``2026-03-04 23:59:58,002`` in a field, where the milliseconds have no name."""
    places = [i for i, line in enumerate(head) if _COMMA_TIME.search(line)]
    if len(places) < ROWS:
        return None
    above = [line for line in head[: places[0]] if line.strip()]
    stated = "".join(head[header - 1 : header]) if header else ""  # a line that is not there is refused later
    names = stated or (above[-1] if above and header is None else "")
    width = head[places[0]].count(",") + 1
    if width in (len(named), names.count(",") + 1):
        return None  # the milliseconds are a column of their own
    words = "the comma in a date and time is that before the milliseconds"
    return Form(lambda line: _COMMA_TIME.sub(r"\1.\2", line), notes=(words,))


def _ended_by_semicolons(given: Sequence[str]) -> Form | None:
    """Rows with a semicolon at their end only, as in a matrix of MATLAB or a serial protocol: ``0.1, 0.2;``."""
    ended = sum(line.rstrip().endswith(";") and line.count(";") == 1 for line in given)
    if ended < max(ROWS, len(given) / 2) or sum(line.count(";") > 1 for line in given):
        return None
    return Form(lambda line: line.rstrip().removesuffix(";"))


def _quantities(given: Sequence[str]) -> Form | None:
    """Rows in which the numbers of some columns have their unit behind them, ``0.002 sec,0.1``."""
    delimiter = delimiter_of(given[-ROWS])
    units, *others = {tuple(_units_behind(line, delimiter_of(line))) for line in given[-ROWS:]}
    if others or not units:
        return None

    def plain(line: str) -> str:
        texts = line.split(delimiter)
        for k, unit in _units_behind(line, delimiter):
            if (k, unit) in units:
                texts[k] = texts[k].strip(' "').removesuffix(unit).rstrip()
        return delimiter.join(texts)

    return Form(plain, units=units)


def _units_behind(line: str, delimiter: str) -> list[tuple[int, str]]:
    """(column counted from 0, unit) of the fields of a line that are a number, a blank and a unit."""
    texts = enumerate(line.split(delimiter))
    found = [(k, _QUANTITY.fullmatch(text.strip(' "'))) for k, text in texts]
    return [(k, quantity[2]) for k, quantity in found if quantity and is_unit(quantity[2])]


def whole_lines(lines: list[str]) -> list[str]:
    """The lines, with a quoted name that spans several lines joined in the last of them, if that is not too long."""
    made, held = lines, ""
    for i, line in enumerate(islice(lines, LINES_SEARCHED)):
        if not held and (line.count('"') % 2 == 0 or not line.lstrip().startswith(('"', *ascii_letters))):
            continue
        made = made if made is not lines else list(lines)
        held = f"{held} {line}" if held else line
        if len(held) > LONGEST_LINE:
            return lines
        whole = held.count('"') % 2 == 0
        made[i] = held if whole else ""
        held = "" if whole else held
    return lines if held else made


def _list_rows(given: Sequence[str]) -> Form | None:
    """Rows with lists of numbers in some fields; their elements become fields, called ``q[0]``, ``q[1]``."""
    held = [any(len(_elements(text)) > 1 for text in _lists(line) if _ELEMENT.match(text.lstrip())) for line in given]
    first = next((i for i in range(len(held) - ROWS + 1) if all(held[i : i + ROWS])), None)
    if first is None or any(mark in given[first] for mark in _LEFT_OUT):
        return None
    if any(map(_DECIMAL_COMMA.search, _lists(given[first]))):
        return None
    masked, lengths = _LIST.sub("_", given[first]), [len(_elements(text)) for text in _lists(given[first])]
    delimiter = delimiter_of(masked)

    def plain(line: str) -> str:
        lists = list(map(_elements, _lists(line)))
        if list(map(len, lists)) != lengths:
            return line  # its numbers would be in other columns than those of the first row
        of = iter(lists)
        return _LIST.sub(lambda _: delimiter.join(next(of)), line)

    written = given[first - 1] if first else ""
    names, fields = _fields(written.strip().lstrip(COMMENT_MARKS), delimiter), _fields(masked, delimiter)
    if len(names) != len(fields):
        return Form(plain)
    of = iter(lengths)
    counts = [next(of) if field == "_" else None for field in fields]
    if sum(len(name) * (count or 0) for name, count in zip(names, counts, strict=True)) > LONGEST_LINE:
        return Form(plain)
    parts = ([name] if n is None else [f"{name}[{k}]" for k in range(n)] for name, n in zip(names, counts, strict=True))
    header = delimiter.join(chain.from_iterable(parts))
    return Form(lambda line: header if line == written else plain(line))


def _lists(line: str) -> list[str]:
    """The texts between the brackets of the lists in a line."""
    return [found[1] for found in _LIST.finditer(line)]


def transposed_rows(lines: Sequence[str]) -> list[str] | None:
    """The rows of a transposed table, which has a line for each signal.

    Names are before the numbers, in a comment, or before lists, ``q = [0.1, 0.2]``.

    Returns:
        A header, if there are names, and the rows, with tabs between fields; None if the table is not transposed.
    """
    rows = list(islice((line for line in lines if line.strip()), 2 * MOST_SIGNALS))
    comments = [line.strip().lstrip(COMMENT_MARKS) for line in rows if line.lstrip().startswith(("#", "%", "//"))]
    rows = [line.strip() for line in rows if not line.lstrip().startswith(("#", "%", "//"))]
    if not 1 < len(rows) <= MOST_SIGNALS:
        return None
    assigned = list(map(_ASSIGNED.fullmatch, rows))
    if all(assigned):
        rows = ["\t".join([found[1], *_elements(found[2])]) for found in assigned if found]
    delimiter = next((mark for mark in ";\t|," if mark in rows[0]), "")
    signals = [_fields(line.strip(delimiter or None), delimiter) for line in rows]
    width = len(signals[0])
    if width < FEWEST_VALUES or any(len(texts) != width or not _ELEMENT.match(texts[-1]) for texts in signals):
        return None
    given = [texts.pop(0) for texts in signals if not _ELEMENT.match(texts[0])]
    in_comments = [names for comment in comments if len(names := _fields(comment, delimiter)) == len(signals)]
    names = given if len(given) == len(signals) else next(iter(in_comments), [])
    return ["\t".join(row) for row in chain([names] if names else [], zip(*signals, strict=True))]


def _fields(line: str, delimiter: str) -> list[str]:
    return [text.strip().strip('"') for text in (line.split(delimiter) if delimiter else line.split())]


def _elements(text: str) -> list[str]:
    """The elements of a list, of which one may be empty, but not behind a comma at the end."""
    parts = [part.strip("'") for part in _SEPARATED.split(text.strip())]
    return parts if parts[-1] else parts[:-1]
