"""NumPy logs: an .npy file, a structured array or a table of numbers, or an .npz archive of arrays."""

import io
import math
import re
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from codegen.base.user_text import brief
from codegen.logs.formats.row_forms import FEWEST_VALUES, MOST_SIGNALS
from codegen.logs.formats.source import BlockFile, Columns, LogFile

ROWS = 1 << 16
MOST_COLUMNS = 4096
LONGEST_HEADER = 1 << 16
MAGIC = 12
"""Bytes before a header, its length included, at most."""
MOST_MEMBERS = 10_000
NO_NAMES = "an array without names of columns"


@dataclass(frozen=True)
class Member:
    """The header of an array of numbers, or of records of numbers, of at most two dimensions.

    Attributes:
        fortran: whether the columns of a table are stored one after the other, and not its rows.
    """

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    fortran: bool
    offset: int

    @property
    def turned(self) -> bool:
        """Whether each row of a table is a signal, as in a text with a line for each signal."""
        few, many = (self.shape * 2)[:2] if self.shape else (0, 0)
        return len(self.shape) == 2 and 1 < few <= MOST_SIGNALS and many >= FEWEST_VALUES

    @property
    def rows(self) -> int:
        """N; also for a row vector, (1, N)."""
        return max(self.shape) if self.turned or 1 in self.shape else (self.shape or (1,))[0]

    @property
    def columns(self) -> int:
        """Number of the columns of a table."""
        return self.shape[0] if self.turned else self.shape[1]

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return math.prod(self.shape) * self.dtype.itemsize

    def table(self) -> np.dtype[Any]:
        """The fields of a row, by numbers from 1 where they have no names; ValueError for no rows of these."""
        if self.dtype.names:
            if len(self.shape) != 1:
                raise ValueError("an array that is not of one dimension")
            return self.dtype
        if len(self.shape) != 2:
            raise ValueError(NO_NAMES)
        if not 0 < self.columns <= MOST_COLUMNS:
            raise ValueError(f"an array of {self.columns} columns")
        return np.dtype([(str(k + 1), self.dtype) for k in range(self.columns)])


def read_member(stream: IO[bytes]) -> Member:
    """The header at the start of an array of numbers, by NumPy, which reads it as a literal and creates no array.

    NumPy asks for the length of a header after it has read all of it: here it is given no more than it may read.

    Raises:
        ValueError: saying what is wrong with it, or that it is no array of numbers.
    """
    try:
        stream = io.BytesIO(stream.read(MAGIC + LONGEST_HEADER + 1))
        version = npy_format.read_magic(stream)
        if version not in ((1, 0), (2, 0), (3, 0)):
            raise ValueError(f"version {version[0]} of the format")
        read = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
        shape, fortran, dtype = read(stream, max_header_size=LONGEST_HEADER)
        if version == (3, 0) and dtype.names:  # as 2.0, but with names in UTF-8, which were read as Latin-1
            dtype.names = tuple(name.encode("latin-1").decode() for name in dtype.names)
    except Exception as error:  # NumPy passes on what its parsers raise: SyntaxError, TokenError, MemoryError …
        words = re.split(r"\n| on line|; expected", str(error))[0] or type(error).__name__
        raise ValueError(f"no .npy file: {words}") from None
    if dtype.hasobject:
        raise ValueError("pickled objects, which are never read")
    for name, kind in [(n, dtype[n]) for n in dtype.names] if dtype.names else [("", dtype)]:
        if kind.kind not in "fiub" or kind.shape:
            raise ValueError(f"a field `{name}` of type {kind.str}" if name else f"an array of type {kind.str}")
    if len(shape) > 2:
        raise ValueError(f"an array of {len(shape)} dimensions")
    if not all(0 <= n < 10**18 for n in shape):
        raise ValueError("an array whose lengths cannot be read")
    return Member(dtype, shape, fortran, stream.tell())


