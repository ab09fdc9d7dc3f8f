"""Arrays in memory as a log: they are written to a temporary .npz file, which is then read like any log file."""

import io
import os
import re
import zipfile
from collections.abc import Iterator, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from codegen.base.border import Arrays
from codegen.base.errors import BadInput, Place
from codegen.base.temporary import private_folder
from codegen.base.user_text import brief

Given = str | Path | Arrays
"""A log as a caller in Python gives it: its file, or arrays by the names of columns."""
FILE = (str, os.PathLike)
LONGEST_NAME = 1000
"""Characters of a column's name."""


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
    plain = [[Path(log) for log in logs if isinstance(log, FILE)] for logs in arguments.values()]
    if [len(logs) for logs in plain] == [len(logs) for logs in arguments.values()]:
        yield plain
        return
    names = {"meta.yaml beside the log": "the file that `description` names"}  # and a temporary file → the argument
    failed: OSError | None = None
    try:
        with private_folder() as folder:

            def file_of(log: Given, argument: str, number: str) -> Path:
                if isinstance(log, FILE):
                    return Path(log)
                path = folder / f"{argument}{number}.npz"
                names[str(path)] = f"`{argument}{f'[{int(number) - 1}]' if number else ''}`"
                path.write_bytes(_archive(log, path))
                return path

            files = [
                [file_of(log, argument, str(k) if len(logs) > 1 else "") for k, log in enumerate(logs, 1)]
                for argument, logs in arguments.items()
            ]
            try:
                yield files
            except OSError as error:  # of the caller's work, which private_folder would take for one about the folder
                failed = error
    except BadInput as fault:
        for one in fault.all:
            one.reword(lambda at: Place(_renamed(at.file, names), at.line, at.key), lambda text: _renamed(text, names))
        raise
    if failed is not None:
        raise failed


def _listed(logs: Given | Sequence[Given] | None) -> Sequence[Given]:
    if logs is None:
        return ()
    return tuple(logs) if isinstance(logs, Sequence | Set) and not isinstance(logs, str) else (logs,)


def _renamed(text: str, names: dict[str, str]) -> str:
    for path, name in names.items():
        text = text.replace(path, name)
    return text


def _archive(log: Arrays, path: Path) -> bytes:
    """The bytes of an .npz archive of arrays, without dates: the same arrays give the same bytes.

    Raises BadInput, about the file ``path``, for a column whose name or values cannot be stored.
    """
    if getattr(log, "ndim", 2) == 1:  # a Series of pandas has keys too
        expected = 'arrays by name, as {"t": t, "x": x}'
        raise BadInput(Place(str(path)), "a single column", expected, code="LOG003")
    try:
        columns = [(str(key), log[key]) for key in log.keys()]  # noqa: SIM118 - a DataFrame iterates over its keys too
        columns = _index(log, {name for name, _ in columns}) + columns
    except Exception as error:  # raised by the caller's own object, such as a closed archive
        found = f"arrays that cannot be read ({type(error).__name__}: {error})"
        raise BadInput(Place(str(path)), found, "arrays by the names of columns", code="LOG005") from None
    known: set[str] = set()
    for name, _ in columns:
        if not name or len(name) > LONGEST_NAME or re.search(r"[\0\\\ud800-\udfff]|\.\.|^/", name):
            found = f"a column named `{brief(name)}`"
            expected = f"a name of 1 to {LONGEST_NAME} letters, without `\\` and `..` and no `/` at its beginning"
            raise BadInput(Place(str(path)), found, expected, code="LOG004")
        if name in known:
            raise BadInput(Place(str(path)), f"two columns named `{brief(name)}`", "each name once", code="LOG004")
        known.add(name)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, given in columns:
            values = _numbers(given, Place(str(path), None, brief(name)))
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                npy_format.write_array(member, values, allow_pickle=False)
    return stream.getvalue()


def _index(log: Arrays, names: Set[str]) -> list[tuple[str, Any]]:
    """The index of a DataFrame, as a column, if it has a name or holds dates or durations, which are then ``t``.

    None where a column has this name, and for an index of text or of several levels.
    """
    index: Any = getattr(log, "index", None)
    kind = getattr(getattr(index, "dtype", None), "kind", "")
    if kind not in {*"fiumM"}:
        return []
    name = str(index.name) if index.name is not None else "t" if kind in "mM" else ""
    return [(name, index)] if name and name not in names else []


def _numbers(given: Any, place: Place) -> NDArray[Any]:
    """Numbers as they are, NaN where they are masked; dates in seconds from the first, and durations in seconds.

    Raises BadInput for other values, and for quantities with a unit, which NumPy would drop.
    """
    unit = getattr(given, "units", getattr(given, "unit", None))
    if unit is not None and hasattr(given, "to"):  # of pint or astropy; dates of pandas have a unit too
        found = f"a quantity in {brief(str(unit))}"
        raise BadInput(place, found, "plain numbers in SI, or in the unit that `description` states", code="LOG005")
    masked = np.ma.getmaskarray(given) if isinstance(given, np.ma.MaskedArray) else False
    zoned = getattr(getattr(given, "dtype", None), "tz", None) is not None  # of pandas; NumPy would make objects of it
    try:
        values = np.asarray(given, "datetime64[ns]" if zoned else None)
    except (TypeError, ValueError) as error:
        found = f"values of which NumPy makes no array ({error})"
        raise BadInput(place, found, "numbers, or dates of NumPy", code="LOG005") from None
    if values.dtype.kind == "M":
        known = values[~(np.isnat(values) | masked)]
        values = values - known[0] if known.size else values - values
    if values.dtype.kind == "m":
        values = np.asarray(values / np.timedelta64(1, "s"))
    if values.dtype.kind in "OUT" and values.size and isinstance(first := values.flat[0], str):
        way = '; pandas.read_csv takes `decimal=","`' if re.fullmatch(r"\s*[-+]?\d+,\d+\s*", first) else ""
        raise BadInput(place, f"text, such as `{brief(first)}`", f"numbers, or dates of NumPy{way}", code="LOG005")
    if values.dtype.kind not in "fiub":
        raise BadInput(place, f"an array of the type {values.dtype}", "numbers, or dates of NumPy", code="LOG005")
    return values if masked is False else np.where(masked, np.nan, values)
