"""Record of Ctrl-C, to tell an interrupted computation from an internal error.

CasADi, interrupted within C++, raises NotImplementedError or RuntimeError in place of KeyboardInterrupt. So before a
command reports an unexpected exception as an internal error, it asks ``interrupted`` whether Ctrl-C was pressed.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from signal import SIGINT, default_int_handler, getsignal, signal

_asked = False
"""Whether Ctrl-C was pressed."""


def interrupted() -> bool:
    """Whether Ctrl-C was pressed within a ``noted`` context."""
    return _asked


@contextmanager
def on_interrupt(handler: Callable[..., object]) -> Iterator[None]:
    """A context within which Ctrl-C calls ``handler``; outside the main thread it changes nothing."""
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
def interrupts_noted() -> Iterator[None]:
    """A context within which Ctrl-C raises KeyboardInterrupt as usual and is recorded for ``interrupted``.

    It changes nothing where another handler of Ctrl-C is installed.
    """
    global _asked
    _asked = False
    with on_interrupt(_note) if getsignal(SIGINT) is default_int_handler else nullcontext():
        yield


def _note(number: int, frame: object) -> None:
    """Signal handler: record Ctrl-C and raise KeyboardInterrupt."""
    global _asked
    _asked = True
    raise KeyboardInterrupt
