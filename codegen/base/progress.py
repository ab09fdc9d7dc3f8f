"""Progress display of a command: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from codegen.base.terminal import errors

LINE_S = 10.0
"""Least time between two lines about the same step, s."""


class ProgressCallback(Protocol):
    """Callback for progress: called with the name of the current step and the share of the work done, 0 to 1."""

    def __call__(self, station: str, share: float) -> None: ...

    def above(self, show: Callable[[], None]) -> None:
        """Call ``show``, which prints, with the bar removed from the screen; the bar continues below the text."""


@contextmanager
def progress(first: str = "", lines: bool = False) -> Iterator[ProgressCallback]:
    """Show progress while the context is open: a bar on a terminal; elsewhere lines on stderr, or nothing.

    Args:
        first: name of the step that the bar shows, without a share, until the first one is reported.
        lines: whether to print lines where stderr is no terminal: one for each new step, and one every ``LINE_S``
            seconds. A step reported at a share of 0 prints none, so that a command refused for bad input prints
            its error alone.
    """
    if lines and not errors.is_terminal:
        yield _Lines()
        return
    columns = (TextColumn("{task.description:20}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as bar:
        yield _Bar(bar, bar.add_task(first, total=None))


class _Bar:
    """Progress as a bar."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        self._bar, self._task = bar, task

    def __call__(self, station: str, share: float) -> None:
        self._bar.update(self._task, description=station, total=1.0, completed=share)

    def above(self, show: Callable[[], None]) -> None:
        self._bar.stop()
        show()
        self._bar.start()


class _Lines:
    """Progress as plain lines: `refit, 5 %`."""

    def __init__(self) -> None:
        self._last, self._station = 0.0, ""

    def __call__(self, station: str, share: float) -> None:
        now = time.monotonic()
        if 0 < share < 1 and (station != self._station or now - self._last >= LINE_S):
            self._last, self._station = now, station
            errors.print(f"{station}, {100 * share:.0f} %")

    def above(self, show: Callable[[], None]) -> None:
        show()