class NpyFile(BlockFile):
    """An .npy file whose header has been read."""

    expected = "an .npy log: a structured array with a field of numbers for each column, or an array N × columns"

    def find(self) -> None:
        with self.opened() as stream, self.reading():
            try:
                member = read_member(stream)
                self._dtype = member.table()
            except ValueError as error:
                raise self.fault(brief(str(error), 80)) from None
            size = stream.seek(0, 2)
        if size < member.offset + member.size:
            raise self.fault(f"{size} bytes, where its header says {member.offset + member.size}")
        self.names, self._member = tuple(self._dtype.names or ()), member
        self.rows = member.shape[0] if 1 in member.shape else member.rows

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        indices = [self.names.index(name) for name in wanted]
        columnwise = not self._member.dtype.names and self._member.fortran != self._member.turned
        with self.opened() as stream:
            for start in range(0, self.rows, ROWS):
                count = min(ROWS, self.rows - start)
                if columnwise:
                    parts = [self._part(stream, k * self.rows + start, count, self._member.dtype) for k in indices]
                else:
                    rows = self._part(stream, start, count, self._dtype)
                    parts = [rows[name] for name in wanted]
                yield Columns(str(self.path), tuple(wanted), np.column_stack([p.astype(np.float64) for p in parts]))

    def _part(self, stream: IO[bytes], start: int, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """``count`` elements of the data from the element ``start``."""
        stream.seek(self._member.offset + start * dtype.itemsize)
        with self.reading():
            data = stream.read(count * dtype.itemsize)
        if len(data) < count * dtype.itemsize:
            raise self.fault("less data than its header says")
        return np.frombuffer(data, dtype=dtype)


class NpzFile(LogFile):
    """An opened archive, of whose arrays the headers have been read."""

    expected = "an .npz log: an archive of NumPy arrays of numbers: one for each column, or tables"

    def find(self) -> None:
        self._data = self.read_bytes()
        self.take(len(self._data))
        self._columns: dict[str, tuple[str, str | int | None]] = {}
        self._members: dict[str, Member] = {}
        self._others: dict[str, str] = {}
        with self.reading(), zipfile.ZipFile(io.BytesIO(self._data)) as archive:
            members = {info.filename: info for info in archive.infolist()}
            if len(members) < len(archive.infolist()):
                raise self.fault("two members of one name", f"{self.expected}; each of them once", code="LOG004")
            if len(members) > MOST_MEMBERS:
                expected = f"{self.expected}; at most {MOST_MEMBERS}"
                raise self.fault(f"an archive of {len(members)} files", expected, code="LOG010")
            for info in members.values():
                if info.filename.endswith(".npy") and not info.flag_bits & 1:
                    self._add(archive, info)
        if not self._columns:
            words = ", ".join(f"{brief(name)} ({why})" for name, why in list(self._others.items())[:3]) or "no array"
            raise self.fault(f"no vector among its members: {words}")
        self.names = (*self._columns, *(name for name in self._others if name not in self._columns))

    def _add(self, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
        """Read the header of a member and name its columns: an array, its fields, or the columns of a table."""
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            found = f"an array with compression method {info.compress_type}"
            raise self.fault(found, "numpy.savez_compressed", code="LOG002")
        name = info.filename.removesuffix(".npy")
        try:
            with archive.open(info) as stream:
                member = self._members[name] = read_member(stream)
            fields = member.table().names if member.dtype.names else None
        except ValueError as error:
            self._others[name] = brief(str(error), 80)
            return
        if fields:
            self._columns |= {f"{name}.{field}": (name, field) for field in fields}
        elif len(member.shape) == 2 and 1 not in member.shape:
            self._columns |= {f"{name}.{k + 1}": (name, k) for k in range(min(member.columns, MOST_COLUMNS + 1))}
        elif member.shape:
            self._columns[name] = name, None
        if len(self._columns) > MOST_COLUMNS:
            raise self.fault(f"more than {MOST_COLUMNS} columns", code="LOG010")

    def load(self, wanted: Sequence[str]) -> Columns:
        for name in wanted:
            if name not in self._columns:
                raise self.fault(self._others[name], "an array of numbers", name, "LOG005")
        columns = [self._columns[name] for name in wanted]
        self.require_equal({n: self._members[member].rows for n, (member, _) in zip(wanted, columns, strict=True)})
        used = list(dict.fromkeys(member for member, _ in columns))
        rows = self._members[used[0]].rows
        if not rows:
            raise self.fault("an array without rows", column=wanted[0], code="LOG009")
        size = sum(self._members[name].size for name in used) + 8 * rows * len(wanted)
        self.take(len(self._data) + size)
        arrays = {name: self._array(name) for name in used}
        values = np.empty((rows, len(wanted)))
        for j, (member, part) in enumerate(columns):
            array = arrays[member]
            if isinstance(part, str):
                array = array[part]
            table = array.T if self._members[member].turned else array
            values[:, j] = table[:, part] if isinstance(part, int) else array.reshape(rows)
        return Columns(str(self.path), tuple(wanted), values)

    def _array(self, name: str) -> NDArray[Any]:
        whole = io.BytesIO(self._data)
        with self.reading(), zipfile.ZipFile(whole) as archive, archive.open(f"{name}.npy") as stream:
            array = npy_format.read_array(stream, allow_pickle=False, max_header_size=LONGEST_HEADER)
            if stream.read(1):
                raise self.fault("an array that is longer than it says", column=name)
        return np.asarray(array)
