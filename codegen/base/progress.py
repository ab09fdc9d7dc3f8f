"""Progress display of a command: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

LINE_S = 5.0
"""Least time between two lines about the same step of the work, s."""
SMALLEST_SHARE = 0.001
"""Growth of the share of the work of which a caller's function for progress is told."""
CALL_S = 1.0
"""Most seconds between two calls of it while the work goes on."""
LOADING = "loading the libraries"
"""The first step of a verb, before its spec is read."""


class ProgressCallback(Protocol):
    """Callback for progress: called with the name of the current step and the share of the work done, 0 to 1.

    A share of 0 means that a step begins and that its share of the work is not known.
    """

    def __call__(self, step: str, share: float) -> None: ...

    def above(self, show: Callable[[], None]) -> None:
        """Call ``show``, which prints, with the bar removed from the screen; the bar continues below the text."""


_display: ContextVar[Callable[[str, float], None] | None] = ContextVar("display", default=None)


def begin(step: str) -> None:
    """Show that a step begins, such as ``reading the spec``; without an open display nothing is shown."""
    display = _display.get()
    if display is not None:
        display(step, 0.0)


def never_falling(progress: Callable[[str, float], None]) -> Callable[[str, float], None]:
    """``progress``, called with the largest share so far in place of a smaller one, and by one thread at a time.

    The number of rounds of a search is not known before it ends, so that a share computed from it may be too large.
    ``progress`` is called where the step changes or the share grows by ``SMALLEST_SHARE``, and once in ``CALL_S`` all
    the same, since it may end the work by an exception.
    """
    largest, reported, last, lock = 0.0, ("", -1.0), 0.0, Lock()

    def report(step: str, share: float) -> None:
        nonlocal largest, reported, last
        with lock:
            largest = max(largest, share)
            now = time.monotonic()
            if step != reported[0] or largest - reported[1] >= SMALLEST_SHARE or now - last >= CALL_S:
                reported, last = (step, largest), now
                progress(step, largest)

    return report


def part_of(progress: Callable[[str, float], None], start: float, end: float) -> Callable[[str, float], None]:
    """The progress of a part of the work: its share s is the share ``start`` + s (``end`` − ``start``) of the whole."""
    return lambda step, share: progress(step, start + share * (end - start))


_share: ContextVar[Callable[[float], None] | None] = ContextVar("share", default=None)


def share_display() -> Callable[[float], None]:
    """The function to call with the share done, 0 to 1, of the part of the work that ``shares_to`` has begun."""
    return _share.get() or (lambda share: None)


@contextmanager
def shares_to(display: Callable[[float], None]) -> Iterator[None]:
    """A context, a part of the work, whose share done ``share_display`` gives to ``display``."""
    token = _share.set(display)
    try:
        yield
    finally:
        _share.reset(token)


@contextmanager
def steps_to(display: Callable[[str, float], None] | None) -> Iterator[None]:
    """A context within which ``begin`` reports to ``display``; None changes nothing."""
    token = _display.set(display or _display.get())
    try:
        yield
    finally:
        _display.reset(token)


@contextmanager
def progress(lines: bool = False) -> Iterator[ProgressCallback]:
    """Show progress while the context is open: a bar on a terminal; elsewhere lines on stderr, or nothing.

    The first step shown is ``LOADING``. So a verb opens the context before it imports its modules. ``lines``: whether
    to print lines where stderr is no terminal: one for each new step, when it begins, and one every ``LINE_S`` seconds.
    """
    from codegen.base.terminal import errors

    if lines and not errors.is_terminal:
        yield from _opened(_Lines(errors.print))
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:20}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as bar:
        yield from _opened(_Bar(bar, bar.add_task("", total=None)))


def _opened(display: ProgressCallback) -> Iterator[ProgressCallback]:
    """The display, to which ``begin`` reports, with the step ``LOADING`` begun."""
    with steps_to(display):
        begin(LOADING)
        yield display


class _Bar:
    """Progress as a bar, which stays where it is as a step begins; before the first share it has no end."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        self._bar, self._task = bar, task

    def __call__(self, step: str, share: float) -> None:
        self._bar.update(self._task, description=step)
        if share:
            self._bar.update(self._task, total=1.0, completed=share)

    def above(self, show: Callable[[], None]) -> None:
        self._bar.stop()
        show()
        self._bar.start()


class _Lines:
    """Progress as plain lines: ``reading the spec ...`` where a step begins, ``refit, 5 %`` with a known share."""

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show, self._last, self._step = show, 0.0, ""

    def __call__(self, step: str, share: float) -> None:
        now = time.monotonic()
        if share < 1 and (step != self._step or now - self._last >= LINE_S):
            self._last, self._step = now, step
            self._show(f"{step}, {100 * share:.0f} %" if share else f"{step} ...")

    def above(self, show: Callable[[], None]) -> None:
        show()
