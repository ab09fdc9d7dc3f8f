"""Files that a certificate or a person names, read by Python alone: regular files of a stated size and nothing else."""

import errno
import os
import stat
from pathlib import Path

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
