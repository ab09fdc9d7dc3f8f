"""Excel workbooks, .xlsx and .xlsm: the stored values of one sheet, which are then read as a text table.

A workbook is a ZIP archive of XML parts (ECMA-376). Four of them are opened, by their names within the archive: the
list of sheets, the sheet, its texts and its formats of numbers. No formula is computed, and macros and links to other
files lie in parts that are not opened. A part with a document type declaration, the place of entities, is refused.
"""

import posixpath
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from xml.parsers import expat

from codegen.base.user_text import brief
from codegen.logs.description import LogDescription
from codegen.logs.formats.cells import is_number
from codegen.logs.formats.csv_file import CsvSource, open_lines
from codegen.logs.formats.source import LARGEST_STREAM, Allowance, File, listing

MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384
"""Those of a sheet."""
LONGEST_TEXT = 1000
"""Letters of a cell that are read: a shared text may be in every cell."""
LONGEST_TOKEN = 1_000_000
"""Most bytes of a tag or comment: expat reads one that is not complete from its beginning for each piece of a part."""
_BOOK, _TARGETS, _TEXTS, _STYLES = (
    f"xl/{name}" for name in ("workbook.xml", "_rels/workbook.xml.rels", "sharedStrings.xml", "styles.xml")
)
"""The parts beside the sheet; the last two may be absent."""
COST = 8
"""Memory of what these hold over their size."""
COPIES = 4
"""Copies of a row's text that reading holds, in letters of one byte."""
SMALL = 0.1
"""Share of the largest sheet's size below which another sheet holds no rows of the log, but notes or nothing."""
DEEPEST = 100
"""Most elements that are open in one another; a sheet has about ten."""
_DAY_ZERO = datetime(1899, 12, 30)
"""The day from which Excel counts days."""
_DATES = frozenset([*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)])
"""Formats of dates and times that a workbook does not define itself."""
_PLAIN_IN_FORMAT = re.compile(r'"[^"]*"|[\\_*].|\[(?![hms]+\])[^][]*\]', re.IGNORECASE)
"""The parts of a format of numbers that are no code: texts, spaces as wide as a letter, and colours in brackets."""
_REFERENCE = re.compile(r"([A-Z]{1,3})\d+")


def open_xlsx(path: Path, allowance: Allowance, description: LogDescription) -> CsvSource:
    """Open a workbook: the sheet that ``records`` of the description names, or the one large sheet."""
    file = File(path, "an Excel workbook (.xlsx)")
    with file.opened(LARGEST_STREAM) as stream, file.reading():
        archive = zipfile.ZipFile(stream)
        given = {part.filename: part.file_size for part in archive.infolist()}
        size = COST * sum(given.get(part, 0) for part in (_BOOK, _TARGETS, _TEXTS, _STYLES))
        allowance.take(path, size, file.expected)
        sheets = _sheets(archive)
        sizes = {name: given.get(part, 0) for name, part in sheets.items()}
        asked = description.records
        likely = [asked] if asked else [name for name in sizes if sizes[name] >= SMALL * max(sizes.values())]
        if len(likely) != 1 or likely[0] not in sheets:
            found = f"no sheet `{brief(asked)}`" if asked else f"{len(likely)} sheets that may hold the log"
            expected = f"`records: NAME` in meta.yaml beside the log, NAME one of {listing(list(sheets))}"
            raise file.fault(found, expected, code="LOG001")
        size += sizes[likely[0]]
        allowance.take(path, size, file.expected)
        texts = _texts(archive) if _TEXTS in given else []
        dates = _dates(archive) if _STYLES in given else set()
        rows = _Rows(texts, dates, lambda letters: allowance.take(path, size + COPIES * letters, file.expected))
        _read(archive, sheets[likely[0]], rows.add)
        lines = rows.lines()
    others = [name for name in sheets if name != likely[0]]
    also = f"; the others ({listing(others)}) are not, `records: NAME` in meta.yaml takes one" if others else ""
    source = open_lines(str(path), lines, description, [f"sheet `{brief(likely[0])}` is read{also}"])
    if source.layout.decimal == "." and not rows.numbers_in_texts:  # a cell's number has no sign between thousands
        source.layout = replace(source.layout, decimal_stated=True)
    return source


Element = Callable[[str, Mapping[str, str], str], None]
"""Called at the end of each element of a part: its name, attributes, and the text directly in it."""


def _read(archive: zipfile.ZipFile, part: str, add: Element) -> None:
    """Read a part element by element. Raises ValueError for a document type declaration, ExpatError for no XML."""
    open_elements: list[tuple[str, Mapping[str, str], list[str]]] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        if len(open_elements) == DEEPEST:
            raise ValueError(f"elements nested more than {DEEPEST} deep")
        open_elements.append((name.rpartition(":")[2], attributes, []))

    def text(data: str) -> None:
        if open_elements:
            open_elements[-1][2].append(data[:LONGEST_TEXT])

    def end(name: str) -> None:
        kind, attributes, texts = open_elements.pop()
        add(kind, attributes, "".join(texts)[:LONGEST_TEXT])

    def refuse(*_: object) -> None:
        raise ValueError("a document type declaration")

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.StartDoctypeDeclHandler = refuse
    if archive.getinfo(part).compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # those of ECMA-376
        raise ValueError("another compression than Deflate")
    with archive.open(part) as stream:
        while piece := stream.read(LONGEST_TOKEN):
            parser.Parse(piece)
            if stream.tell() - parser.CurrentByteIndex > LONGEST_TOKEN:
                raise ValueError(f"a tag or comment of more than {LONGEST_TOKEN} bytes")
        parser.Parse(b"", True)


