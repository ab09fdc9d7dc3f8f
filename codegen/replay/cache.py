"""Compiled libraries kept between runs, in a folder of the temporary directory that only this user can write."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.compiler import FLAGS, compile_shared, find_compiler
from codegen.files import sha256, write_all

FOLDER = "stiction-libraries"


def cached_library(sources: Mapping[str, str], units: Sequence[str]) -> Path:
    """The shared library of these sources, compiled at their first use.

    Raises:
        BadInput: where there is no compiler, or it refuses the code.
    """
    compiler = find_compiler() or ""
    parts = [compiler, *FLAGS, *units, *(f"{name}\0{sources[name]}" for name in sorted(sources))]
    target = _folder() / f"{sha256(chr(1).join(parts))}.so"
    if not target.is_file():
        write_all(target.parent, {target.name: compile_shared(sources, units)})
    return target


def _folder() -> Path:
    """Ours alone: nobody else may put a library there for us to load; a new folder where that cannot be had."""
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"{FOLDER}-{owner}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="stiction-"))
    ours = folder.is_dir() and not folder.is_symlink()
    if hasattr(os, "getuid"):
        ours = ours and found.st_uid == owner and not found.st_mode & 0o022
    return folder if ours else Path(tempfile.mkdtemp(prefix="stiction-"))
