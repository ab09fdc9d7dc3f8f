"""Reading of the files that a user names: only regular files up to a stated size are opened."""

import os
import stat
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import IO

from codegen.base.errors import BadInput, Place, nearest_name

LARGEST_TEXT = 500_000
"""Largest size in bytes of a text that a person writes: a spec, a log description, a file of effects.

Parsing YAML of this size takes 2 to 4 s. The parser's time is quadratic in the length of a comment and of a
run of empty lines: 14 s for twice the size.
"""
LARGEST_GENERATED = 50_000_000
"""Largest size in bytes of a file that this tool wrote earlier."""
MOST_NAMES = 1000
"""Most files of a folder among which the one that was meant is sought."""
SAME_KIND = ((".yaml", ".yml"), (".csv", ".tsv", ".txt"))
"""Endings of files of one kind."""
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOCTTY", 0)
_FLAGS |= getattr(os, "O_BINARY", 0)


def opened(path: Path, expected: str, largest: int, named_at: Place | None = None) -> IO[bytes]:
    """A regular file, opened for reading.

    The checks are made on the open file, so it cannot be replaced between check and reading. Opening does not wait, not
    even for a named pipe.

    Args:
        expected: what the file should be, for messages.
        largest: greatest admissible size in bytes.
        named_at: where the user named the file, if that was in another file.

    Raises:
        BadInput: if it is absent, unreadable, not a regular file, too large, or its name is not UTF-8.
    """
    place = named_at or Place(str(path))
    what = f"`{path}`: " if named_at else ""
    fault = unusable_name(path)
    if fault is not None:
        raise BadInput(place, f"{what}{fault}", expected, code="FILE001")
    try:
        handle = os.open(path, _FLAGS)
    except (FileNotFoundError, NotADirectoryError):
        nearest = None if named_at else alike(path)
        raise BadInput(place, f"{what}no such file", expected, nearest, code="FILE001") from None
    except OSError as error:
        with suppress(OSError, ValueError):  # a folder or a device, as far as that can be determined
            fault = _kind(path.stat().st_mode)
        fault = fault or f"unreadable ({error.strerror})"
        raise BadInput(place, f"{what}{fault}", expected, code="FILE001") from None
    try:
        found = os.fstat(handle)
        fault = _kind(found.st_mode)
        if fault is not None:
            raise BadInput(place, f"{what}{fault}", expected, code="FILE001")
        if found.st_size > largest:
            most = f"{expected} of at most {largest} bytes"
            raise BadInput(place, f"{what}{found.st_size} bytes", most, code="FILE002")
        return os.fdopen(handle, "rb")
    except OSError as error:
        os.close(handle)
        raise BadInput(place, f"{what}unreadable ({error.strerror})", expected, code="FILE001") from None
    except BadInput:
        os.close(handle)
        raise


def read_bytes(path: Path, expected: str, largest: int, named_at: Place | None = None) -> bytes:
    """The bytes of a regular file; arguments and errors as of ``opened``."""
    place = named_at or Place(str(path))
    with opened(path, expected, largest, named_at) as stream:
        try:
            data = stream.read(largest + 1)
        except OSError as error:
            raise BadInput(place, f"unreadable ({error.strerror})", expected, code="FILE001") from None
    if data is None or len(data) > largest:  # a file that grows, or has no size, as those of /proc
        found = "a file that grows while it is read, or states no size"
        raise BadInput(place, found, f"{expected} of at most {largest} bytes", code="FILE002")
    return data


def read_text(path: Path, expected: str, largest: int = LARGEST_TEXT) -> str:
    """The text of a regular file. Raises BadInput as ``opened``, and if it is not UTF-8."""
    data = read_bytes(path, expected, largest)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        found, wanted = f"byte {error.start} is not UTF-8", f"{expected}; save it as UTF-8"
        raise BadInput(Place(str(path), line), found, wanted, code="FILE006") from None


def read_or_none(path: Path) -> str | None:
    """The text of a regular file, or None where there is none that can be read."""
    try:
        return read_text(path, "text", LARGEST_GENERATED)
    except BadInput:
        return None


def unusable_name(path: str | Path) -> str | None:
    """Why a path cannot be used: a zero byte, or a name that is not UTF-8; None if it can."""
    try:
        return "a name with a zero byte" if b"\0" in str(path).encode() else None
    except UnicodeEncodeError:
        return "a name that is not UTF-8"


def is_there(path: Path) -> bool:
    """Whether a path exists; False also if its name is invalid or its folder cannot be searched."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def alike(path: Path) -> str | None:
    """The file in the folder of a missing one with the most similar name and an ending of its kind; or None."""
    endings = next((kind for kind in SAME_KIND if path.suffix in kind), (path.suffix,))
    try:
        files = [Path(x.name) for x in islice(path.parent.iterdir(), MOST_NAMES) if x.suffix in endings]
    except (OSError, ValueError):
        return None
    files.sort(key=lambda file: (file.suffix != path.suffix, file))
    nearest = nearest_name(path.stem, dict.fromkeys(file.stem for file in files))
    meant = next((file.name for file in files if file.stem == nearest), None)
    return meant and str(path.with_name(meant))


def identity(path: str | Path) -> str:
    """The path with all links resolved: two names of the same file have equal ones."""
    try:
        return os.path.realpath(path)
    except (OSError, ValueError):
        return str(path)


def _kind(mode: int) -> str | None:
    """The kind of a file that is not a regular one, in words; None for a regular file."""
    if stat.S_ISREG(mode):
        return None
    return "a folder" if stat.S_ISDIR(mode) else "a device or a pipe"
