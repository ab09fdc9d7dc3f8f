"""Cache of compiled libraries, in a folder of the temporary directory that only this user can write.

A cached file is the SHA-256 of a library in hexadecimal, a line end, and the library. The verified bytes are loaded,
never the file itself.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from codegen.base.compiler import FLAGS, compile_shared, find_compiler
from codegen.base.errors import BadInput
from codegen.base.files import sha256, write_all
from codegen.base.temporary import refuse_replaceable, temporary_directory

FOLDER = "stiction-libraries"
LARGEST = 1 << 28
"""Bytes: largest library that is cached."""


def cached_library(sources: Mapping[str, str], units: Sequence[str]) -> bytes:
    """The shared library of these sources; compiled at first use, or where the cached one is damaged.

    Raises:
        BadInput: where there is no compiler, or it refuses the code.
    """
    compiler = find_compiler() or ()
    parts = [*compiler, "", *FLAGS, *units, *(f"{name}\0{sources[name]}" for name in sorted(sources))]
    folder = _folder()
    if folder is None:
        return compile_shared(sources, units)
    kept = folder / f"{sha256(chr(1).join(parts))}.library"
    library = _checked(kept)
    if library is None:
        library = compile_shared(sources, units)
        with suppress(BadInput):  # not cached, for example on a full disk
            write_all(folder, {kept.name: _digest(library) + library})
    return library


def _checked(kept: Path) -> bytes | None:
    """The library of a cached file; None where its hash does not match."""
    try:
        found = kept.lstat()
        content = kept.read_bytes() if stat.S_ISREG(found.st_mode) and found.st_size <= LARGEST else b""
    except OSError:
        return None
    length = len(_digest(b""))
    library = content[length:]
    return library if library and content[:length] == _digest(library) else None


def _digest(library: bytes) -> bytes:
    return f"{hashlib.sha256(library).hexdigest()}\n".encode()


def _folder() -> Path | None:
    """The cache folder, owned by and writable for this user alone; None where that is not possible."""
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = temporary_directory() / f"{FOLDER}-{owner}"
    try:
        refuse_replaceable(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except (OSError, BadInput):
        return None
    ours = stat.S_ISDIR(found.st_mode)
    if hasattr(os, "getuid"):
        ours = ours and found.st_uid == owner and not found.st_mode & 0o077
    return folder if ours else None
