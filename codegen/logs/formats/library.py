"""Calls of libraries on untrusted files: limited in memory, without output, and cleaned up after errors."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

MOST_MEMORY = 2_000_000_000
"""Most memory of a library for a file, in bytes."""


def release(error: BaseException | None) -> None:
    """Free the objects that a failed call of a library left, while its warnings about them are suppressed."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__
    gc.collect()


@contextlib.contextmanager
def bounded() -> Iterator[None]:
    """Limit the address space, so that compressed data that become too large raise MemoryError."""
    pages = _pages()
    if pages is None:
        yield
        return
    import resource  # Unix alone has it

    used = pages * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    known = [limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([used + MOST_MEMORY, *known]), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _pages() -> int | None:
    """The size of this process's address space in pages, as Linux states it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0])
    except (OSError, ValueError, IndexError):
        return None


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Suppress what the library prints, logs or warns of."""
    before, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
        ):
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
        sys.unraisablehook = hook
