"""Ctrl-C that a library turned into an error of its own, distinguished from a fault.

CasADi's wrappers, interrupted within C++, raise NotImplementedError or RuntimeError in place of KeyboardInterrupt. The
command looks here before it calls an error a fault of the tool.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from signal import SIGINT, default_int_handler, getsignal, signal

_asked = False


def interrupted() -> bool:
    """Whether Ctrl-C was pressed while it was ``noted``."""
    return _asked


@contextmanager
def noted() -> Iterator[None]:
    """Within it Ctrl-C raises KeyboardInterrupt as ever, and is remembered.

    Nothing is changed outside the main thread, or where somebody handles or ignores it already.
    """
    global _asked
    _asked = False
    if getsignal(SIGINT) is not default_int_handler:
        yield
        return
    try:
        signal(SIGINT, _note)
    except ValueError:  # not the main thread
        yield
        return
    try:
        yield
    finally:
        signal(SIGINT, default_int_handler)


def _note(number: int, frame: object) -> None:
    global _asked
    _asked = True
    raise KeyboardInterrupt