def _sheets(archive: zipfile.ZipFile) -> dict[str, str]:
    """Name of each sheet with cells → its part."""
    targets, found = dict[str, str](), dict[str, str]()

    def relation(kind: str, attributes: Mapping[str, str], _: str) -> None:
        if kind == "Relationship" and attributes["Type"].endswith("/worksheet"):
            targets[attributes["Id"]] = posixpath.normpath(posixpath.join("/xl", attributes["Target"])).lstrip("/")

    def sheet(kind: str, attributes: Mapping[str, str], _: str) -> None:
        relations = [value for key, value in attributes.items() if key.endswith(":id")]
        if kind == "sheet" and relations and (part := targets.get(relations[0])):
            found[attributes["name"]] = part

    _read(archive, _TARGETS, relation)
    _read(archive, _BOOK, sheet)
    return found


def _texts(archive: zipfile.ZipFile) -> list[str]:
    """The texts to which cells refer by number."""
    found, parts = list[str](), list[str]()

    def add(kind: str, _: Mapping[str, str], text: str) -> None:
        if kind == "t":
            parts.append(text)
        elif kind == "rPh":  # how the text is pronounced
            parts.pop()
        elif kind == "si":
            found.append(_one_line("".join(parts)[:LONGEST_TEXT]))
            parts.clear()

    _read(archive, _TEXTS, add)
    return found


def _dates(archive: zipfile.ZipFile) -> set[str]:
    """The styles of cells, by their numbers, that show a number as a date or time."""
    own, styles = dict[str, str](), list[str]()
    inside: list[str] = []

    def add(kind: str, attributes: Mapping[str, str], _: str) -> None:
        if kind == "numFmt":
            own[attributes["numFmtId"]] = attributes["formatCode"]
        elif kind == "xf":
            inside.append(attributes.get("numFmtId", "0"))
        elif kind in ("cellStyleXfs", "cellXfs"):
            styles[:] = inside if kind == "cellXfs" else styles
            inside.clear()

    _read(archive, _STYLES, add)
    codes = {number: bool(re.search("[ymdhs]", _PLAIN_IN_FORMAT.sub("", code), re.I)) for number, code in own.items()}
    return {str(k) for k, number in enumerate(styles) if codes.get(number, int(number) in _DATES)}


class _Rows:
    """The rows of a sheet.

    Args:
        texts, dates: of the workbook.
        count: called with the letters of all lines so far; raises if there are too many.

    Attributes:
        numbers_in_texts: whether a cell has a number as a text.
    """

    def __init__(self, texts: list[str], dates: set[str], count: Callable[[int], None]) -> None:
        self._texts, self._dates, self._count = texts, dates, count
        self._made: list[str] = []
        self._cells: dict[int, str] = {}
        self._value, self._letters, self._next = "", 0, 0
        self._first, self._width = MOST_COLUMNS, 0
        self.numbers_in_texts = False

    def lines(self) -> list[str]:
        """A line for each row, at its number, with tabs between its cells; empty columns at the left are left out."""
        self._count(self._letters + self._width * len(self._made))
        padded = (line + "\t" * (self._width - 1 - line.count("\t")) if line else line for line in self._made)
        return [line[self._first :] for line in padded]

    def add(self, kind: str, attributes: Mapping[str, str], text: str) -> None:
        if kind in ("v", "t"):
            self._value = (self._value + text)[:LONGEST_TEXT]
        elif kind == "c":
            reference = _REFERENCE.fullmatch(attributes.get("r", ""))
            column = _number(reference[1]) if reference else self._next
            if column >= MOST_COLUMNS:
                raise ValueError(f"a cell in column {column + 1}")
            if self._value:
                self._cells[column] = self._text(attributes)
            self._value, self._next = "", column + 1
        elif kind == "row":
            number = int(attributes.get("r", len(self._made) + 1))
            if not len(self._made) < number <= MOST_ROWS:
                raise ValueError(f"row {number} after row {len(self._made)}")
            self._made += [""] * (number - 1 - len(self._made))
            columns = sorted(self._cells)
            width = columns[-1] + 1 if columns else 0
            self._letters += width + sum(map(len, self._cells.values()))
            self._count(self._letters)
            self._made.append("".join("\t" * (k - last) + self._cells[k] for last, k in pairwise([0, *columns])))
            self._first, self._width = min([self._first, *columns]), max(self._width, width)
            self._cells, self._next = {}, 0

    def _text(self, attributes: Mapping[str, str]) -> str:
        """The text of a cell; of a date by ISO 8601. It has no tab, no line end, and quotes as in a text table."""
        kind, text = attributes.get("t", "n"), _one_line(self._value)
        if kind == "s":
            if (place := int(text)) < 0:
                raise ValueError(f"text {place}")
            text = self._texts[place]
        elif kind == "b":
            text = "true" if text in ("1", "true") else "false"
        elif kind == "e":  # #DIV/0!, #NUM!, #REF!, …: no value, and no comment
            text = "#N/A"
        elif kind == "n" and attributes.get("s") in self._dates:
            text = (_DAY_ZERO + timedelta(days=float(text))).isoformat(sep=" ", timespec="microseconds")
        self.numbers_in_texts |= kind in ("s", "str", "inlineStr") and is_number(text)
        return '"' + text.replace('"', '""') + '"' if '"' in text else text


def _one_line(text: str) -> str:
    return re.sub(r"\s+", " ", text)


def _number(letters: str) -> int:
    """The number of a column from its letters, A = 0."""
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1
