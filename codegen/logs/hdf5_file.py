"""HDF5 logs, and MATLAB's format 7.3, which is HDF5: a dataset a column, or a table whose columns go by number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.source import LARGEST_STREAM, Allowance, Columns, ColumnsOfFile, listing, shown

EXPECTED = "an HDF5 log: a dataset of numbers for each column, or tables N × columns"
ROWS = 1 << 16
MOST_COLUMNS, MOST_DEEP, MOST_WIDE = 20_000, 20, 256


@dataclass(frozen=True)
class _Column:
    """A column: of a dataset of ``rows`` rows the whole, a field, or one of its columns or (``across``) rows."""

    dataset: str
    rows: int
    field: str = ""
    index: int | None = None
    across: bool = False


@dataclass(frozen=True)
class Hdf5Source(ColumnsOfFile):
    """An opened file; a dataset in groups goes by its path, ``data/demo_0/obs/joint_pos[2]``."""

    columns: Mapping[str, _Column]
    allowance: Allowance

    def load(self, wanted: Sequence[str]) -> Columns:
        """All rows of the wanted columns.

        Raises:
            BadInput: for columns of different length, a damaged file, or too many numbers.
        """
        rows = {name: self.columns[name].rows for name in wanted}
        first = wanted[0]
        for name, count in rows.items():
            if count != rows[first]:
                expected = f"{rows[first]} as in `{shown(first)}`"
                raise BadInput(Place(str(self.path), None, shown(name, 80)), f"{count} values", expected, code="LOG011")
        self.allowance.take(self.path, 8 * rows[first] * len(wanted), EXPECTED)
        values = np.empty((rows[first], len(wanted)))
        with opened(self.path, EXPECTED, LARGEST_STREAM) as stream, reading(self.path, EXPECTED):
            file = _file(stream)
            for start in range(0, rows[first], ROWS):
                part = slice(start, min(start + ROWS, rows[first]))
                for j, name in enumerate(wanted):
                    values[part, j] = _values(file, self.columns[name], part)
        return Columns(str(self.path), tuple(wanted), values, None)


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, perhaps behind MATLAB's 512 bytes."""
    with opened(path, EXPECTED, LARGEST_STREAM) as stream:
        head = stream.read(520)
    return b"\x89HDF\r\n\x1a\n" in (head[:8], head[512:])


def open_hdf5(path: Path, allowance: Allowance, description: LogDescription) -> Hdf5Source:
    """Open a file and find its datasets; links to other files are not followed, and objects are not made.

    Raises:
        BadInput: where its library is not installed, or for a file that is none, damaged or without numbers.
    """
    library("h5py", "hdf5", path)
    columns: dict[str, _Column] = {}
    unread: dict[str, str] = {}
    with opened(path, EXPECTED, LARGEST_STREAM) as stream, reading(path, EXPECTED):
        for name, dataset in _datasets(_file(stream), "", set()):
            found = _columns(name, dataset)
            if isinstance(found, str):
                unread[name] = found
            else:
                columns |= found
            if len(columns) + len(unread) > MOST_COLUMNS:
                raise BadInput(
                    Place(str(path)), f"more than {MOST_COLUMNS} datasets and columns", EXPECTED, code="LOG010"
                )
    if not columns:
        words = f"{listing(list(unread), 3)}: {next(iter(unread.values()))}" if unread else "no dataset"
        raise BadInput(Place(str(path)), f"no dataset of numbers ({words})", EXPECTED, code="LOG001")
    return Hdf5Source(path, columns, unread, allowance)


def _file(stream: Any) -> Any:
    """Through Python's own file, so that what was examined is what is read."""
    import h5py

    return h5py.File(stream, "r")


def _datasets(group: Any, path: str, seen: set[int]) -> Iterator[tuple[str, Any]]:
    """(path, dataset) of a group and those in it, each group once, along links within the file."""
    import h5py

    address = h5py.h5o.get_info(group.id).addr
    if address in seen or path.count("/") > MOST_DEEP:
        return
    seen.add(address)
    for name in group:
        if name.startswith("#"):  # MATLAB's store of what cells and objects refer to
            continue
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        found = group[name]
        if isinstance(found, h5py.Dataset):
            yield f"{path}{name}", found
        elif isinstance(found, h5py.Group):
            yield from _datasets(found, f"{path}{name}/", seen)


def _columns(name: str, dataset: Any) -> dict[str, _Column] | str:
    """The columns of a dataset, or why it has none."""
    if dataset.external or dataset.is_virtual:
        return "its numbers lie in other files"
    kind, shape = dataset.dtype, dataset.shape
    matlab = "MATLAB_class" in dataset.attrs
    if not shape or 0 in shape:
        return "a single value" if shape == () else "it is empty"
    if kind.names and len(shape) == 1:
        fields = [f for f in kind.names if kind[f].kind in "fiub" and not kind[f].shape]
        return {f"{name}.{f}": _Column(name, shape[0], field=f) for f in fields} or "it has no field of numbers"
    if kind.kind not in "fiub" or kind.names:
        return f"it holds {shown(str(kind))}, no numbers"
    if len(shape) == 1:
        return {name: _Column(name, shape[0])}
    if len(shape) != 2:
        return f"it has {len(shape)} dimensions"
    if 1 in shape:
        return {name: _Column(name, max(shape), index=0, across=shape[0] == 1)}
    across = matlab  # MATLAB writes its N × c as c × N
    rows, count = (shape[1], shape[0]) if across else shape
    if count > MOST_WIDE:
        return f"it has {count} columns"
    return {f"{name}[{k}]": _Column(name, rows, index=k, across=across) for k in range(count)}


def _values(file: Any, column: _Column, part: slice) -> Any:
    dataset = file[column.dataset]
    if column.field:
        return dataset.fields(column.field)[part]
    if column.index is None:
        return dataset[part]
    return dataset[column.index, part] if column.across else dataset[part, column.index]
