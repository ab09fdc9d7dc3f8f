"""NumPy logs: an .npy file, a structured array or a table of numbers, or an .npz archive of arrays.

Headers are read here, since NumPy's own reader creates any type that a header names and accepts headers of any length.
"""

from __future__ import annotations

import ast
import io
import math
import re
import struct
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput
from codegen.base.input_files import DAMAGED_ZIP
from codegen.base.user_text import shown
from codegen.logs.formats.source import BlockFile, Columns, LogFile

ROWS = 1 << 16
MOST_COLUMNS = 4096
LONGEST_HEADER = 1 << 16
LARGEST_DIRECTORY = 1_000_000
"""Most bytes of an archive's list of members; each member needs some hundred in memory."""
_END = struct.Struct("<4s4H2LH")
_NUMBERS = re.compile(r"[<>|=]([iu][1248]|f(2|4|8|16)|b1)")


@dataclass(frozen=True)
class Member:
    """The header of an array of at most two dimensions, of numbers or fields of numbers; ``offset``: of its data."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    fortran: bool
    offset: int

    @property
    def rows(self) -> int:
        """N; also for a row vector, (1, N)."""
        return max(self.shape) if self.shape and 1 in self.shape else (self.shape or (1,))[0]

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return math.prod(self.shape) * self.dtype.itemsize

    def table(self) -> np.dtype[Any]:
        """The fields of a row; columns without names go by their numbers, counted from 1.

        Raises:
            ValueError: for anything but a structured array in one dimension, or numbers in two, row after row.
        """
        if self.dtype.names:
            if len(self.shape) != 1:
                raise ValueError("an array that is not of one dimension")
            return self.dtype
        if len(self.shape) != 2:
            raise ValueError("an array without names of columns")
        if not 0 < self.shape[1] <= MOST_COLUMNS:
            raise ValueError(f"an array of {self.shape[1]} columns")
        if self.fortran and 1 not in self.shape:
            raise ValueError("a table in column-major order (write numpy.ascontiguousarray of it)")
        return np.dtype([(str(k + 1), self.dtype) for k in range(self.shape[1])])


def read_member(stream: IO[bytes]) -> Member:
    """The header at the start of an array of numbers.

    Raises:
        ValueError: saying what is wrong with it, or that it is no array of numbers.
    """
    start = stream.read(8)
    if len(start) < 8 or not start.startswith(b"\x93NUMPY"):
        raise ValueError("no .npy file")
    if start[6] not in (1, 2, 3):
        raise ValueError(f"version {start[6]} of the format")
    width = 2 if start[6] == 1 else 4
    count = int.from_bytes(stream.read(width), "little")
    if count > LONGEST_HEADER:
        raise ValueError(f"a header of {count} bytes, more than {LONGEST_HEADER}")
    content = stream.read(count)
    if len(content) < count:
        raise ValueError("a header that is cut off")
    header = _literal(content.decode("utf-8" if start[6] == 3 else "latin-1"))
    missing = {"descr", "fortran_order", "shape"} - header.keys()
    if missing:
        raise ValueError(f"a header without {' and '.join(sorted(missing))}")
    shape = header["shape"]
    if not isinstance(shape, tuple) or not all(type(n) is int and 0 <= n < 10**18 for n in shape):
        raise ValueError("an array whose lengths cannot be read")
    if len(shape) > 2:
        raise ValueError(f"an array of {len(shape)} dimensions")
    return Member(_numbers(header["descr"]), shape, header["fortran_order"] is True, 8 + width + count)


def _literal(text: str) -> dict[str, Any]:
    """The mapping in a header, by ``ast.literal_eval``, which creates literals and calls nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = ast.literal_eval(text.strip())
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ValueError("a header that is no description of an array")
    return found


def _numbers(descr: Any) -> np.dtype[Any]:
    """The type of one number, or of fields of numbers.

    Raises:
        ValueError: for any other type.
    """
    fields = descr if isinstance(descr, list) else [("", descr)]
    pairs = [f for f in fields if isinstance(f, tuple) and len(f) == 2 and all(isinstance(part, str) for part in f)]
    if any(kind == "|O" for _, kind in pairs):
        raise ValueError("pickled objects, which are never read")
    other = next((kind for _, kind in pairs if not _NUMBERS.fullmatch(kind)), None)
    if not fields or (other and not isinstance(descr, list)) or not pairs:
        raise ValueError("an array without names of columns")
    if other or len(pairs) < len(fields):
        raise ValueError(f"a field of type {other}" if other else "fields that are not single numbers with names")
    if not isinstance(descr, list):
        return np.dtype(str(descr))
    if len({name for name, _ in pairs} - {""}) < len(pairs):
        raise ValueError("a field without a name of its own")
    return np.dtype(pairs)


class NpyFile(BlockFile):
    """An .npy file whose header has been read."""

    expected = "an .npy log: a structured array with a field of numbers for each column, or an array N × columns"

    def find(self) -> None:
        with self.opened() as stream:
            try:
                member = read_member(stream)
                self._dtype = member.table()
                size = stream.seek(0, 2)
            except OSError as error:
                raise self.fault(f"unreadable ({error.strerror})", code="FILE001") from None
            except ValueError as error:
                raise self.fault(shown(str(error), 80)) from None
        if size < member.offset + member.size:
            raise self.fault(f"{size} bytes, where its header says {member.offset + member.size}")
        self.names, self.rows, self._offset = tuple(self._dtype.names or ()), member.shape[0], member.offset

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        with self.opened() as stream:
            stream.seek(self._offset)
            for start in range(0, self.rows, ROWS):
                size = min(ROWS, self.rows - start) * self._dtype.itemsize
                try:
                    data = stream.read(size)
                except OSError as error:
                    raise self.fault(f"unreadable ({error.strerror})", code="FILE001") from None
                if len(data) < size:
                    raise self.fault(f"{self.rows - start} rows less than its header says")
                rows = np.frombuffer(data, dtype=self._dtype)
                values = np.column_stack([rows[name].astype(np.float64) for name in wanted])
                yield Columns(str(self.path), tuple(wanted), values)


