"""A library of an extra, called on a stranger's file: named where it is absent, bounded, and its faults one message."""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import logging
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput, Place
from codegen.base.user_text import shown

MOST_MEMORY = 2_000_000_000
"""Bytes that a library may take at once for a file, whatever the file states of itself."""


def library(module: str, extra: str, path: Path) -> Any:
    """A module of an extra.

    Raises:
        BadInput: where it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        found = f"a log that needs the package `{module.partition('.')[0]}`, which cannot be imported ({error})"
        expected = f"it installed: pip install 'stiction[{extra}]'"
        raise BadInput(Place(str(path)), found, expected, code="TOOL003") from None


@contextlib.contextmanager
def reading(path: Path, expected: str) -> Iterator[None]:
    """Around calls of a library on a file: at most so much memory, nothing on the screen, one error.

    A library meets a damaged file with whatever exception its next line raises; all of them mean the same here.

    Raises:
        BadInput: for every exception but BadInput itself.
    """
    place = Place(str(path))
    with _bounded(), _quiet():
        try:
            yield
        except BadInput:
            raise
        except Exception as error:
            words = shown(str(error).strip(), 100) or "no words"
            found = f"a damaged file ({type(error).__name__}: {words})"
            if isinstance(error, MemoryError):
                found = f"a file whose reading takes more than {MOST_MEMORY} bytes"
            _release(error)
            raise BadInput(place, found, expected, code="LOG001") from None


def _release(error: BaseException | None) -> None:
    """Let go of what a library left half made while its complaints about that are not shown."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__
    gc.collect()


@contextlib.contextmanager
def _bounded() -> Iterator[None]:
    """A limit of the address space: compressed data that swell beyond it end in MemoryError.

    None without /proc, as outside Linux: the lengths that a file states are checked all the same.
    """
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
def _quiet() -> Iterator[None]:
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
