"""JSON logs: a list of records, one record per line, or an object of lists, at the top level or under a key.

A value inside a record or object is named by its path: ``motor.position``, ``q[0]``. If rows are lists, the columns are
named by a list of texts in the same object, as pandas writes ``{"columns": ["t", "q"], "data": [[0, 1], …]}``, else by
numbers from 1. Its other forms, ``{"t": {"0": 0, …}, …}`` and ``{"0": {"t": 0, …}, …}``, are read too.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.user_text import brief
from codegen.logs.formats.cells import NUMBER, stamp, value_of
from codegen.logs.formats.source import Columns, LogFile, listing

COST = {b",": 100, b"[": 100, b"{": 300, b'"': 25}
"""Bytes of memory that each of these characters may need when parsed, in addition to the text."""
COPIES, COPIES_WIDE = 3, 9
"""Memory of the text over its size: read, decoded and in strings; of wide characters, up to four bytes each."""
MOST_COLUMNS = 4096
_VALUE = re.compile(r"[^\s,]")
"""Between the values of a list, or of lines."""
_ENDED = re.compile(r"[\]}]\s*,")
"""The end of a record and the comma before the next one, which a text that is cut off does not have."""
_INDEX = re.compile("0|[1-9][0-9]{0,8}")
DEEPEST = 8
"""Most keys and indices of a path."""


Inner = tuple[str | int, ...]
"""Path from a value to one inside: keys and indices."""
Column = tuple[list[Any], Inner]
"""The list with an entry for each row, and the path within an entry."""


class JsonFile(LogFile):
    """A parsed file; the memory that it may need is checked before it is parsed."""

    expected = 'a JSON log: a list of records such as [{"t": 0, "q": 1}, …], or an object of lists, perhaps under a key'

    def find(self) -> None:
        self._under = ""
        data = self.read_bytes()
        text = len(data) * (COPIES if data.isascii() else COPIES_WIDE)
        self.take(text + sum(cost * data.count(mark) for mark, cost in COST.items()))
        try:
            content = self._parsed(data.decode("utf-8-sig"))
        except json.JSONDecodeError as error:
            found = f"no JSON ({brief(error.msg, 80)})"
            raise BadInput(Place(str(self.path), error.lineno), found, self.expected, code="LOG001") from None
        except UnicodeDecodeError as error:
            raise self.fault(f"byte {error.start} is not UTF-8") from None
        except (ValueError, RecursionError) as error:
            raise self.fault(f"no JSON that can be read ({brief(str(error), 60)})") from None
        turned, in_order = _turned(content)
        if not in_order:
            self.own_notes.append("the rows are sorted by the numbers that are their keys, not by these as texts")
        self._under, self._content = self._of_one_record(*self._table(turned))
        self._headings = _headings(content, self._content)
        self._twice: set[str] = set()
        self._paths = self._found()
        self.names = tuple(self._paths)
        self.units = self._stated_units(content)

    def _parsed(self, text: str) -> Any:
        """The value of a text, or the list of the values in it: one after the other, or in a list that is cut off."""
        try:
            return json.loads(text, object_pairs_hook=self._object)
        except json.JSONDecodeError as error:
            listed = error.msg != "Extra data"
            begun = text.find("[") + 1 if listed else 0
            if listed and (not begun or text[: begun - 1].strip()):
                raise
            values = self._one_by_one(text, begun, listed)
            if not values:
                raise
            return values

    def _object(self, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        """An object of these keys and values; of a key that comes twice JSON does not say which value counts."""
        made = dict(pairs)
        if len(made) < len(pairs):
            keys = [key for key, _ in pairs]
            twice = next(key for key in made if keys.count(key) > 1)
            raise self.fault(f"the key `{brief(twice)}` twice in an object", "each key once", code="LOG004")
        return made

    def _stated_units(self, content: Any) -> dict[str, str]:
        """Column → unit under the key ``units``: an object, or a list with a text for each column."""
        given = content.get("units") if isinstance(content, dict) else None
        if isinstance(given, list) and len(given) == len(self.names):
            given = dict(zip(self.names, given, strict=True))
        units = given.items() if isinstance(given, dict) else ()
        found = {name: unit for name, unit in units if name in self._paths and isinstance(unit, str) and unit}
        if found:
            self.own_notes.append(f"the units of the key `units` ({listing(list(found.values()))})")
        return found

    def _one_by_one(self, text: str, at: int, listed: bool) -> list[Any]:
        """The values from a position on, with commas between them or not; the last one may be cut off.

        Raises:
            JSONDecodeError: for another one that cannot be parsed, or text behind the end of the list.
        """
        decoder, values, end = json.JSONDecoder(object_pairs_hook=self._object), list[Any](), len(text.rstrip())
        while (begins := _VALUE.search(text, at, end)) is not None:
            at = begins.start()
            if listed and text[at] == "]" and at == end - 1:
                break
            try:
                value, at = decoder.raw_decode(text, at)
            except json.JSONDecodeError as error:
                at_end = error.pos >= end - len("false") or (
                    error.msg.startswith("Unterminated") and not _ENDED.search(text, error.pos, end)
                )
                last_line = text[:at].rstrip(" ").endswith("\n") and "\n" not in text[at:end]
                if not (at_end if listed else last_line or (at_end and "\n" in text[at:end])):
                    raise
                number = text.count("\n", 0, at) + 1
                self.own_notes.append(f"line {number}, the last one, is cut off and not read")
                break
            values.append(value)
        return values

    @property
    def place(self) -> Place:
        return Place(str(self.path), None, brief(self._under) if self._under else "")

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns; true is 1, and null or a missing entry a missing value.

        Records without any of them, such as events, are left out.
        """
        for name in wanted:
            if name in self._twice:
                words = "a path of keys and also a key: two columns of one name"
                raise self.fault(words, "one column of this name", name, "LOG004")
        paths = {name: self._paths[name] for name in wanted}
        columns = {name: [_at(row, inside) for row in rows] for name, (rows, inside) in paths.items()}
        self.require_equal({name: len(values) for name, values in columns.items()})
        values = np.empty((len(next(iter(columns.values()))), len(wanted)))
        for j, (name, column) in enumerate(columns.items()):
            begun = next((stamp(value) for value in column if isinstance(value, str)), None)
            values[:, j] = [self._number(k, name, value, begun) for k, value in enumerate(column)]
        used = np.array([any(value is not None for value in row) for row in zip(*columns.values(), strict=True)])
        left = int((~used).sum())
        if left and used.any():
            self.own_notes.append(f"{left} record{'s' if left > 1 else ''} without any of the columns left out")
            values = values[used]
        return Columns(str(self.path), tuple(wanted), values)

    def _number(self, row: int, name: str, value: Any, begun: datetime | None) -> float:
        """The number of a value, also of one in a text; of a date or time of day the seconds since ``begun``.

        A column of dates or times of day has no numbers.
        """
        if value is None:
            return np.nan
        number = value_of(value.strip(), begun) if isinstance(value, str) else None if begun else value
        if not isinstance(number, (int, float)):
            key = f"{brief(self._under)}[{row}].{brief(name)}"
            expected = "a date or time of day, as others of the column" if begun else "a number"
            raise self.fault(f"`{brief(json.dumps(value)[:200])}`", expected, key, "LOG005")
        try:
            return float(number)
        except OverflowError:
            return np.inf

    def _table(self, content: Any) -> tuple[str, Any]:
        """The list or object that holds the rows, with its key; "" for the whole file."""
        entries = content if isinstance(content, dict) else {}
        key = self.description.records
        if key:
            path = (key,) if key in entries else tuple(key.split("."))
            table = _at(content, path)
            if table is None:
                reached = next(at for k in range(len(path) - 1, -1, -1) if (at := _at(content, path[:k])) is not None)
                keys = list(reached) if isinstance(reached, dict) else []
                expected = f"one of the keys {listing(keys)}" if keys else f"a number from 0 to {len(reached) - 1}"
                place = self.description.place("records")
                raise BadInput(place, f"`{brief(key)}`", expected, nearest_name(key, keys), code="LOG013")
            if not _is_table(table):
                raise self.fault(f"no table under `{brief(key)}`")
            return key, table
        if entries.keys() - {"index"} == {"columns", "data"} and _is_records(entries["data"]):  # pandas, orient="split"
            return "data", entries["data"]
        if _is_table(content) and not any(map(_is_records, _besides(entries))):
            return "", content
        tables = _tables(entries)
        if len(tables) > 1:
            tables = {path: table for path, table in tables.items() if _has_numbers(table)} or tables
        if len(tables) == 1:
            return next(iter(tables.items()))
        if tables:
            expected = f"`records: KEY` in meta.yaml beside the log, KEY one of {listing(list(tables))}"
            raise self.fault(f"{len(tables)} tables, under {listing(list(tables))}", expected)
        raise self.fault("no list of records")

    def _of_one_record(self, key: str, table: Any) -> tuple[str, Any]:
        """The table with its key; of a list with one record that holds the columns as lists, this record."""
        if not (isinstance(table, list) and isinstance(table[0], dict)):
            return key, table
        lists = _plain(table[0])
        if max(map(len, lists.values()), default=0) > len(table) == 1:
            return key, table[0]
        if len(lists) > 1 and min(map(len, lists.values())) > len(table):
            path = f"{key}.NUMBER" if key else "NUMBER"
            expected = f"`records: {path}` in meta.yaml beside the log, NUMBER from 0 to {len(table) - 1}"
            raise self.fault(f"{len(table)} records of lists", expected)
        return key, table

    def _found(self) -> dict[str, Column]:
        """The columns by name."""
        table = self._content
        names = _lists(table) if isinstance(table, dict) else self._of_records(table)
        if len(names) > MOST_COLUMNS:
            raise BadInput(self.place, f"more than {MOST_COLUMNS} columns", self.expected, code="LOG010")
        return names

    def _of_records(self, table: list[Any]) -> dict[str, Column]:
        """The columns of a list of records; not those of further records where these have too many."""
        kind = type(table[0])
        for k, record in enumerate(table):
            if type(record) is not kind or (kind is list and len(record) != len(table[0])):
                found = f"entry {k} is `{brief(json.dumps(record)[:200])}`"
                what = "an object" if kind is dict else f"a list of {len(table[0])}"
                raise BadInput(self.place, found, f"{what}, as the first one", code="LOG005")
        names: dict[str, Column] = {}
        if kind is list:
            inner = [(name, k, *one) for k, name in enumerate(self._headings) for one in _inside(table[0][k])]
            names = {f"{name}.{part}" if part else name: (table, (k, *path)) for name, k, part, path in inner}
        for record in table if kind is dict else ():
            for name, path in _inside(record):
                if names.setdefault(name, (table, path))[1] != path:
                    self._twice.add(name)
            if len(names) > MOST_COLUMNS:
                break
        return names