@dataclass(frozen=True)
class _Column:
    """A column of an array: the whole array, a field, or one of its columns."""

    member: str
    part: str | int | None = None


class NpzFile(LogFile):
    """An opened archive, of whose arrays the headers have been read."""

    expected = "an .npz log: an archive of NumPy arrays, one for each column"

    def find(self) -> None:
        self._data = self.read_bytes()
        self.take(len(self._data))
        self._refuse_large_directory()
        self._columns: dict[str, _Column] = {}
        self._members: dict[str, Member] = {}
        self._others: dict[str, str] = {}
        try:
            with zipfile.ZipFile(io.BytesIO(self._data)) as archive:
                for info in archive.infolist():
                    if info.filename.endswith(".npy") and not info.flag_bits & 1:
                        self._add(archive, info)
        except DAMAGED_ZIP as error:
            raise self._damaged(error) from None
        if not self._columns:
            words = ", ".join(f"{shown(name)} ({why})" for name, why in list(self._others.items())[:3]) or "no array"
            raise self.fault(f"no vector among its members: {words}")
        self.names = (*self._columns, *(name for name in self._others if name not in self._columns))

    def _add(self, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
        """Read the header of a member and name its columns."""
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            found = f"an array with compression method {info.compress_type}"
            raise self.fault(found, "numpy.savez_compressed", code="LOG002")
        name = info.filename.removesuffix(".npy")
        try:
            with archive.open(info) as stream:
                member = read_member(stream)
        except ValueError as error:
            self._others[name] = shown(str(error), 80)
            return
        self._members[name] = member
        if member.dtype.names:
            self._columns |= {f"{name}.{field}": _Column(name, field) for field in member.dtype.names}
        elif len(member.shape) == 2 and 1 not in member.shape:
            count = min(member.shape[1], MOST_COLUMNS + 1)
            self._columns |= {f"{name}.{k + 1}": _Column(name, k) for k in range(count)}
        elif member.shape:
            self._columns[name] = _Column(name)
        if len(self._columns) > MOST_COLUMNS:
            raise self.fault(f"more than {MOST_COLUMNS} columns", code="LOG010")

    def load(self, wanted: Sequence[str]) -> Columns:
        for name in wanted:
            if name not in self._columns:
                raise self.fault(self._others[name], "an array of numbers", name, "LOG005")
        columns = [self._columns[name] for name in wanted]
        self.require_equal({n: self._members[c.member].rows for n, c in zip(wanted, columns, strict=True)})
        used = list(dict.fromkeys(column.member for column in columns))
        rows = self._members[used[0]].rows
        if not rows:
            raise self.fault("an array without rows", column=wanted[0], code="LOG009")
        size = sum(self._members[name].size for name in used) + 8 * rows * len(wanted)
        self.take(len(self._data) + size)
        arrays = {name: self._array(name) for name in used}
        values = np.empty((rows, len(wanted)))
        for j, column in enumerate(columns):
            array = arrays[column.member]
            if isinstance(column.part, str):
                array = array[column.part]
            values[:, j] = array[:, column.part] if isinstance(column.part, int) else array.reshape(rows)
        return Columns(str(self.path), tuple(wanted), values)

    def _array(self, name: str) -> NDArray[Any]:
        member = self._members[name]
        try:
            with zipfile.ZipFile(io.BytesIO(self._data)) as archive, archive.open(f"{name}.npy") as stream:
                stream.read(member.offset)
                data = stream.read(member.size)
                if len(data) < member.size:
                    raise ValueError("an array that is cut off")
                if stream.read(1):
                    raise ValueError("an array that is longer than it says")
        except DAMAGED_ZIP as error:
            raise self._damaged(error, name) from None
        array = np.frombuffer(data, dtype=member.dtype)
        return array.reshape(member.shape, order="F" if member.fortran else "C")

    def _refuse_large_directory(self) -> None:
        """Raise BadInput for an archive whose list of members is too large, since ``zipfile`` reads it whole."""
        data = self._data
        at = len(data) - _END.size
        if at < 0 or data[at : at + 4] != b"PK\5\6" or data[-2:] != b"\0\0":
            at = data.rfind(b"PK\5\6", max(0, len(data) - (1 << 16) - _END.size))
        if at < 0 or at + _END.size > len(data):
            raise self.fault("not a zip archive, or an incomplete one")
        size = _END.unpack_from(data, at)[5]
        if size > LARGEST_DIRECTORY or data[max(0, at - 20) : max(0, at - 20) + 4] == b"PK\6\7":
            expected = f"{self.expected}; at most a few thousand of them"
            raise self.fault("an archive of too many files", expected, code="LOG010")

    def _damaged(self, error: Exception, member: str = "") -> BadInput:
        return self.fault(f"a damaged archive ({shown(str(error), 80)})", column=member)
