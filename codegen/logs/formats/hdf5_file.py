"""HDF5 logs, and MATLAB's format 7.3, which is HDF5: a column for each dataset, field or column of a dataset."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from codegen.base.user_text import brief
from codegen.logs.formats.source import BlockFile, Columns, listing

ROWS = 1 << 16
MOST_COLUMNS, MOST_DEEP, MOST_WIDE = 20_000, 20, 256
UNPACKED = "in MATLAB, of a timeseries `t = ts.Time; q = ts.Data; save log t q`"
"""What to do with an object of MATLAB, such as a timeseries."""
MAGIC = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class _Column:
    """A column: a field of a dataset, or its numbers along one axis, which is None in ``at``."""

    dataset: str
    rows: int
    field: str = ""
    at: tuple[int | None, ...] = (None,)

    def chunk(self, file: Any) -> int:
        """Rows of a chunk, which HDF5 always unpacks whole; 0 for a dataset without chunks."""
        chunks = file[self.dataset].chunks or (0,)
        return int(chunks[self.at.index(None) if len(self.at) == len(chunks) else 0])

    def values(self, file: Any, part: slice) -> Any:
        dataset = file[self.dataset]
        if self.field:
            return dataset.fields(self.field)[part]
        return dataset[tuple(part if index is None else index for index in self.at)]


class Hdf5File(BlockFile):
    """An opened file; a dataset in groups is named by its path, ``data/obs/joint_pos[2]``; links are ignored."""

    expected = "an HDF5 log: a dataset of numbers for each column, or tables N × columns"

    def find(self) -> None:
        self._h5py = self.library("h5py", "hdf5")
        self._columns: dict[str, _Column] = {}
        with self.opened() as stream, self.reading():
            for name, dataset in self._datasets(self._h5py.File(stream, "r")):
                found = _columns(name, dataset)
                if isinstance(found, str):
                    self.unread[name] = found
                else:
                    self._columns |= found
                if len(self._columns) + len(self.unread) > MOST_COLUMNS:
                    raise self.fault(f"more than {MOST_COLUMNS} datasets and columns", code="LOG010")
        self.names = tuple(self._columns)
        if not self.names:
            why = [f"{listing(list(self.unread), 3)}: {why}" for why in self.unread.values()]
            raise self.fault(f"no dataset of numbers ({why[0] if why else 'no dataset'})")

    def load(self, wanted: Sequence[str]) -> Columns:
        self.require_equal({name: self._columns[name].rows for name in wanted})
        self.rows = self._columns[wanted[0]].rows
        return super().load(wanted)

    def blocks(self, wanted: Sequence[str]) -> Iterator[Columns]:
        with self.opened() as stream:
            with self.reading():
                file = self._h5py.File(stream, "r")
                step = max(ROWS, *(self._columns[name].chunk(file) for name in wanted))
            for start in range(0, self.rows, step):
                part = slice(start, min(start + step, self.rows))
                values = np.empty((part.stop - start, len(wanted)))
                with self.reading():
                    for j, name in enumerate(wanted):
                        values[:, j] = self._columns[name].values(file, part)
                yield Columns(str(self.path), tuple(wanted), values)

    def _datasets(self, file: Any) -> Iterator[tuple[str, Any]]:
        """(path, dataset) of a file.

        MATLAB stores cells and arrays of structs as datasets of references. Their targets are counted as in MATLAB,
        whose order of elements is that of the file: ``log/signals/values(2)``.
        """
        h5py, seen, later = self._h5py, set[int](), list[tuple[str, Any]]()
        yield from self._of(file, "", seen, later)
        for path, dataset in later:  # which grows
            if len(later) > MOST_COLUMNS:
                raise self.fault(f"more than {MOST_COLUMNS} datasets of references", code="LOG010")
            address = h5py.h5o.get_info(dataset.id).addr
            if address not in seen:
                seen.add(address)
                for k, reference in enumerate(dataset[()].ravel()):
                    if isinstance(reference, h5py.Reference) and reference:
                        name = f"{path}({k + 1})"
                        try:
                            found = file[reference]
                        except (KeyError, ValueError):  # as h5py tells of an object that is not there
                            self.unread[name] = "what it refers to was removed from the file"
                            continue
                        yield from self._of(found, name, seen, later)

    def _of(self, found: Any, path: str, seen: set[int], later: list[tuple[str, Any]]) -> Iterator[tuple[str, Any]]:
        """(path, dataset) of an object and its subgroups; each group once, also with links within the file.

        Datasets of references are added to ``later``, so that a group is called by its own path first.
        """
        h5py = self._h5py
        if isinstance(found, h5py.Dataset):
            elsewhere = found.external or found.is_virtual
            if "ref" in (found.dtype.metadata or {}) and not elsewhere and 0 < found.size <= MOST_WIDE:
                later.append((path, found))  # a few references to objects of its own file
            else:
                yield path, found
        elif isinstance(found, h5py.Group):
            address = h5py.h5o.get_info(found.id).addr
            if address in seen or path.count("/") >= MOST_DEEP:
                return
            seen.add(address)
            for name in found:
                if name.startswith("#"):  # MATLAB's store of what cells and objects refer to
                    continue
                if isinstance(found.get(name, getlink=True), h5py.HardLink):
                    yield from self._of(found[name], f"{path}/{name}" if path else name, seen, later)


def _columns(name: str, dataset: Any) -> dict[str, _Column] | str:
    """The columns of a dataset, or in words why it has none."""
    if dataset.external or dataset.is_virtual:
        return "its numbers lie in other files"
    kind, shape, path = dataset.dtype, dataset.shape, str(dataset.name)
    if "MATLAB_object_decode" in dataset.attrs:
        return f"it is an object of MATLAB; {UNPACKED}"
    if not shape or 0 in shape:
        return "a single value" if shape == () else "it is empty"
    if kind.names and len(shape) == 1:
        fields = [f for f in kind.names if kind[f].kind in "fiub" and not kind[f].shape]
        return {f"{name}.{f}": _Column(path, shape[0], field=f) for f in fields} or "it has no field of numbers"
    if kind.kind not in "fiub" or kind.names:
        return f"it holds {brief(str(kind))}, no numbers"
    axes = [k for k, n in enumerate(shape) if n != 1] or [0]
    if len(axes) > 2:
        return f"it has {len(shape)} dimensions"

    def column(rows: int, index: int = 0) -> _Column:
        return _Column(
            path, shape[rows], at=tuple(None if k == rows else index if k in axes else 0 for k in range(len(shape)))
        )

    if len(axes) == 1:
        return {name: column(axes[0])}
    first, last = axes
    lying = "MATLAB_class" in dataset.attrs and shape[last] >= shape[first]  # MATLAB writes its N × c as c × N
    rows, others = (last, first) if lying else (first, last)
    if shape[others] > MOST_WIDE:
        return f"it has {shape[others]} columns"
    return {f"{name}[{k}]": column(rows, k) for k in range(shape[others])}
