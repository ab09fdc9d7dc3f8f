"""The temporary directory, and private folders in it."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from codegen.base.errors import BadInput

UNKNOWN_USER = 65534
"""The user id that Linux shows for an owner outside the user namespace (overflow uid), as in a container."""


@contextmanager
def private_folder() -> Iterator[Path]:
    """A new folder in the temporary directory that only this user can read or write; removed at the end.

    Raises BadInput if another user could replace it, or for an OSError about its files, as of a full disk.
    """
    home = temporary_directory()
    refuse_replaceable(home)
    try:
        with tempfile.TemporaryDirectory(prefix="stiction-", dir=home, ignore_cleanup_errors=True) as name:
            yield Path(name)
    except OSError as error:
        found = f"cannot be used ({error.strerror or error})"
        expected = "a temporary directory that is writable and has free space, or TMPDIR"
        raise BadInput(str(home), found, expected, code="FILE007") from None


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
