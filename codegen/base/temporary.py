"""Temporary files and folders of a run, locked while in use; a later run removes those of a killed one.

A file or folder is removed only if this user owns it, its name is one that ``_new_name`` makes, and no process holds
its lock. The operating system releases a lock when the process that holds it ends, however it ends.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import IO, Any, ParamSpec, TypeVar

from codegen.base.errors import BadInput

Given = ParamSpec("Given")
Result = TypeVar("Result")

fcntl: Any = import_module("fcntl") if os.name == "posix" else None
"""None on a system without these locks; leftover files are not removed there."""
_NAME = re.compile(r"\.?stiction-([0-9a-f]{16})-[0-9a-f]{8}\.tmp")
"""Form of the names that ``_new_name`` makes."""
_LOCK = "lock"
"""Name of the locked file in a temporary folder."""
_OPEN = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
"""Flags of os.open."""
UNKNOWN_USER = 65534
"""The user id that Linux shows for an owner outside the user namespace (overflow uid), as in a container."""


def temporary_file(folder: Path) -> tuple[Path, IO[bytes]]:
    """Make a hidden file in a folder, readable for this user only, opened, and locked until it is closed.

    Raises OSError if the folder cannot be written.
    """
    while True:
        path = folder / _new_name(".stiction")
        stream = os.fdopen(os.open(path, _OPEN | os.O_CREAT | os.O_EXCL, 0o600), "w+b")
        if _still_there(path, stream.fileno()):
            return path, stream
        stream.close()


def take_place(temporary: Path, stream: IO[bytes], target: Path) -> None:
    """Rename a temporary file to its target, which it replaces; its permissions become those of a new file.

    Raises OSError if it cannot be written completely or renamed.
    """
    stream.flush()
    temporary.chmod(new_file_mode())
    if fcntl is None:
        stream.close()  # an open file cannot be renamed there
    temporary.replace(target)


def new_file_mode() -> int:
    """The permissions that a new file would get."""
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


@contextmanager
def private_folder() -> Iterator[Path]:
    """A new folder in the temporary directory that only this user can read or write; removed at the end.

    Raises BadInput if it cannot be made, or if another user could replace it.
    """
    home = temporary_directory()
    refuse_replaceable(home)
    sweep_folders(home)
    try:
        folder, handle = _new_folder(home)
    except OSError as error:
        found = f"cannot be written ({error.strerror})"
        raise BadInput(str(home), found, "a temporary directory, or TMPDIR", code="FILE007") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(handle)


def temporary_directory() -> Path:
    """The system's temporary directory, or that of TMPDIR. Raises BadInput if none can be written."""
    try:
        return Path(tempfile.gettempdir())
    except OSError:
        found = "no temporary directory that can be written"
        raise BadInput("TMPDIR", found, "one, such as /tmp", code="FILE007") from None


def _new_folder(home: Path) -> tuple[Path, int]:
    """A new folder, and the handle of the locked file in it."""
    while True:
        folder = home / _new_name("stiction")
        folder.mkdir(mode=0o700)
        try:
            handle = os.open(folder / _LOCK, _OPEN | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError:
            folder.rmdir()
            raise
        if _still_there(folder / _LOCK, handle):
            return folder, handle
        os.close(handle)


def sweep_files(folder: Path) -> None:
    """Remove the temporary files that a killed run left in a folder."""
    for entry in _ours(folder, ".stiction"):
        if entry.is_file(follow_symlinks=False):
            _remove_if_free(Path(entry), Path(entry))


def sweep_folders(home: Path) -> None:
    """Remove the temporary folders that a killed run left in the temporary directory."""
    for entry in _ours(home, "stiction"):
        if entry.is_dir(follow_symlinks=False):
            _remove_if_free(Path(entry), Path(entry) / _LOCK)


def refuse_replaceable(folder: Path) -> None:
    """Raise BadInput where another user could rename or replace a folder or one above it."""
    if not hasattr(os, "getuid"):
        return
    where = folder.resolve()
    for step in (where, *where.parents):
        found = step.stat()
        alone = found.st_gid == 0 or (found.st_gid == os.getgid() == os.getuid())  # a group of one member
        shared = found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and not alone)
        if found.st_uid not in (0, os.getuid(), UNKNOWN_USER) or (shared and not found.st_mode & stat.S_ISVTX):
            found_there = "a folder in which other users may rename files, so compiled code in it could be replaced"
            expected = "a temporary directory such as /tmp with its sticky bit, or TMPDIR set to a folder of your own"
            raise BadInput(str(step), found_there, expected, code="FILE007")


def _new_name(head: str, random: str = "") -> str:
    """A name for a temporary file: head, random part, and eight digits of a hash of it, which ``_named`` checks."""
    random = random or secrets.token_hex(8)
    return f"{head}-{random}-{hashlib.sha256(f'stiction {random}'.encode()).hexdigest()[:8]}.tmp"


def _ours(folder: Path, head: str) -> list[os.DirEntry[str]]:
    """The entries of a folder that ``_new_name`` named and this user owns."""
    if fcntl is None:
        return []
    try:
        with os.scandir(folder) as entries:
            return [e for e in entries if _named(e.name, head) and e.stat(follow_symlinks=False).st_uid == os.getuid()]
    except OSError:
        return []


def _named(name: str, head: str) -> bool:
    """Whether ``_new_name`` made a name: it has this head and the right hash."""
    found = _NAME.fullmatch(name)
    return found is not None and name == _new_name(head, found[1])


def _remove_if_free(path: Path, lock: Path) -> None:
    """Remove a file or folder unless a process holds its lock, or the file system has no locks."""
    with suppress(OSError):
        handle = os.open(lock, _OPEN)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is(lock, handle):
                shutil.rmtree(path) if path != lock else path.unlink()
        finally:
            os.close(handle)


def _still_there(path: Path, handle: int) -> bool:
    """Lock a new file; False if another run removed it before it was locked."""
    if fcntl is not None:
        with suppress(OSError):  # a file system without locks, on which nothing is removed either
            fcntl.flock(handle, fcntl.LOCK_EX)
    return _is(path, handle)


def _is(path: Path, handle: int) -> bool:
    """Whether a path still names an open file."""
    try:
        return os.path.samestat(path.lstat(), os.fstat(handle))
    except OSError:
        return False


def in_temporary_folder(work: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorator of a function that writes temporary files: an OSError about these, as of a full disk, is BadInput."""

    @wraps(work)
    def guarded(*given: Given.args, **named: Given.kwargs) -> Result:
        try:
            return work(*given, **named)
        except OSError as error:
            found = f"cannot be used ({error.strerror or error})"
            expected = "a temporary folder that is writable and has free space (TMPDIR)"
            raise BadInput("the temporary folder", found, expected, code="FILE007") from None

    return guarded
