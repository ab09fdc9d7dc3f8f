"""Files written whole or not at all, and none that was not ours to write."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from codegen.base.errors import BadInput
from codegen.base.input_files import identity, is_there, unusable_name
from codegen.base.temporary import sweep_files, take_place, temporary_file


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def named_path(text: str) -> Path:
    """The path that an option gives. Raises BadInput for an empty one, which would be the current folder."""
    if not text:
        raise BadInput("-o", "an empty name", "a file or folder; `.` for this folder", code="FILE005")
    return Path(text)


def refuse_target(path: Path, sources: Mapping[str, Path] | None = None, endings: Sequence[str] = ()) -> None:
    """Raise BadInput, before any work is done, where a file must or can not be written.

    Args:
        sources: what the command reads, in words → file; a target is none of them.
        endings: that a target may have; any where there are none.
    """
    fault = unusable_name(path)
    if fault is not None:
        raise BadInput(str(path), fault, "a name in UTF-8 for what is written", code="FILE005")
    try:
        _refuse_target(path, sources or {}, endings)
    except OSError as error:  # a name that is too long, or a folder that must not be searched
        raise BadInput(
            str(path), f"cannot be written ({error.strerror})", "a folder that can be written", code="FILE003"
        ) from None


def _refuse_target(path: Path, sources: Mapping[str, Path], endings: Sequence[str]) -> None:
    _refuse_special(path)
    for what, source in sources.items():
        same = is_there(path) and is_there(source) and path.samefile(source)
        if same or identity(path) == identity(source):
            raise BadInput(str(path), what, "another file to write", code="FILE004")
    if endings and path.suffix.lower() not in endings:
        raise BadInput(
            str(path), f"the ending `{path.suffix}`", f"a file ending in {' or '.join(endings)}", code="FILE005"
        )
    standing = next(folder for folder in path.absolute().parents if folder.exists())
    if not standing.is_dir():
        named = path.parents[path.absolute().parents.index(standing)]
        raise BadInput(
            str(named),
            "cannot be written (a file of that name exists)",
            "a folder, or a name that is free",
            code="FILE003",
        )
    if not os.access(standing, os.W_OK | os.X_OK):
        raise BadInput(
            str(path), "cannot be written (Permission denied)", "a folder that can be written", code="FILE003"
        )


def refuse_foreign(folder: Path, name: str, marks: Sequence[str]) -> None:
    """Raise BadInput where a folder has ``name`` but none of the files ``marks``, which we write with it."""
    if is_there(folder / name) and not any(is_there(folder / mark) for mark in marks):
        raise BadInput(
            str(folder / name), "a file that stiction did not write", "another folder for the results", code="FILE004"
        )


def remove(path: Path) -> None:
    """Remove a file of ours. Raises BadInput where it cannot be."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise BadInput(
            str(path), f"cannot be removed ({error.strerror})", "a folder that can be written", code="FILE003"
        ) from None


def write_atomically(path: Path, text: str) -> None:
    """Write through a temporary file beside the target, so that no reader ever sees half a file.

    Raises:
        BadInput: if the folder cannot be made or written.
    """
    write_all(path.parent, {path.name: text})


def write_all(folder: Path, files: Mapping[str, str | bytes] | Mapping[str, str], marks: Sequence[str] = ()) -> None:
    """Write several files: all are written beside their targets before the first takes its place.

    Nothing else in the folder is touched.

    Args:
        files: name, or path below the folder → text, or the bytes of a picture.
        marks: names by which a later run knows that the others are ours. They take their places first, so that a run
            that is killed leaves nothing that the next would take for another's.

    Raises:
        BadInput: if a target is a folder or a device, or a folder cannot be made or written.
    """
    waiting: dict[Path, tuple[Path, IO[bytes]]] = {}
    path = folder
    try:
        for name, text in files.items():
            path = folder / name
            _refuse_special(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.parent not in {other.parent for other in waiting}:
                sweep_files(path.parent)
            waiting[path] = temporary_file(path.parent)
            waiting[path][1].write(text.encode() if isinstance(text, str) else text)
            waiting[path][1].flush()
        for path, (temporary, stream) in sorted(waiting.items(), key=lambda item: item[0].name not in marks):
            take_place(temporary, stream, path)
    except OSError as error:
        raise BadInput(
            str(path), f"cannot be written ({error.strerror})", "a folder that can be written", code="FILE003"
        ) from None
    finally:
        for temporary, stream in waiting.values():
            temporary.unlink(missing_ok=True)
            with suppress(OSError):
                stream.close()


def _refuse_special(path: Path) -> None:
    if path.is_dir() or (path.exists() and not path.is_file()):
        there = "a folder" if path.is_dir() else "a device or a pipe"
        raise BadInput(
            str(path), f"cannot be written ({there} of that name exists)", "a file, or a free name", code="FILE003"
        )
