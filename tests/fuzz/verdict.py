"""One call of the tool on damaged input, judged: a result, one clear error, or a failure.

A clear error is one line that names a file of the case, says what was found and what was expected, and is not long. Any
other exception, a warning, other text on the screen, and a call that takes too long or too much memory are failures.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import FrameType

from codegen.base.errors import BadInput
from codegen.checker.verify import Refused
from tests.app.command import without_steps

LONGEST_MESSAGE = 1000
MOST_LINES = 21
MOST_SECONDS = 30.0
"""Of processor time; a case that is in order takes a tenth of a second."""
ENDINGS = (0, 3, 4, 5, 6)
"""Exit statuses of a result: done, refused, stale, verified without the code."""
PROJECT = str(Path(__file__).parents[2] / "codegen")
HIDDEN = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)
"""Warnings that Python shows to no user of a program."""


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes:
        kind: ``result``, ``error`` (clear), or the class of a failure: ``exception``, ``message``, ``screen``,
            ``slow``, ``memory``, ``left`` (a temporary file); ``crash`` and ``hang`` are found by the process
            that watches.
        words: the message, or what went wrong.
        spot: of a failure: the exception and the last function of ours that it came through; alike for one fault.
    """

    kind: str
    words: str = ""
    spot: str = ""

    @property
    def failed(self) -> bool:
        return self.kind not in ("result", "error")


class TooLong(BaseException):
    """The watchdog's; no ``except Exception`` holds it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise TooLong when that much processor time is spent."""

    def stop(_: int, __: FrameType | None) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)  # again each second, where a library caught the first
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def judged(call: Callable[[], object], files: Collection[str], seconds: float = MOST_SECONDS) -> Verdict:
    """Call it and judge what happens.

    Args:
        call: a verb, or a function of the library that reads a file of a user.
        files: the names of which a message says one.
        seconds: of processor time that the call may take.
    """
    out, err = StringIO(), StringIO()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for kind in HIDDEN:
                warnings.simplefilter("ignore", kind)
            with redirect_stdout(out), redirect_stderr(err), limited(seconds):
                code = _exit_code(call)
    except BadInput as error:
        return message(f"error: {' '.join(str(error).split())}", files)
    except Refused as error:
        return message(f"error: {next(iter(files))}: {error}; expected a proof", files)
    except TooLong as error:
        return Verdict("slow", f"more than {seconds:g} s", spot_of(error))
    except MemoryError as error:
        return Verdict("memory", "out of memory", spot_of(error))
    except Exception as error:
        return Verdict("exception", f"{type(error).__name__}: {error}"[:300], spot_of(error))
    said = without_steps(err.getvalue())
    if caught:
        first = caught[0]
        where = f"{Path(first.filename).parent.name}/{Path(first.filename).name}"
        return Verdict("screen", str(first.message)[:300], f"{first.category.__name__} {where}:{first.lineno}")
    if code == 2:
        return message(said.rstrip("\n"), files)
    told = [line for line in said.splitlines() if not line.startswith(("warning: ", "note: ", "  "))]
    if code not in ENDINGS or (code != 3 and told):
        return Verdict("screen", f"exit {code}: {said}"[:300], f"exit {code}")
    return Verdict("result")


def message(text: str, files: Collection[str]) -> Verdict:
    """Whether each line of an error, one a fault, is clear."""
    lines = text.split("\n")
    if len(lines) > MOST_LINES:
        return Verdict("message", f"{len(lines)} lines: {text[:300]!r}", "too many lines")
    if len(lines) == MOST_LINES and lines[-1].endswith("which are shown once these are corrected"):
        lines.pop()
    verdicts = [_line(line, files) for line in lines]
    return next((v for v in verdicts if v.failed), Verdict("error", text))


def _line(text: str, files: Collection[str]) -> Verdict:
    faults = {
        "longer than a reader reads": len(text) > LONGEST_MESSAGE,
        "unprintable characters": not text.isprintable(),
        "no `error: `": not text.startswith("error: "),
        "nothing expected": "; expected " not in text and ": not a certificate: " not in text,
        "no file named": not any(name in text for name in files),
        "a traceback": "Traceback" in text,
    }
    wrong = next((fault for fault, there in faults.items() if there), None)
    if wrong is None:
        return Verdict("error", text)
    return Verdict("message", f"{wrong}: {text[:300]!r} ({len(text)} characters)", f"{wrong}: {text[:40]!r}")


def spot_of(error: BaseException) -> str:
    """The class of an exception and the innermost function of the project that it came through."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(PROJECT)]
    inner = f"{os.path.relpath(frames[-1].filename, PROJECT)}:{frames[-1].name}" if frames else "outside"
    return f"{type(error).__name__} {inner}"


def _exit_code(call: Callable[[], object]) -> int:
    try:
        call()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException as error:
        code = getattr(error, "exit_code", None)  # typer.Exit, where a command is called without its frame
        if code is None:
            raise
        return int(code)
    return 0


def through_main(*arguments: object) -> Callable[[], None]:
    """The command as a user gives it."""
    from codegen.app.cli import main

    def call() -> None:
        before, sys.argv = sys.argv, ["stiction", *map(str, arguments)]
        try:
            main()
        finally:
            sys.argv = before

    return call
