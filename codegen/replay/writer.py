"""Files of estimates: written block by block, replacing the target only when complete; and read again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.base.files import Waiting, refuse_ending, refuse_target

Add = Callable[[Array, Array, NDArray[np.intc]], None]
"""Takes the times, estimates and fault flags of a block."""


@contextmanager
def open_writer(path: Path | None, columns: Sequence[str], flagged: bool) -> Iterator[Add]:
    """Context with a function that writes blocks to a file, whose format is given by its ending.

    If the work in the context fails, the target stays as it was.

    Args:
        path: None writes nothing.
        flagged: whether the fault flags are written too.

    Raises:
        BadInput: for another ending than .csv and .npy, or a folder that cannot be made or written.
    """
    if path is None:
        yield lambda time, estimates, faults: None
        return
    writers = {".csv": _csv_writer, ".npy": _npy_writer}
    refuse_ending(path, writers)
    refuse_target(path)
    with Waiting(path, "a folder that can be written, with room") as file:
        add, end = writers[path.suffix.lower()](file, columns, flagged)
        yield add
        end()
        file.take_place()


def read_estimates(path: Path) -> dict[str, Array]:
    """The columns of a file that ``open_writer`` wrote, by name: ``t`` in s, the estimates, and ``fault``; read-only.

    Raises BadInput if it cannot be read.
    """
    try:
        if path.suffix.lower() == ".npy":
            table = np.load(path)
            if table.dtype.names is None:
                raise ValueError("an array without names of columns")
            return _read_only({name: table[name] for name in table.dtype.names})
        with path.open(encoding="utf-8") as file:
            names = file.readline().strip().split(",")
            if names[0] != "t":
                raise ValueError(f"`{names[0]}` in place of the column `t`")
            columns = np.loadtxt(file, delimiter=",", ndmin=2, comments=None).T
    except (OSError, ValueError) as error:
        raise BadInput(str(path), f"unreadable ({error})", "the estimates that replay wrote", code="FILE001") from None
    return _read_only(
        {
            name: column.astype(np.intc) if name == "fault" else column.copy()
            for name, column in zip(names, columns, strict=True)
        }
    )


def _read_only(columns: dict[str, Array]) -> dict[str, Array]:
    """The columns, which a result keeps, so a change of one in place would be in all later readings of the result."""
    for column in columns.values():
        column.setflags(write=False)
    return columns


def _csv_writer(file: Waiting, columns: Sequence[str], flagged: bool) -> tuple[Add, Callable[[], None]]:
    """Writer of CSV in the format of a simulated log: a header, then numbers in the shortest round-trip form."""
    names = ["t", *columns, *(["fault"] if flagged else [])]
    file.write(f"{','.join(names)}\n".encode())

    def add(time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        lines = [",".join(map(repr, row)) for row in np.column_stack([time, estimates]).tolist()]
        if flagged:
            lines = [f"{line},{flag}" for line, flag in zip(lines, faults.tolist(), strict=True)]
        file.write(("\n".join(lines) + "\n").encode())

    return add, lambda: None


def _npy_writer(file: Waiting, columns: Sequence[str], flagged: bool) -> tuple[Add, Callable[[], None]]:
    """Writer of a structured .npy array."""
    names = ["t", *columns]
    dtype = np.dtype([*((name, "<f8") for name in names), *([("fault", "<i4")] if flagged else [])])
    rows = 0

    def head() -> None:
        """Write the header; NumPy pads it, so that it can be replaced by one with the final length."""
        described = {"descr": dtype.descr, "fortran_order": False, "shape": (rows,)}
        np.lib.format.write_array_header_2_0(file, described)

    def add(time: Array, estimates: Array, faults: NDArray[np.intc]) -> None:
        nonlocal rows
        rows += len(time)
        block = np.empty(len(time), dtype=dtype)
        for name, values in zip(names, (time, *estimates.T), strict=True):
            block[name] = values
        if flagged:
            block["fault"] = faults
        file.write(block.tobytes())

    def end() -> None:
        file.stream.seek(0)
        head()

    head()
    return add, end
