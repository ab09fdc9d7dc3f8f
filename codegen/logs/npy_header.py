"""The header of an .npy file, read by a grammar of its own.

NumPy's reader evaluates the header as Python and builds any type that stands there; a log needs numbers, or a list of
numeric fields, and one or two lengths.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

MAGIC = b"\x93NUMPY"
LONGEST = 1 << 16
_S = r"\s*"
_TEXT = r"(?:'[^'\\]*'|\"[^\"\\]*\")"
_NUMBERS = r"'[<>|=](?:[iu][1248]|f(?:2|4|8|16)|b1)'"
_FIELD = rf"\({_S}({_TEXT}){_S},{_S}({_NUMBERS}){_S},?{_S}\)"
_FIELDS = re.compile(rf"\[{_S}(?:{_FIELD}{_S}(?:,{_S}|(?=\])))+\]")
_ONE = re.compile(_NUMBERS)
_SHAPE = re.compile(rf"\({_S}(?:\d{{1,18}}{_S}(?:,{_S}\d{{1,18}}{_S}){{0,8}},?{_S})?\)")
_KEY = re.compile(r"'(descr|fortran_order|shape)'\s*:\s*")
_VALUES = {"descr": (_FIELDS, _ONE), "fortran_order": (re.compile("True|False"),), "shape": (_SHAPE,)}
MOST_COLUMNS = 4096


@dataclass(frozen=True)
class Member:
    """What an array says of itself: numbers, or fields of numbers; at most two dimensions; where its data begin."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    fortran: bool
    offset: int

    @property
    def rows(self) -> int:
        """N, also of a vector that lies (1, N)."""
        return max(self.shape) if self.shape and 1 in self.shape else (self.shape or (1,))[0]

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return math.prod(self.shape) * self.dtype.itemsize


@dataclass(frozen=True)
class Header:
    """What an .npy file says of itself: a field of numbers for each column, the number of rows, where they begin."""

    dtype: np.dtype[Any]
    rows: int
    offset: int


def read_header(stream: IO[bytes]) -> Header:
    """The header at the start of a file that is a table; columns without names go by their numbers, counted from 1.

    Raises:
        ValueError: saying what is wrong with it, or that it is no table: a structured array of numbers in one
            dimension, or numbers in two with the rows one after the other.
    """
    member = read_member(stream)
    if member.dtype.names:
        if len(member.shape) != 1:
            raise ValueError("an array that is not of one dimension")
        return Header(member.dtype, member.shape[0], member.offset)
    if len(member.shape) != 2:
        raise ValueError("an array without names of columns")
    rows, count = member.shape
    if not 0 < count <= MOST_COLUMNS:
        raise ValueError(f"an array of {count} columns")
    if member.fortran and 1 not in member.shape:
        raise ValueError("a table that lies column by column (write numpy.ascontiguousarray of it)")
    return Header(np.dtype([(str(k + 1), member.dtype) for k in range(count)]), rows, member.offset)


def read_member(stream: IO[bytes]) -> Member:
    """The header at the start of any array of numbers.

    Raises:
        ValueError: saying what is wrong with it, or that it is no array of numbers.
    """
    start = stream.read(8)
    if len(start) < 8 or not start.startswith(MAGIC):
        raise ValueError("no .npy file")
    if start[6] not in (1, 2, 3):
        raise ValueError(f"version {start[6]} of the format")
    size = "<H" if start[6] == 1 else "<I"
    length = stream.read(struct.calcsize(size))
    if len(length) < struct.calcsize(size):
        raise ValueError("a header that is cut off")
    (count,) = struct.unpack(size, length)
    if count > LONGEST:
        raise ValueError(f"a header of {count} bytes, more than {LONGEST}")
    content = stream.read(count)
    if len(content) < count:
        raise ValueError("a header that is cut off")
    dtype, shape, fortran = _described(content.decode("utf-8" if start[6] == 3 else "latin-1"))
    return Member(dtype, shape, fortran, 8 + len(length) + count)


def _described(text: str) -> tuple[np.dtype[Any], tuple[int, ...], bool]:
    text = text.strip()
    if not (text.startswith("{") and text.endswith("}")):
        raise ValueError("a header that is no description of an array")
    values: dict[str, str] = {}
    at, end = 1, len(text) - 1
    while rest := text[at:end].lstrip(" ,\n"):
        at = end - len(rest)
        key = _KEY.match(text, at, end)
        tried = (form.match(text, key.end(), end) for form in _VALUES[key[1]]) if key else iter(())
        value = next(filter(None, tried), None)
        if key is None or value is None or key[1] in values:
            raise ValueError(_why(text, key))
        values[key[1]] = value[0]
        at = value.end()
    if values.keys() != _VALUES.keys():
        raise ValueError(f"a header without {' and '.join(sorted(_VALUES.keys() - values.keys()))}")
    shape = tuple(int(n) for n in re.findall(r"\d+", values["shape"]))
    if len(shape) > 2:
        raise ValueError(f"an array of {len(shape)} dimensions")
    fortran = values["fortran_order"] == "True"
    if not values["descr"].startswith("["):
        return np.dtype(values["descr"].strip("'")), shape, fortran
    fields = [(name[1:-1], kind[1:-1]) for name, kind in re.findall(_FIELD, values["descr"])]
    names = [name for name, _ in fields]
    if "" in names or len(set(names)) < len(names):
        raise ValueError("a field without a name of its own")
    return np.dtype(fields), shape, fortran


def _why(text: str, key: re.Match[str] | None) -> str:
    if key is not None and key[1] == "shape":
        return "an array whose lengths cannot be read"
    if key is not None and key[1] == "descr":
        rest = text[key.end() :]
        if re.match(r"'\|O", rest) or re.search(r",\s*'\|O", rest):
            return "pickled objects, which are never read"
        if not re.match(r"\[\s*\(", rest):
            return "an array without names of columns"
        kinds = re.findall(r"\(\s*(?:'[^']*'|\"[^\"]*\")\s*,\s*'([^']*)'", rest)
        other = next((kind for kind in kinds if not re.fullmatch(_NUMBERS, f"'{kind}'")), None)
        return "fields that are not single numbers with names" if other is None else f"a field of type {other}"
    return "a header that is no description of an array"
