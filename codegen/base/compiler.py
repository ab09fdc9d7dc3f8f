"""Compilation of generated C with the local compiler, a cache of the results, and loading of shared libraries.

The library computes the same bits as the Python twin.
"""

import ctypes
import hashlib
import os
import shlex
import shutil
import stat
import subprocess
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Literal

from codegen.base.errors import BadInput
from codegen.base.files import sha256, write_all
from codegen.base.temporary import private_folder, refuse_replaceable, temporary_directory

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", "-s")
"""Compiler options. The library has no debug data and no path, so that the same sources give the same bytes."""
LONGEST_MESSAGE = 400
"""Largest number of characters of the compiler's messages that an error quotes."""


def find_compiler() -> tuple[str, ...]:
    """The compiler's command, as a list of words: that of the variable CC, else the first of cc, gcc and clang found.

    Raises BadInput where there is none, or CC names a command that cannot be used.
    """
    named = os.environ.get("CC", "").strip()
    if not named:
        first = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
        if first is None:
            expected = "cc, gcc or clang (Debian: apt install gcc), or the variable CC with the command of another"
            raise BadInput("the C compiler", "none on the path", expected, code="TOOL001")
        return (first,)
    expected = "a C compiler on the path and its options, such as `gcc` or `ccache gcc -m64`; or no CC"
    try:
        program, *options = shlex.split(named)
    except ValueError as error:
        raise BadInput("CC", f"`{named}` ({error})", expected, code="TOOL001") from None
    found = shutil.which(program)
    if found is None:
        raise BadInput("CC", f"`{named}`, but no program `{program}` can be run", expected, code="TOOL001")
    return (found, *options)


def compile_shared(sources: Mapping[str, str], units: Sequence[str], flags: Sequence[str] = ()) -> bytes:
    """Compile C files into a shared library, in a folder that only this user can write; BadInput if that fails.

    Args:
        sources: file name → text, headers included.
        flags: in addition to ``FLAGS``.
    """
    compiler = find_compiler()
    with private_folder() as folder:
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [*compiler, *FLAGS, *flags, "-o", "made.so", *units, "-lm"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
        except OSError as error:
            raise BadInput(
                shlex.join(compiler), f"cannot be run ({error.strerror})", "a C compiler", code="TOOL001"
            ) from None
        target = folder / "made.so"
        if done.returncode == 0 and not target.is_file():
            chosen = "CC names it; " if os.environ.get("CC", "").strip() else ""
            found = f"{chosen}the compiler reported no error but wrote no library"
            raise BadInput(shlex.join(compiler), found, "a C99 compiler", code="TOOL001")
        if done.returncode != 0:
            said = " ".join(done.stderr.split())[:LONGEST_MESSAGE] or f"exit {done.returncode}"
            found = f"`{' '.join(units)}` does not compile: {said}"
            raise BadInput(shlex.join(compiler), found, "a C99 compiler", code="TOOL002")
        return target.read_bytes()


def load_library(library: bytes) -> ctypes.CDLL:
    """A shared library that this run compiled, or whose hash it checked, loaded from a folder of this user alone.

    Raises BadInput if it cannot be loaded.
    """
    with private_folder() as folder:
        path = folder / "made.so"
        path.write_bytes(library)
        try:
            return ctypes.CDLL(str(path))
        except OSError as error:
            expected = "a compiler for this machine, and a temporary directory (TMPDIR) in which programs may run"
            found = f"compiled code cannot be loaded there ({error})"
            raise BadInput(str(folder.parent), found, expected, code="TOOL002") from None


KEPT_LIBRARIES = 32
"""Most libraries of ``loaded`` that a process keeps, the most recently used ones."""


@lru_cache(maxsize=KEPT_LIBRARIES)
def loaded(source: str, flags: tuple[str, ...]) -> ctypes.CDLL:
    """The library of one C file, from the cache or compiled, and loaded; the runs of a search ask for the same.

    ``flags`` are added to ``FLAGS``. Raises BadInput where the code cannot be compiled or loaded.
    """
    return load_library(cached_library({"made.c": source}, ["made.c"], flags))


FOLDER = "stiction-libraries"
"""Beginning of the name of the cache folder in the temporary directory; the user's id follows."""
LARGEST = 1 << 28
"""Largest size of a cached file that is read, bytes."""
MOST_CACHED = 1 << 27
"""Largest size of the cache, bytes; above it the least recently used results are removed."""
SWEPT = 16
"""The size of the cache is computed when a process caches its first result, and again after each MOST_CACHED/SWEPT
bytes. The cache may have thousands of files, and to list them takes as long as one compilation."""
_uncounted: dict[Path, int] = {}
"""Cache folder → bytes added since its size was computed."""


def cached_library(sources: Mapping[str, str], units: Sequence[str], flags: Sequence[str] = ()) -> bytes:
    """The shared library of these sources; compiled at first use, by another compiler, or where it is damaged.

    The arguments and errors are those of ``compile_shared``.
    """
    texts = (f"{name}\0{sources[name]}" for name in sorted(sources))
    compiler = find_compiler()
    status = Path(compiler[0]).stat()  # another version at the same path differs in these
    parts = [*compiler, f"{status.st_size} {status.st_mtime_ns}", *FLAGS, *flags, "", *units, *texts]
    return cached(parts, lambda: compile_shared(sources, units, flags))


def cached(parts: Sequence[str], make: Callable[[], bytes], kind: Literal["library", "template"] = "library") -> bytes:
    """The result of a compilation, from the cache of this user; compiled where it is not cached, or damaged there.

    Args:
        parts: all texts that the result depends on (compiler, flags, sources); a hash of them is the cache's key.
        make: compiles it.
        kind: the end of the file's name.
    """
    folder = _folder()
    if folder is None:
        return make()
    kept = folder / f"{sha256(chr(1).join(parts))}.{kind}"
    found = _checked(kept)
    if found is not None:
        with suppress(OSError):  # removed by another run
            os.utime(kept)
        return found
    made = make()
    with suppress(BadInput, OSError):  # not cached, for example on a full disk
        write_all(folder, {kept.name: _digest(made) + made})
        _uncounted[folder] = _uncounted.get(folder, MOST_CACHED) + len(made)
        if _uncounted[folder] > MOST_CACHED / SWEPT:
            _uncounted[folder] = 0
            _remove_oldest(folder)
    return made


def _remove_oldest(folder: Path) -> None:
    """Remove cached results, the least recently used first, until the rest has at most ``MOST_CACHED`` bytes."""
    found = []
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith((".library", ".template")):
                with suppress(OSError):  # removed by another run
                    status = entry.stat(follow_symlinks=False)
                    found.append((status.st_mtime_ns, status.st_size, entry.path))
    size = sum(bytes_ for _, bytes_, _ in found)
    for _, bytes_, path in sorted(found) if size > MOST_CACHED else ():
        if size <= MOST_CACHED:
            return
        with suppress(OSError):
            Path(path).unlink()
        size -= bytes_


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
    """The first line of a cached file: the SHA-256 of the result that follows."""
    return f"{hashlib.sha256(library).hexdigest()}\n".encode()


def _folder() -> Path | None:
    """The cache folder, owned by and writable for this user alone; None where that is not possible."""
    owner = os.getuid() if hasattr(os, "getuid") else 0
    try:
        folder = temporary_directory() / f"{FOLDER}-{owner}"
        refuse_replaceable(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except (OSError, BadInput):
        return None
    ours = stat.S_ISDIR(found.st_mode)
    if hasattr(os, "getuid"):
        ours = ours and found.st_uid == owner and not found.st_mode & 0o077
    return folder if ours else None
