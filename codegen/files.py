"""Files written whole or not at all."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from codegen.errors import BadInput


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


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
        BadInput: if a target is a folder, or a folder cannot be made or written.
    """
    waiting: dict[Path, Path] = {}
    path = folder
    try:
        for name, text in files.items():
            path = folder / name
            if path.is_dir():
                raise BadInput(str(path), "cannot be written (a folder is there)", "a file, or nothing")
            path.parent.mkdir(parents=True, exist_ok=True)
            waiting[path] = _temporary(path, text)
        for path, temporary in waiting.items():
            temporary.replace(path)
    except OSError as error:
        raise BadInput(str(path), f"cannot be written ({error.strerror})", "a folder that can be written") from None
    finally:
        for temporary in waiting.values():
            temporary.unlink(missing_ok=True)


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
