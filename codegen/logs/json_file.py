"""JSON logs: a list of records, or an object of lists of equal length, at the top or under a key beside scalars."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.user_text import shown
from codegen.logs.description import LogDescription
from codegen.logs.source import Allowance, Columns, LogFile, listing

COST = {b",": 100, b"[": 100, b"{": 300, b'"': 25}
"""Bytes of memory that each of these may cost when parsed, beside the text."""
COPIES, COPIES_WIDE = 3, 9
"""Times its bytes that the text costs: as read, decoded and in strings; with up to four bytes a character."""
MOST_COLUMNS = 4096


class JsonFile(LogFile):
    """A parsed file; what it may cost in memory is counted before it is parsed."""

    expected = 'a JSON log: a list of records such as [{"t": 0, "q": 1}, …], or an object of lists, perhaps under a key'

    def __init__(self, path: Path, allowance: Allowance, description: LogDescription) -> None:
        super().__init__(path, allowance, description)
        self._under = ""
        data = self.read_bytes()
        text = len(data) * (COPIES if data.isascii() else COPIES_WIDE)
        self.take(text + sum(cost * data.count(mark) for mark, cost in COST.items()))
        try:
            content = json.loads(data.decode("utf-8-sig"))
        except json.JSONDecodeError as error:
            found = f"no JSON ({shown(error.msg)})"
            raise BadInput(Place(str(path), error.lineno), found, self.expected, code="LOG001") from None
        except UnicodeDecodeError as error:
            raise self.fault(f"byte {error.start} is not UTF-8") from None
        except (ValueError, RecursionError) as error:
            raise self.fault(f"no JSON that can be read ({shown(str(error), 60)})") from None
        self._under, table = self._table(content)
        self._cell, self._rows = self._records(table)

    @property
    def place(self) -> Place:
        return Place(str(self.path), None, shown(self._under) if self._under else "")

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns; true is 1, and null or a missing entry a missing value."""
        values = np.empty((self._rows, len(wanted)))
        for j, name in enumerate(wanted):
            values[:, j] = [self._number(k, name) for k in range(self._rows)]
        return Columns(str(self.path), tuple(wanted), values)

    def _number(self, row: int, name: str) -> float:
        value = self._cell(row, name)
        if value is None:
            return np.nan
        if not isinstance(value, (int, float)):
            key = f"{shown(self._under)}[{row}].{shown(name)}"
            raise self.fault(f"`{shown(json.dumps(value)[:200])}`", "a number", key, "LOG005")
        try:
            return float(value)
        except OverflowError:
            return np.inf

    def _table(self, content: Any) -> tuple[str, Any]:
        """The key of the list or object that holds the rows, and that."""
        entries = content if isinstance(content, dict) else {}
        key = self.description.records
        if key:
            if key not in entries:
                expected = f"one of the keys {listing(list(entries))}" if entries else "an object with keys"
                place = self.description.place("records")
                raise BadInput(place, f"`{shown(key)}`", expected, nearest_name(key, entries), code="LOG013")
            if not _is_table(entries[key]):
                raise self.fault(f"no table under `{shown(key)}`")
            return key, entries[key]
        if _is_table(content) and not any(map(_is_records, entries.values())):
            return "", content
        keys = [key for key, value in entries.items() if _is_table(value)]
        if len(keys) == 1:
            return keys[0], entries[keys[0]]
        if keys:
            expected = f"`records: KEY` in a log description, KEY one of {listing(keys)}"
            raise self.fault(f"{len(keys)} tables, under {listing(keys)}", expected)
        raise self.fault("no list of records")

    def _records(self, table: Any) -> tuple[Callable[[int, str], Any], int]:
        """(row, name) → value, None where there is none; and how many rows there are."""
        if isinstance(table, dict):
            lists = _lists(table)
            self.names = tuple(lists)
            self.require_equal({name: len(values) for name, values in lists.items()})
            return lambda k, name: lists[name][k], len(next(iter(lists.values())))
        kind = type(table[0])
        for k, record in enumerate(table):
            if type(record) is not kind or (kind is list and len(record) != len(table[0])):
                found = f"entry {k} is `{shown(json.dumps(record)[:200])}`"
                what = "an object" if kind is dict else f"a list of {len(table[0])}"
                raise BadInput(self.place, found, f"{what}, as the first one", code="LOG005")
        if kind is list:
            self.names = tuple(str(k + 1) for k in range(len(table[0])))
            return lambda k, name: table[k][int(name) - 1], len(table)
        names: dict[str, None] = {}
        for record in table:
            names |= dict.fromkeys(record)
            if len(names) > MOST_COLUMNS:
                words = f"more than {MOST_COLUMNS} names in its records"
                raise BadInput(self.place, words, self.expected, code="LOG010")
        self.names = tuple(names)
        return lambda k, name: table[k].get(name), len(table)


def _is_records(value: Any) -> bool:
    """A list whose first entry is an object or a list."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], (dict, list))


def _is_table(value: Any) -> bool:
    return _is_records(value) or (isinstance(value, dict) and bool(_lists(value)))


def _lists(value: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The entries of an object that are lists of single values."""
    return {k: v for k, v in value.items() if isinstance(v, list) and v and not isinstance(v[0], (dict, list))}
