"""NumPy archives: an .npz file with an array for each column, or tables; counted before it is unpacked."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput, Place
from codegen.logs.description import LogDescription
from codegen.logs.npy_header import MOST_COLUMNS, Member, read_member
from codegen.logs.source import Allowance, Columns, Source, Unannotated, read_bytes, shown

EXPECTED = "an .npz log: an archive of NumPy arrays, one for each column"
LARGEST_DIRECTORY = 1_000_000
"""Bytes of an archive's list of members; each costs some hundred in memory."""
_END = struct.Struct("<4s4H2LH")
_FAULTS = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, RuntimeError, LookupError, struct.error)
"""What ``zipfile`` raises on a damaged archive; NotImplementedError is a RuntimeError."""


@dataclass(frozen=True)
class _Column:
    """A column of a member: the whole of it, a field, or one of its columns."""

    member: str
    field: str = ""
    index: int | None = None


@dataclass(frozen=True)
class NpzSource(Unannotated):
    """An opened archive: the headers of its arrays are read, their numbers are packed still.

    Attributes:
        file: name of the file. data: its bytes.
        columns: by name. members: by name, without ``.npy``.
        others: what else there is, and why it is no column.
        allowance: counts what is unpacked.
    """

    path: Path
    data: bytes
    columns: dict[str, _Column]
    members: dict[str, Member]
    others: dict[str, str]
    allowance: Allowance

    @property
    def names(self) -> tuple[str, ...]:
        """Every column, and every member that is none: ``load`` says why."""
        return (*self.columns, *self.others)

    @property
    def place(self) -> Place:
        return Place(str(self.path))

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns.

        Raises:
            BadInput: for a member that is no column of numbers, columns of different length, or too many bytes.
        """
        file = str(self.path)
        for name in wanted:
            if name in self.others:
                raise BadInput(Place(file, None, shown(name)), self.others[name], "an array of numbers", code="LOG005")
        used = list(dict.fromkeys(self.columns[name].member for name in wanted))
        rows = {name: self.members[self.columns[name].member].rows for name in wanted}
        for name, count in rows.items():
            if count != rows[wanted[0]]:
                found, first = f"{count} values", wanted[0]
                expected = f"{rows[first]} values as in `{shown(first)}`"
                raise BadInput(Place(file, None, shown(name)), found, expected, code="LOG011")
        if not rows[wanted[0]]:
            raise BadInput(Place(file, None, shown(wanted[0])), "an array without rows", EXPECTED, code="LOG009")
        size = sum(self.members[name].size for name in used) + 8 * rows[wanted[0]] * len(wanted)
        self.allowance.take(self.path, len(self.data) + size, EXPECTED)
        arrays = {name: self._array(name) for name in used}
        values = np.empty((rows[wanted[0]], len(wanted)))
        for j, name in enumerate(wanted):
            column = self.columns[name]
            array = arrays[column.member]
            if column.field:
                array = array[column.field]
            values[:, j] = array.reshape(len(values)) if column.index is None else array[:, column.index]
        return Columns(file, tuple(wanted), values, None)

    def _array(self, name: str) -> NDArray[Any]:
        member = self.members[name]
        try:
            with zipfile.ZipFile(io.BytesIO(self.data)) as archive, archive.open(f"{name}.npy") as stream:
                stream.read(member.offset)
                data = _exactly(stream, member.size)
        except _FAULTS as error:
            raise _damaged(self.path, error, name) from None
        array = np.frombuffer(data, dtype=member.dtype)
        return array.reshape(member.shape, order="F" if member.fortran else "C")


def open_npz(path: Path, allowance: Allowance, description: LogDescription) -> Source:
    """Open an archive and read the headers of its arrays.

    Raises:
        BadInput: if it cannot be read, is damaged, packed in another way than zip's own, or holds no array of numbers.
    """
    data = read_bytes(path, EXPECTED)
    allowance.take(path, len(data), EXPECTED)
    _refuse_large_directory(path, data)
    columns: dict[str, _Column] = {}
    members: dict[str, Member] = {}
    others: dict[str, str] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for info in archive.infolist():
                if not info.filename.endswith(".npy") or info.flag_bits & 1:
                    continue
                if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                    raise BadInput(
                        Place(str(path)),
                        f"an array with compression method {info.compress_type}",
                        "numpy.savez_compressed",
                        code="LOG002",
                    )
                name = info.filename.removesuffix(".npy")
                try:
                    with archive.open(info) as stream:
                        member = read_member(stream)
                except ValueError as error:
                    others[name] = shown(str(error), 80)
                    continue
                members[name] = member
                columns |= _columns(name, member)
                if len(columns) > MOST_COLUMNS:
                    raise BadInput(Place(str(path)), f"more than {MOST_COLUMNS} columns", EXPECTED, code="LOG010")
    except _FAULTS as error:
        raise _damaged(path, error) from None
    others = {name: why for name, why in others.items() if name not in columns}
    if not columns:
        words = ", ".join(f"{shown(name)} ({why})" for name, why in list(others.items())[:3]) or "no array"
        raise BadInput(Place(str(path)), f"no vector among its members: {words}", EXPECTED, code="LOG001")
    return NpzSource(path, data, columns, members, others, allowance)


def _columns(name: str, member: Member) -> dict[str, _Column]:
    """The columns of an array of one or two dimensions; none of a single number."""
    if member.dtype.names:
        return {f"{name}.{field}": _Column(name, field) for field in member.dtype.names}
    if len(member.shape) == 2 and 1 not in member.shape:
        count = min(member.shape[1], MOST_COLUMNS + 1)
        return {f"{name}.{k + 1}": _Column(name, index=k) for k in range(count)}
    return {name: _Column(name)} if member.shape else {}


def _exactly(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise ValueError("an array that is cut off")
    if stream.read(1):
        raise ValueError("an array that is longer than it says")
    return data


def _refuse_large_directory(path: Path, data: bytes) -> None:
    """Refuse an archive whose list of members would fill the memory: ``zipfile`` reads it whole."""
    at = len(data) - _END.size
    if at < 0 or data[at : at + 4] != b"PK\5\6" or data[-2:] != b"\0\0":
        at = data.rfind(b"PK\5\6", max(0, len(data) - (1 << 16) - _END.size))
    if at < 0 or at + _END.size > len(data):
        raise BadInput(Place(str(path)), "not a zip archive, or an incomplete one", EXPECTED, code="LOG001")
    size = _END.unpack_from(data, at)[5]
    if size > LARGEST_DIRECTORY or data[max(0, at - 20) : max(0, at - 20) + 4] == b"PK\6\7":
        raise BadInput(
            Place(str(path)),
            "an archive of too many files",
            f"{EXPECTED}; at most a few thousand of them",
            code="LOG010",
        )


def _damaged(path: Path, error: Exception, member: str = "") -> BadInput:
    name = shown(member) if member else ""
    return BadInput(
        Place(str(path), None, name), f"a damaged archive ({shown(str(error), 80)})", EXPECTED, code="LOG001"
    )
