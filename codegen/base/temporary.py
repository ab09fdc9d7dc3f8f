"""Temporary files and folders of a run.

A temporary file is hidden, in the folder of its target, and is locked while it is written; a folder is locked while it
is used. The operating system releases a lock when its process ends, however it ends, so a later run can remove what a
killed one left.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from codegen.base.errors import BadInput

fcntl: Any = import_module("fcntl") if os.name == "posix" else None
"""None on a system without these locks; leftover files are not removed there."""
_HEAD, _TAIL = ".stiction-", ".tmp"
_FOLDER = "stiction-"
_NAME = re.compile(rf"{re.escape(_HEAD)}[a-z0-9_]{{8}}{re.escape(_TAIL)}|{_FOLDER}[a-z0-9_]{{8}}")
"""Form of the names that ``tempfile`` makes of files and folders with these heads and this tail."""
_MARK = ".stiction"
"""Empty file made in a folder once it is locked. A folder with it and without a lock is that of a killed run."""
UNKNOWN_USER = 65534
"""The user id that Linux shows for an owner outside the user namespace (overflow uid), as in a container."""


def temporary_file(folder: Path) -> tuple[Path, IO[bytes]]:
    """Make a hidden file in a folder, readable for this user only, opened, and locked until it is closed.

    Raises OSError if the folder cannot be written.
    """
    while True:
        handle, name = tempfile.mkstemp(_TAIL, _HEAD, folder)
        path, stream = Path(name), os.fdopen(handle, "w+b")
        if fcntl is not None:
            with suppress(OSError):  # a file system without locks, on which nothing is removed either
                fcntl.flock(handle, fcntl.LOCK_EX)
        if _is(path, handle):  # else another run removed it before it was locked
            return path, stream
        stream.close()


def take_place(temporary: Path, stream: IO[bytes], target: Path) -> None:
    """Rename a temporary file to its target, which it replaces; its permissions become those of a new file.

    Raises OSError if it cannot be written completely or renamed.
    """
    stream.flush()
    umask = os.umask(0)
    os.umask(umask)
    temporary.chmod(0o666 & ~umask)
    if fcntl is None:
        stream.close()  # an open file cannot be renamed there
    temporary.replace(target)


def sweep(folder: Path) -> None:
    """Remove the temporary files and private folders of this user that a killed run left in a folder."""
    if fcntl is None:
        return
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if _NAME.fullmatch(entry.name) and (entry.is_file(follow_symlinks=False) or entry.is_dir()):
                with suppress(OSError):
                    _remove_if_free(Path(entry), entry.is_dir())


def _remove_if_free(path: Path, is_folder: bool) -> None:
    """Remove a file or a marked folder of this user.

    Raises OSError if a process holds its lock, it is a link, or the file system has no locks.
    """
    flags = os.O_RDONLY | os.O_DIRECTORY if is_folder else os.O_RDWR
    handle = os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.fstat(handle).st_uid != os.getuid() or not _is(path, handle):
            return
        if not is_folder:
            path.unlink()
        elif (path / _MARK).is_file():
            shutil.rmtree(path)
    finally:
        os.close(handle)


def _is(path: Path, handle: int) -> bool:
    """Whether a path still names an open file."""
    try:
        return os.path.samestat(path.lstat(), os.fstat(handle))
    except OSError:
        return False


@contextmanager
def private_folder() -> Iterator[Path]:
    """A new folder in the temporary directory that only this user can read or write; removed at the end.

    Folders that killed runs left there are removed first.

    Raises BadInput if another user could replace it, or for an OSError about its files, as of a full disk.
    """
    home = temporary_directory()
    refuse_replaceable(home)
    sweep(home)
    try:
        with tempfile.TemporaryDirectory(prefix=_FOLDER, dir=home, ignore_cleanup_errors=True) as name:
            folder = Path(name)
            with _locked(folder):
                yield folder
    except OSError as error:
        found = f"cannot be used ({error.strerror or error})"
        expected = "a temporary directory that is writable and has free space, or TMPDIR"
        raise BadInput(str(home), found, expected, code="FILE007") from None


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a folder, then mark it: without its mark it is not removed, so that no run removes one not yet locked.

    The lock also keeps systemd-tmpfiles from removing it (systemd-tmpfiles(8)).
    """
    if fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        with suppress(OSError):  # a file system without locks, on which nothing is removed either
            fcntl.flock(handle, fcntl.LOCK_EX)
            (folder / _MARK).touch()
        yield
    finally:
        os.close(handle)


def temporary_directory() -> Path:
    """The system's temporary directory, or that of TMPDIR. Raises BadInput if none can be written."""
    try:
        return Path(tempfile.gettempdir())
    except OSError:
        found = "no temporary directory that can be written"
        raise BadInput("TMPDIR", found, "one, such as /tmp", code="FILE007") from None


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
