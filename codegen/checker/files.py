"""Files that a certificate or a person names: regular files of a stated size and nothing else; and the form of JSON."""

import errno
import os
import stat
from pathlib import Path
from typing import Any

MAX_FILE = 50_000_000


def read(path: Path, largest: int = MAX_FILE) -> bytes:
    """The bytes of a regular file, at most ``largest``; nothing waits for the writer of a pipe. Raises OSError."""
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "no regular file", str(path))
        content = file.read(largest + 1)
        if content is None:  # some files of /proc count as regular and wait like a pipe
            raise OSError(errno.EAGAIN, "nothing to read", str(path))
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"more than {largest} bytes", str(path))
    return content


def named(names: Any, form: dict[str, Any]) -> bool:
    """Whether these are the names of a form; those with a ? behind them may be missing."""
    return {x for x in form if x[-1:] != "?"} <= {*names} <= {x.rstrip("?") for x in form}


def formed(raw: Any, form: Any) -> bool:
    """Whether JSON has the types of a form: "" a text, [form] a list, {"": form} an object of any names, None anything.

    Another object is one of just these names (``named``). A text for a list would be read as one of its characters.
    """
    if isinstance(form, list):
        return type(raw) is list and all(formed(x, form[0]) for x in raw)
    if isinstance(form, dict):
        of = {x.rstrip("?"): part for x, part in form.items()}
        good = type(raw) is dict and ("" in form or named(raw, form))
        return good and all(formed(x, of[name if name in of else ""]) for name, x in raw.items())
    return form is None or type(raw) is str
