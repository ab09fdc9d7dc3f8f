"""MATLAB logs up to format 7 (7.3 is HDF5): a column for each vector, field of a struct or column of a matrix.

The bytes of formats 4 and 5 to 7 are read here, with every length checked. SciPy's reader is compiled and trusts the
lengths and types written in the file: a damaged one can end the process. A log needs plain numeric arrays only.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from codegen.base.arrays import Array
from codegen.base.input_files import opened
from codegen.base.user_text import brief
from codegen.logs.description import LogDescription
from codegen.logs.formats.hdf5_file import MAGIC, UNPACKED, Hdf5File
from codegen.logs.formats.source import LARGEST_STREAM, Allowance, Columns, LogFile, listing

# Codes of the file: of the type of numbers in format 5 and in format 4, of an element, of MATLAB's class.
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_STORED_4 = ("f8", "f4", "i4", "i2", "u2", "u1")
_MATRIX, _COMPRESSED = 14, 15
_CLASSES = (
    *("", "cell", "struct", "object", "text", "sparse matrix", "double", "single", "int8", "uint8", "int16", "uint16"),
    *("int32", "uint32", "int64", "uint64", "function", "object"),
)
_FIRST_NUMERIC, _LAST_NUMERIC = 6, 15
_HEADER = 128
_EMPTY = memoryview(b"")
MOST_VARIABLES = 10_000
MOST_LINES = 200
"""Most columns, or rows, of a matrix that are taken as columns of a log."""
DEEPEST = 8
"""Most levels of nested structs."""
Item = TypeVar("Item")


@dataclass(frozen=True)
class Variable:
    """One variable of the file.

    Attributes:
        kind: MATLAB's class, or another description.
        data, stored: its numbers in the file's own type; empty unless ``numeric``.
        part: start, end and step of this variable's numbers in the data.
    """

    name: str
    shape: tuple[int, ...]
    kind: str
    numeric: bool = False
    data: memoryview | bytes = b""
    stored: str = "f8"
    part: tuple[int, int | None, int] = (0, None, 1)

    def vector(self) -> Array:
        """(N,) all its numbers."""
        return np.frombuffer(self.data, dtype=self.stored)[slice(*self.part)].astype(np.float64)

    def lines(self) -> list[Variable]:
        """The columns of a matrix, or its rows where there are fewer of them, as vectors ``NAME.1``, ``NAME.2``, …"""
        size = [n for n in self.shape if n != 1]
        if not self.numeric or len(size) != 2 or not 2 <= min(size) <= MOST_LINES:
            return []
        rows, columns = size
        if columns <= rows:
            parts: list[tuple[int, int | None, int]] = [(k * rows, (k + 1) * rows, 1) for k in range(columns)]
        else:
            parts = [(k, None, rows) for k in range(rows)]
        shape = (max(size), 1)
        return [replace(self, name=f"{self.name}.{k + 1}", shape=shape, part=p) for k, p in enumerate(parts)]


OBJECT = "object of MATLAB's class"
_OPAQUE = 17


def variables(data: bytes, count: Callable[[int], None]) -> list[Variable]:
    """Every variable of a file.

    Args:
        count: called with the bytes of all variables when unpacked, before unpacking; raises if there are too many.

    Raises:
        ValueError: saying what is damaged.
    """
    if len(data) < 20:
        raise ValueError("shorter than any header")
    if 0 in data[:4]:
        count(len(data))
        return list(_limited(_format_4(data)))
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise ValueError("no MATLAB header")
    elements = list(_limited(_elements(memoryview(data)[_HEADER:], order)))
    sizes = [_unpacked_size(part, order) if kind == _COMPRESSED else len(part) for kind, part in elements]
    count(sum(sizes))
    found, left = [], iter(range(MOST_VARIABLES))
    for (kind, payload), size in zip(elements, sizes, strict=True):
        if kind == _COMPRESSED:
            inside = _elements(_inflated(payload, size), order)
            found += [v for k, inner in inside if k == _MATRIX for v in _matrices(inner, order, left)]
        elif kind == _MATRIX:
            found += _matrices(payload, order, left)
    return found


def _unpacked_size(payload: memoryview, order: str) -> int:
    """The size of a compressed element by its first bytes; ``_inflated`` checks it."""
    head = _inflated_at_most(payload, 8)[0]
    if len(head) < 8:
        raise ValueError("a compressed variable that is cut off")
    word, size = struct.unpack(f"{order}II", head)
    return 8 if word >> 16 else 8 + int(size) + -int(size) % 8


def _inflated(payload: memoryview, size: int) -> memoryview:
    data, complete = _inflated_at_most(payload, size)
    if not complete:
        raise ValueError("a compressed variable that is cut off, or longer than it says")
    return memoryview(data)


def _inflated_at_most(payload: memoryview, size: int) -> tuple[bytes, bool]:
    """The first bytes of a compressed element, and whether there are no more."""
    reader = zlib.decompressobj()
    try:
        data = reader.decompress(payload, size)
        if not reader.eof:  # the check sum may still lie in what was not taken
            return data, not reader.decompress(reader.unconsumed_tail, 1) and reader.eof
    except zlib.error as error:
        raise ValueError(f"a compressed variable that cannot be unpacked: {error}") from None
    return data, True


def _limited(items: Iterator[Item]) -> Iterator[Item]:
    for number, item in enumerate(items):
        if number >= MOST_VARIABLES:
            raise ValueError(f"more than {MOST_VARIABLES} variables")
        yield item


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and payload of each element."""
    at = 0
    while at + 8 <= len(data):
        word, size = struct.unpack_from(f"{order}II", data, at)
        if word >> 16:  # a small element: size and type in one word, the payload in the next
            word, size, start = word & 0xFFFF, word >> 16, at + 4
            at += 8
            if size > 4:
                raise ValueError(f"a small element of {size} bytes")
        else:
            start = at + 8
            at = start + size + (0 if word == _COMPRESSED else -size % 8)
        if start + size > len(data):
            raise ValueError(f"an element of {size} bytes where {len(data) - start} are left")
        yield word, data[start : start + size]


