"""JSON logs: a list of records, or an object of lists of equal length, at the top or under a key beside scalars."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.logs.description import LogDescription
from codegen.logs.log import Array
from codegen.logs.source import Allowance, Columns, Source, Unannotated, listing, read_bytes, shown

EXPECTED = 'a JSON log: a list of records such as [{"t": 0, "q": 1}, …], or an object of lists, perhaps under a key'
COST = {b",": 100, b"[": 100, b"{": 300, b'"': 25}
"""Bytes of memory that each of these may cost when parsed, beside the text."""
COPIES, COPIES_WIDE = 3, 9
"""Times its bytes that the text costs: as read, decoded and in strings; with up to four bytes a character."""
MOST_COLUMNS = 4096


@dataclass(frozen=True)
class JsonSource(Unannotated):
    """A parsed file.

    Attributes:
        under: key of the table; empty at the top.
        names: of the columns.
        cell: (row, name) → value; None where there is none.
        rows: how many there are.
    """

    path: Path
    under: str
    names: tuple[str, ...]
    cell: Callable[[int, str], Any]
    rows: int

    @property
    def place(self) -> Place:
        return Place(str(self.path), None, shown(self.under) if self.under else "")

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns; true is 1, and null or a missing entry a missing value.

        Raises:
            BadInput: for a value that is no number.
        """
        file = str(self.path)
        values = np.empty((self.rows, len(wanted)))
        for j, name in enumerate(wanted):
            values[:, j] = self._column(name)
        return Columns(file, tuple(wanted), values, None)

    def _column(self, name: str) -> Array:
        found = [self.cell(k, name) for k in range(self.rows)]
        values = np.empty(self.rows)
        for k, value in enumerate(found):
            if value is None:
                values[k] = np.nan
            elif isinstance(value, (int, float)):
                try:
                    values[k] = value
                except OverflowError:
                    values[k] = np.inf
            else:
                place = Place(str(self.path), None, f"{shown(self.under)}[{k}].{shown(name)}")
                raise BadInput(place, f"`{shown(json.dumps(value)[:200])}`", "a number", code="LOG005")
        return values


def open_json(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """Open a JSON file; what it may cost in memory is counted before it is parsed.

    Raises:
        BadInput: if it cannot be read, is no JSON, is too large, or holds no table or several.
    """
    place = Place(str(path))
    data = read_bytes(path, EXPECTED)
    text = len(data) * (COPIES if data.isascii() else COPIES_WIDE)
    allowance.take(path, text + sum(cost * data.count(mark) for mark, cost in COST.items()), EXPECTED)
    try:
        content = json.loads(data.decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise BadInput(
            Place(str(path), error.lineno), f"no JSON ({shown(error.msg)})", EXPECTED, code="LOG001"
        ) from None
    except UnicodeDecodeError as error:
        raise BadInput(place, f"byte {error.start} is not UTF-8", EXPECTED, code="LOG001") from None
    except (ValueError, RecursionError) as error:
        raise BadInput(place, f"no JSON that can be read ({shown(str(error), 60)})", EXPECTED, code="LOG001") from None
    under, table = _table(path, content, description)
    return _source(path, under, table)


def _table(path: Path, content: Any, description: LogDescription) -> tuple[str, Any]:
    """The list or object that holds the rows, and its key."""
    place = Place(str(path))
    if description.records:
        key = description.records
        if not isinstance(content, dict) or key not in content:
            known = list(content) if isinstance(content, dict) else []
            expected = f"one of the keys {listing(known)}" if known else "an object with keys"
            raise BadInput(
                description.place("records"), f"`{shown(key)}`", expected, nearest_name(key, known), code="LOG013"
            )
        if not _is_table(content[key]):
            raise BadInput(place, f"no table under `{shown(key)}`", EXPECTED, code="LOG001")
        return key, content[key]
    if _is_table(content) and not (isinstance(content, dict) and any(map(_is_records, content.values()))):
        return "", content
    keys = [key for key, value in content.items() if _is_table(value)] if isinstance(content, dict) else []
    if len(keys) == 1:
        return keys[0], content[keys[0]]
    if keys:
        expected = f"`records: KEY` in a log description, KEY one of {listing(keys)}"
        raise BadInput(place, f"{len(keys)} tables, under {listing(keys)}", expected, code="LOG001")
    raise BadInput(place, "no list of records", EXPECTED, code="LOG001")


def _is_records(value: Any) -> bool:
    """A list whose first entry is an object or a list."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], (dict, list))


def _is_table(value: Any) -> bool:
    return _is_records(value) or (isinstance(value, dict) and bool(_lists(value)))


def _lists(value: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The entries of an object that are lists of single values."""
    return {k: v for k, v in value.items() if isinstance(v, list) and v and not isinstance(v[0], (dict, list))}


def _source(path: Path, under: str, table: Any) -> Source:
    place = Place(str(path), None, shown(under) if under else "")
    if isinstance(table, dict):
        lists = _lists(table)
        lengths = {name: len(values) for name, values in lists.items()}
        for name, length in lengths.items():
            if length != next(iter(lengths.values())):
                expected = f"{next(iter(lengths.values()))} values as in `{shown(next(iter(lengths)))}`"
                raise BadInput(Place(str(path), None, shown(name)), f"{length} values", expected, code="LOG011")
        return JsonSource(path, under, tuple(lists), lambda k, name: lists[name][k], next(iter(lengths.values())))
    kind = type(table[0])
    for k, record in enumerate(table):
        if type(record) is not kind or (kind is list and len(record) != len(table[0])):
            what = "an object" if kind is dict else f"a list of {len(table[0])}"
            raise BadInput(
                place, f"entry {k} is `{shown(json.dumps(record)[:200])}`", f"{what}, as the first one", code="LOG005"
            )
    if kind is list:
        numbers = tuple(str(k + 1) for k in range(len(table[0])))
        return JsonSource(path, under, numbers, lambda k, name: table[k][int(name) - 1], len(table))
    names: dict[str, None] = {}
    for record in table:
        names |= dict.fromkeys(record)
        if len(names) > MOST_COLUMNS:
            raise BadInput(place, f"more than {MOST_COLUMNS} names in its records", EXPECTED, code="LOG010")
    return JsonSource(path, under, tuple(names), lambda k, name: table[k].get(name), len(table))
