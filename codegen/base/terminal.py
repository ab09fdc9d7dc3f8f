"""Consoles to which commands print results (stdout) and errors (stderr)."""

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from textwrap import fill
from typing import Any

from rich.console import Console

from codegen.base.user_text import terminal_text


class PlainConsole(Console):
    """A console that prints text without markup, with control characters written as escapes."""

    def __init__(self, stderr: bool = False) -> None:
        super().__init__(stderr=stderr, soft_wrap=True, highlight=False, markup=False, emoji=False)

    def print(self, *objects: Any, **options: Any) -> None:
        super().print(*(terminal_text(o) if isinstance(o, str) else o for o in objects), **options)

    def fitted(self, text: str) -> str:
        """The text with its lines broken at the width of the screen, the rest of each indented by two more.

        In a pipe or a file every line stays as it is.
        """
        return "\n".join(map(self._broken, text.split("\n"))) if self.is_terminal else text

    def _broken(self, line: str) -> str:
        indented = " " * (len(line) - len(line.lstrip()) + 2)
        if len(line) <= self.width:
            return line
        return fill(line, self.width, subsequent_indent=indented, break_on_hyphens=False)


output = PlainConsole()
"""Console of results."""
errors = PlainConsole(stderr=True)
"""Console of errors and progress."""


@contextmanager
def without_library_warnings() -> Iterator[None]:
    """No warnings of libraries on the screen of a command; all of them where Python was asked for some (-W)."""
    before = logging.root.manager.disable
    with warnings.catch_warnings():
        if not sys.warnoptions:
            warnings.simplefilter("ignore")
            logging.disable(logging.WARNING)
        try:
            yield
        finally:
            logging.disable(before)
