"""Files written whole or not at all, and none that was not ours to write."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.errors import BadInput


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def named_path(text: str) -> Path:
    """The path that an option gives. Raises BadInput for an empty one, which would be the folder that one stands in."""
    if not text:
        raise BadInput("-o", "an empty name", "a file or folder; `.` for this folder")
    return Path(text)


def refuse_target(path: Path, sources: Mapping[str, Path] | None = None, endings: Sequence[str] = ()) -> None:
    """Raise BadInput, before any work is done, where a file must or can not be written.

    Args:
        sources: what the command reads, in words → file; a target is none of them.
        endings: that a target may have; any where there are none.
    """
    _refuse_special(path)
    for what, source in (sources or {}).items():
        if path.resolve() == source.resolve() or (path.exists() and source.exists() and path.samefile(source)):
            raise BadInput(str(path), what, "another file to write")
    if endings and path.suffix.lower() not in endings:
        raise BadInput(str(path), f"the ending `{path.suffix}`", f"a file ending in {' or '.join(endings)}")
    standing = next(folder for folder in path.absolute().parents if folder.exists())
    if not standing.is_dir():
        named = path.parents[path.absolute().parents.index(standing)]
        raise BadInput(str(named), "cannot be written (a file is there)", "a folder, or a name that is free")
    if not os.access(standing, os.W_OK | os.X_OK):
        raise BadInput(str(path), "cannot be written (Permission denied)", "a folder that can be written")


def refuse_foreign(folder: Path, name: str, marks: Sequence[str]) -> None:
    """Raise BadInput where ``name`` stands in a folder without one of the files ``marks``, which we write beside it."""
    if (folder / name).exists() and not any((folder / mark).exists() for mark in marks):
        raise BadInput(str(folder / name), "a file that stiction did not write", "another folder for the results")


def write_atomically(path: Path, text: str) -> None:
    """Write through a temporary file beside the target, so that no reader ever sees half a file.

    Raises:
        BadInput: if the folder cannot be made or written.
    """
    write_all(path.parent, {path.name: text})


def write_all(folder: Path, files: Mapping[str, str | bytes] | Mapping[str, str]) -> None:
    """Write several files: all are written beside their targets before the first takes its place.

    Nothing else in the folder is touched.

    Args:
        files: name, or path below the folder → text, or the bytes of a picture.

    Raises:
        BadInput: if a target is a folder or a device, or a folder cannot be made or written.
    """
    waiting: dict[Path, Path] = {}
    path = folder
    try:
        for name, text in files.items():
            path = folder / name
            _refuse_special(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            waiting[path] = _temporary(path, text)
        for path, temporary in waiting.items():
            temporary.replace(path)
    except OSError as error:
        raise BadInput(str(path), f"cannot be written ({error.strerror})", "a folder that can be written") from None
    finally:
        for temporary in waiting.values():
            temporary.unlink(missing_ok=True)


def _refuse_special(path: Path) -> None:
    if path.is_dir() or (path.exists() and not path.is_file()):
        there = "a folder" if path.is_dir() else "a device or a pipe"
        raise BadInput(str(path), f"cannot be written ({there} is there)", "a file, or nothing")


def new_file_mode() -> int:
    """The permissions that a new file would get."""
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


def _temporary(path: Path, content: str | bytes) -> Path:
    """The content in a hidden file beside its target, with the permissions that a new file would get."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
        temporary.chmod(new_file_mode())
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    return temporary