def _turned(content: Any) -> tuple[Any, bool]:
    """An object of objects with the same keys, as pandas writes a table, as an object of lists or a list of records.

    The more numerous keys are those of the rows; they become the column ``index``. Keys that are numbers, sorted as
    texts (``"10"`` before ``"2"``), as ``json.dumps`` with ``sort_keys`` writes them, are sorted as numbers.

    Returns:
        The content, and whether its rows were in this order before.
    """
    parts = list(content.values()) if isinstance(content, dict) and len(content) > 1 else []
    keys = parts[0].keys() if parts and isinstance(parts[0], dict) else ()
    if len(keys) < 2 or not all(isinstance(part, dict) and part.keys() == keys for part in parts):
        return content, True
    if any(isinstance(value, (dict, list)) for part in parts for value in part.values()):
        return content, True
    rows = list(content if len(parts) > len(keys) else keys)
    ordered = sorted(rows, key=float) if rows == sorted(rows) and all(map(NUMBER.match, rows)) else rows
    if len(parts) > len(keys):
        return [{"index": key, **content[key]} for key in ordered], ordered == rows
    columns = {name: [part[key] for key in ordered] for name, part in content.items()}
    return {"index": ordered, **columns}, ordered == rows


def _tables(entries: Mapping[str, Any], name: str = "") -> dict[str, Any]:
    """Key, or path of keys such as ``data.samples``, → the table under it."""
    found: dict[str, Any] = {}
    for key, value in entries.items():
        path = f"{name}.{key}" if name else key
        if _is_table(value):
            found[path] = value
        elif isinstance(value, dict) and path.count(".") < DEEPEST:
            found |= _tables(value, path)
    return found


