"""The local C compiler: generated C → a shared library, with the bits of the Python twin."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.errors import BadInput

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", "-s")
"""No debug data and no path in the result, so that the same sources give the same bytes."""
LONGEST_MESSAGE = 400


def find_compiler() -> str | None:
    """The compiler that CC names, or the first of cc, gcc and clang on the path; None where there is none."""
    named = os.environ.get("CC", "").strip()
    for name in (named,) if named else ("cc", "gcc", "clang"):
        found = shutil.which(name)
        if found is not None:
            return found
    return None


def compile_shared(sources: Mapping[str, str], units: Sequence[str], flags: Sequence[str] = ()) -> bytes:
    """Compile C files into a shared library.

    Args:
        sources: file name → text, headers included.
        units: the files to compile.
        flags: beside ``FLAGS``.

    Raises:
        BadInput: where there is no compiler, or it refuses the code.
    """
    compiler = find_compiler()
    if compiler is None:
        raise BadInput("the C compiler", "none on the path", "cc, gcc or clang (Debian: apt install gcc), or CC")
    with tempfile.TemporaryDirectory(prefix="stiction-") as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, *flags, "-o", "made.so", *units, "-lm"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
        except OSError as error:
            raise BadInput(compiler, f"cannot be run ({error.strerror})", "a C compiler") from None
        target = folder / "made.so"
        if done.returncode != 0 or not target.is_file():
            said = " ".join(done.stderr.split())[:LONGEST_MESSAGE] or f"exit {done.returncode}"
            raise BadInput(compiler, f"`{' '.join(units)}` does not compile: {said}", "a C99 compiler")
        return target.read_bytes()