def _matrices(
    payload: memoryview, order: str, left: Iterator[int], name: str = "", depth: int = 0
) -> Iterator[Variable]:
    """A variable, and after a struct its numeric fields as ``NAME.FIELD``; ``left``: how many may follow."""
    if next(left, None) is None:
        raise ValueError(f"more than {MOST_VARIABLES} variables")
    whole = _matrix(payload, order)
    whole = replace(whole, name=name or whole.name)
    yield whole
    if whole.kind != "struct" or depth == DEEPEST:
        return
    parts = list(_limited(_elements(payload, order)))[3:]
    if len(parts) < 3:
        return
    (_, length), (_, names), *values = parts
    size = int.from_bytes(length, "little" if order == "<" else "big")
    if not 0 < size <= 64 or len(names) % size:
        raise ValueError(f"names of fields of {whole.name} in {len(names)} bytes")
    fields = [bytes(names[k : k + size]).split(b"\0")[0].decode("latin-1") for k in range(0, len(names), size)]
    count = math.prod(whole.shape)
    if len(values) != count * len(fields):
        raise ValueError(f"{len(values)} values in {whole.name}, a struct of {count} times {len(fields)} fields")
    for k, (kind, value) in enumerate(values):
        element = f"{whole.name}({k // len(fields) + 1})" if count > 1 else whole.name
        if kind == _MATRIX:
            inside = _matrices(value, order, left, f"{element}.{fields[k % len(fields)]}", depth + 1)
            yield from (v for v in inside if v.numeric)


def _matrix(payload: memoryview, order: str) -> Variable:
    parts = _elements(payload, order)
    head = [next(parts, (0, _EMPTY)) for _ in range(3)]
    (_, flags), (_, dimensions), (_, name) = head
    (word,) = struct.unpack_from(f"{order}I", flags) if len(flags) == 8 else (0,)
    if word & 0xFF == _OPAQUE:  # the name is in place of the dimensions, and the class follows MCOS
        _, made_of = next(parts, (0, _EMPTY))
        return Variable(bytes(dimensions).decode("latin-1"), (), f"{OBJECT} {bytes(made_of).decode('latin-1')}")
    if len(flags) != 8 or len(dimensions) % 4:
        return Variable("", (), "object of an unknown kind")
    shape = tuple(int(n) for n in np.frombuffer(dimensions, dtype=f"{order}i4"))
    number, is_complex = word & 0xFF, bool(word & 0x0800)
    kind = _CLASSES[number] if 0 < number < len(_CLASSES) else f"variable of class {number}"
    text = bytes(name).decode("latin-1")
    if is_complex or not _FIRST_NUMERIC <= number <= _LAST_NUMERIC:
        return Variable(text, shape, f"complex {kind}" if is_complex else kind)
    stored, numbers = next(parts, (0, _EMPTY))
    return _checked(text, shape, kind, numbers, order + _STORED[stored] if stored in _STORED else None)


