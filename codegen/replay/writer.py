"""Writers of estimates to a file, block by block; the file replaces its target only when it is complete."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np
from numpy.typing import NDArray

from codegen.base.errors import BadInput
from codegen.base.files import refuse_target, write_atomically
from codegen.base.temporary import sweep_files, take_place, temporary_file

Array = NDArray[np.float64]
Column = tuple[str, str]
"""Name and unit."""


class Nowhere:
    """Writer that discards everything."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        return None

    def add(self, time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        return None


class _InPlace(ABC):
    """Temporary file next to its target; it replaces the target on success and is removed on failure.

    Raises:
        BadInput: if the folder cannot be made or written.
    """

    def __init__(self, path: Path, columns: Sequence[Column], flagged: bool) -> None:
        self.path, self.columns, self.flagged = path, list(columns), flagged
        self.rows = 0
        try:
            refuse_target(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            sweep_files(path.parent)
            waiting, stream = temporary_file(path.parent)
        except OSError as error:
            raise _unwritable(path, error) from None
        self._waiting: Path = waiting
        self.stream: IO[bytes] = stream

    def __enter__(self) -> Self:
        self._guarded(self._begin)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        waiting = self._waiting
        try:
            if kind is None:
                self._guarded(self._end)
                self._guarded(lambda: take_place(waiting, self.stream, self.path))
        finally:
            self.stream.close()
            waiting.unlink(missing_ok=True)

    def add(self, time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        self.rows += len(time)
        self._guarded(lambda: self._append(time, estimates, faults))

    def _guarded(self, work: Callable[[], None]) -> None:
        try:
            work()
        except OSError as error:
            raise _unwritable(self.path, error) from None

    @abstractmethod
    def _begin(self) -> None:
        """Write the header."""

    @abstractmethod
    def _append(self, time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        """One block, as ``add`` takes it."""

    def _end(self) -> None:
        return None


class CsvWriter(_InPlace):
    """CSV in the format of a simulated log: a header, then numbers in the shortest round-trip form."""

    def _begin(self) -> None:
        names = ["t", *(name for name, _ in self.columns), *(["fault"] if self.flagged else [])]
        self.stream.write(f"{','.join(names)}\n".encode())

    def _append(self, time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        table = np.column_stack([time, estimates]).tolist()
        lines = [",".join(map(repr, row)) for row in table]
        if self.flagged:
            lines = [f"{line},{flag}" for line, flag in zip(lines, faults.tolist(), strict=True)]
        self.stream.write(("\n".join(lines) + "\n").encode())


class NpyWriter(_InPlace):
    """A structured .npy array, and its units in a JSON file next to it."""

    def _begin(self) -> None:
        fields: list[tuple[str, str]] = [("t", "<f8"), *((name, "<f8") for name, _ in self.columns)]
        self.dtype = np.dtype([*fields, ("fault", "<i4")] if self.flagged else fields)
        self._head()

    def _head(self) -> None:
        """Write the header; NumPy leaves room in it for a larger length."""
        described = {"descr": self.dtype.descr, "fortran_order": False, "shape": (self.rows,)}
        np.lib.format.write_array_header_2_0(self.stream, described)

    def _append(self, time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        block = np.empty(len(time), dtype=self.dtype)
        block["t"] = time
        for k, (name, _) in enumerate(self.columns):
            block[name] = estimates[:, k]
        if self.flagged:
            block["fault"] = faults
        self.stream.write(block.tobytes())

    def _end(self) -> None:
        self.stream.seek(0)
        self._head()
        units = {"t": "s", **dict(self.columns)} | ({"fault": "1"} if self.flagged else {})
        write_atomically(self.path.with_name(f"{self.path.name}.json"), json.dumps({"units": units}, indent=1) + "\n")


def open_writer(path: Path | None, columns: Sequence[Column], flagged: bool) -> Nowhere | CsvWriter | NpyWriter:
    """The writer for a file's ending.

    Raises:
        BadInput: for another ending than .csv and .npy, or a folder that cannot be written.
    """
    if path is None:
        return Nowhere()
    kinds: dict[str, type[CsvWriter] | type[NpyWriter]] = {".csv": CsvWriter, ".npy": NpyWriter}
    kind = kinds.get(path.suffix.lower())
    if kind is None:
        raise BadInput(
            str(path), f"the ending `{path.suffix}`", f"a file ending in {' or '.join(kinds)}", code="FILE005"
        )
    return kind(path, columns, flagged)


def _unwritable(path: Path, error: OSError) -> BadInput:
    return BadInput(
        str(path), f"cannot be written ({error.strerror})", "a folder that can be written, with room", code="FILE003"
    )
