"""Arrays in memory as a log: they are written to a temporary .npz file, which is read as a file of the user's is."""

import io
import re
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from codegen.base.border import Arrays
from codegen.base.errors import BadInput, Place
from codegen.base.temporary import private_folder
from codegen.base.user_text import shown

Given = str | Path | Arrays
"""A log as a caller in Python gives it: its file, or arrays by the names of columns."""


@contextmanager
def as_files(**given: Given | Sequence[Given] | None) -> Iterator[list[list[Path]]]:
    """The files of the logs of each argument; those of arrays are temporary.

    Errors in the context about such a file name the argument in its place.

    Args:
        given: argument of the caller → its logs.

    Raises:
        BadInput: for a column that is no array of numbers or of times.
    """
    arguments = {argument: _listed(logs) for argument, logs in given.items()}
    if all(isinstance(log, str | Path) for logs in arguments.values() for log in logs):
        yield [[Path(str(log)) for log in logs] for logs in arguments.values()]
        return
    with private_folder() as folder:
        names: dict[str, str] = {}  # temporary file → the argument
        files: list[list[Path]] = []
        try:
            for argument, logs in arguments.items():
                files.append([])
                for k, log in enumerate(logs):
                    several = len(logs) > 1
                    path = (
                        Path(str(log))
                        if isinstance(log, str | Path)
                        else folder / f"{argument}{k + 1 if several else ''}.npz"
                    )
                    if not isinstance(log, str | Path):
                        names[str(path)] = f"`{argument}[{k}]`" if several else f"`{argument}`"
                        path.write_bytes(_archive(log, path))
                    files[-1].append(path)
            yield files
        except BadInput as fault:
            for one in fault.all:
                one.reword(
                    lambda at: Place(_renamed(at.file, names), at.line, at.key), lambda text: _renamed(text, names)
                )
            raise


def _listed(logs: Given | Sequence[Given] | None) -> Sequence[Given]:
    if logs is None:
        return ()
    return logs if isinstance(logs, Sequence) and not isinstance(logs, str) else (logs,)


def _renamed(text: str, names: dict[str, str]) -> str:
    for path, name in names.items():
        text = text.replace(path, name)
    return text


def _archive(log: Arrays, path: Path) -> bytes:
    """The bytes of an .npz archive of arrays, without dates: the same arrays give the same bytes.

    Raises BadInput, about the file ``path``, for a column whose name or values cannot be stored.
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for key in log.keys():  # noqa: SIM118 - a DataFrame has keys, and iterates over them as a mapping does
            name = str(key)
            if not name or re.search(r"[\0/\\]", name):
                raise BadInput(
                    Place(str(path)), f"a column named `{shown(name)}`", "a name without slashes", code="LOG004"
                )
            values = _numbers(log[key], Place(str(path), None, shown(name)))
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                npy_format.write_array(member, values, allow_pickle=False)
    return stream.getvalue()


def _numbers(given: Any, place: Place) -> NDArray[Any]:
    """Numbers as they are, NaN where they are masked; dates in seconds from the first, and durations in seconds.

    Raises BadInput for other values, and for quantities with a unit, which NumPy would drop.
    """
    unit = getattr(given, "units", getattr(given, "unit", None))
    if unit is not None and hasattr(given, "to"):  # of pint or astropy; dates of pandas have a unit too
        found = f"a quantity in {shown(str(unit))}"
        raise BadInput(place, found, "plain numbers in SI, or in the unit that `description` states", code="LOG005")
    if isinstance(given, np.ma.MaskedArray):
        given = np.where(np.ma.getmaskarray(given), np.nan, given.data)
    values = np.asarray(given)
    if values.dtype.kind in "mM":
        elapsed = values - values[0] if values.dtype.kind == "M" and values.size else values
        return np.asarray(elapsed / np.timedelta64(1, "s"))
    if values.dtype.kind not in "fiub":
        raise BadInput(place, f"an array of the type {values.dtype}", "numbers, or dates of NumPy", code="LOG005")
    return values