def _format_4(data: bytes) -> Iterator[Variable]:
    at = 0
    while at + 20 <= len(data):
        order = "<" if 0 <= struct.unpack_from("<i", data, at)[0] < 5000 else ">"
        code, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", data, at)
        machine, reserved, precision, kind = code // 1000, code // 100 % 10, code // 10 % 10, code % 10
        if machine not in (0, 1) or reserved or precision >= len(_STORED_4) or min(rows, columns, length) < 0:
            raise ValueError("no MATLAB header")
        stored = order + _STORED_4[precision]
        size = rows * columns * np.dtype(stored).itemsize
        start = at + 20 + length
        name = data[at + 20 : start].rstrip(b"\0").decode("latin-1")
        at = start + size * (2 if imaginary else 1)
        if at > len(data):
            raise ValueError(f"a variable of {size} bytes where {max(len(data) - start, 0)} are left")
        if kind or imaginary:
            words = "complex double" if imaginary and not kind else ("text" if kind == 1 else "sparse matrix")
            yield Variable(name, (rows, columns), words)
        else:
            yield _checked(name, (rows, columns), "double", data[start : start + size], stored)


def _checked(name: str, shape: tuple[int, ...], kind: str, numbers: memoryview | bytes, stored: str | None) -> Variable:
    if stored is None:
        raise ValueError(f"numbers of {name} in an unknown type")
    if min(shape, default=-1) < 0 or math.prod(shape) * np.dtype(stored).itemsize != len(numbers):
        raise ValueError(f"{len(numbers)} bytes for {name} of {'×'.join(map(str, shape))}")
    return Variable(name, shape, kind, True, numbers, stored)


class MatFile(LogFile):
    """An opened .mat file; its columns are vectors among its variables, fields of structs and columns of matrices."""

    expected = "a MATLAB file (.mat) with one vector a column"

    def find(self) -> None:
        try:
            given = variables(self.read_bytes(), self.take)
            self._variables = {one.name: one for v in given if v.name for one in (v, *v.lines())}
        except ValueError as error:
            raise self.fault(f"a damaged file ({brief(str(error), 120)})") from None
        self.names = tuple(self._variables)
        found = self._variables.values()
        if not any(v.numeric and sum(n != 1 for n in v.shape) == 1 for v in found):
            words = listing([f"{v.name} ({v.kind} {'×'.join(map(str, v.shape))})".replace(" )", ")") for v in found])
            expected = f"{self.expected}; {UNPACKED}" if any(v.kind.startswith(OBJECT) for v in found) else ""
            raise self.fault(f"no vector among the variables {words}" if found else "no variable", expected)

    def load(self, wanted: Sequence[str]) -> Columns:
        vectors = {name: self._vector(name) for name in wanted}
        self.require_equal({name: len(vector) for name, vector in vectors.items()})
        return Columns(str(self.path), tuple(wanted), np.column_stack([vectors[name] for name in wanted]))

    def _vector(self, name: str) -> Array:
        variable = self._variables[name]
        words = "×".join(map(str, variable.shape))
        if not variable.numeric:
            inside = [other for other in self.names if other.startswith((f"{name}.", f"{name}("))]
            if variable.kind.startswith(OBJECT):
                raise self.fault(f"an {variable.kind}", f"a vector of real numbers; {UNPACKED}", name, "LOG005")
            expected = f"a vector of real numbers{f', such as {listing(inside, 5)} in it' if inside else ''}"
            raise self.fault(f"a {variable.kind} of {words}", expected, name, "LOG005")
        if 0 in variable.shape:
            raise self.fault(f"an empty array ({words})", "a vector of real numbers", name, "LOG005")
        if sum(n != 1 for n in variable.shape) > 1:
            lines = [one.name for one in variable.lines()]
            expected = f"a vector (N×1 or 1×N){f', such as `{lines[0]}` to `{lines[-1]}` of it' if lines else ''}"
            raise self.fault(f"an array of {words}", expected, name, "LOG005")
        return variable.vector()


def open_mat(path: Path, allowance: Allowance, description: LogDescription) -> LogFile:
    """Open a .mat file of either kind; one of format 7.3 is HDF5, perhaps behind 512 bytes of MATLAB's."""
    with opened(path, MatFile.expected, LARGEST_STREAM) as stream:
        head = stream.read(512 + len(MAGIC))
    kind = Hdf5File if MAGIC in (head[:8], head[512:]) else MatFile
    return kind(path, allowance, description)