def _headings(content: Any, table: Any) -> list[str]:
    """Names of the columns if rows are lists: the one list of as many distinct texts, else numbers from 1."""
    count = len(table[0]) if isinstance(table, list) else 0
    beside = [v for key, v in content.items() if key != "units"] if isinstance(content, dict) else []
    texts = [v for v in beside if isinstance(v, list) and len(v) == count and all(isinstance(n, str) for n in v)]
    one = len(texts) == 1 and len(set(texts[0])) == count
    return texts[0] if one else [str(k + 1) for k in range(count)]


def _inside(value: Any, name: str = "", path: Inner = ()) -> Iterator[tuple[str, Inner]]:
    """(name, path) of each scalar inside an object or list, with names such as ``motor.q[0]``."""
    if not isinstance(value, (dict, list)) or not value or len(path) == DEEPEST:
        yield name, path
        return
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
        dot = f"{name}.{key}" if name else str(key)
        yield from _inside(inner, dot if isinstance(value, dict) else f"{name}[{key}]", (*path, key))


def _at(value: Any, path: Inner) -> Any:
    """The value at a path; None if there is none."""
    for key in path:
        index = isinstance(value, list) and isinstance(key, str)
        if index and not _INDEX.fullmatch(str(key)):
            return None
        try:
            value = value[int(key) if index else key]
        except (LookupError, TypeError):
            return None
    return value


