"""Ctrl-C that a library turned into an error of its own, distinguished from a fault.

CasADi's wrappers, interrupted within C++, raise NotImplementedError or RuntimeError in place of KeyboardInterrupt. The
command looks here before it calls an error a fault of the tool.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from signal import SIGINT, default_int_handler, getsignal, signal

_asked = False


def interrupted() -> bool:
    """Whether Ctrl-C was pressed while it was ``noted``."""
    return _asked


@contextmanager
def handled(handler: Callable[..., object]) -> Iterator[None]:
    """Within it Ctrl-C calls a handler; outside the main thread nothing is changed."""
    try:
        before = signal(SIGINT, handler)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        signal(SIGINT, before)


@contextmanager
def noted() -> Iterator[None]:
    """Within it Ctrl-C raises KeyboardInterrupt as usual, and is remembered, unless it is already handled."""
    global _asked
    _asked = False
    with handled(_note) if getsignal(SIGINT) is default_int_handler else nullcontext():
        yield


def _note(number: int, frame: object) -> None:
    global _asked
    _asked = True
    raise KeyboardInterrupt