def _is_records(value: Any) -> bool:
    """A list whose first entry is an object or a list."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], (dict, list))


def _is_table(value: Any) -> bool:
    """Records, or an object with a list of numbers, which may be texts."""
    lists = _plain(value).values() if isinstance(value, dict) else ()
    return _is_records(value) or any(_may_be_number(v[0]) for v in lists)


def _may_be_number(value: Any) -> bool:
    return not isinstance(value, str) or NUMBER.match(value.strip()) is not None


def _has_numbers(table: Any) -> bool:
    """Whether the first record of a list has a number; true for an object of lists."""
    return isinstance(table, dict) or any(_may_be_number(_at(table[0], path)) for _, path in _inside(table[0]))


def _plain(value: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The entries of an object that are lists of scalars."""
    return {k: v for k, v in value.items() if isinstance(v, list) and v and not isinstance(v[0], (dict, list))}


def _besides(entries: Mapping[str, Any]) -> list[Any]:
    """The values of an object without lists of lists that are as long as one of its lists of scalars."""
    lengths = {len(v) for v in _plain(entries).values()}
    rows = [isinstance(v, list) and len(v) in lengths and isinstance(v[0], list) for v in entries.values()]
    return [v for v, columns in zip(entries.values(), rows, strict=True) if not columns]


def _lists(table: Mapping[str, Any]) -> dict[str, Column]:
    """The lists of scalars of an object, and all inner lists that are as long as one of them."""
    plain = _plain(table)
    lengths = {len(v) for v in plain.values()}
    found: dict[str, Column] = {name: (rows, ()) for name, rows in plain.items()}

    def search(value: Mapping[str, Any], name: str, depth: int) -> None:
        for key, inner in value.items():
            called = f"{name}.{key}" if name else key
            if isinstance(inner, dict) and depth < DEEPEST:
                search(inner, called, depth + 1)
            elif isinstance(inner, list) and len(inner) in lengths:
                for inside, where in _inside(inner[0]):
                    found.setdefault(f"{called}{inside}", (inner, where))

    search(table, "", 1)
    return found
