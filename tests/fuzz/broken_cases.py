"""Calls that fail in every way that a campaign is to notice; nothing of the tool is in them."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable

from codegen.base.errors import BadInput

from .case import Case, Stage

FILE = "s.yaml"


def result() -> None:
    """Nothing is wrong."""


def error() -> None:
    raise BadInput(f"{FILE}:3", "`x`", "a number")


def refused() -> None:
    sys.exit(3)


def exception() -> None:
    raise ZeroDivisionError


def told(words: str) -> None:
    """As the command ends on bad input."""
    print(f"error: {words}", file=sys.stderr)
    sys.exit(2)


def long_message() -> None:
    told(f"{FILE}: {'x y ' * 400}; expected a number")


def no_file_named() -> None:
    told("somewhere: `x`; expected a number")


def escape_sequence() -> None:
    told(f"{FILE}: `\x1b[2J`; expected a number")


def warning() -> None:
    warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)


def printed_past_python() -> None:
    os.write(2, b"a library speaks\n")


def other_exit() -> None:
    sys.exit(1)


def endless() -> None:
    while True:
        pass


def memory() -> None:
    [bytes(10**9) for _ in range(100)]


def crash() -> None:
    os.abort()


CALLS: dict[str, tuple[Callable[[], None], str]] = {
    "result": (result, "result"),
    "error": (error, "error"),
    "refused": (refused, "result"),
    "exception": (exception, "exception"),
    "long message": (long_message, "message"),
    "no file named": (no_file_named, "message"),
    "escape sequence": (escape_sequence, "message"),
    "warning": (warning, "screen"),
    "printed past Python": (printed_past_python, "screen"),
    "other exit": (other_exit, "screen"),
    "endless": (endless, "slow"),
    "memory": (memory, "memory"),
    "crash": (crash, "crash"),
    "after the crash": (result, "result"),
}
"""Name → the call, and the verdict that it is to get."""


def broken(seed: int) -> Case:
    call, _ = list(CALLS.values())[seed]
    return Case({FILE: b"name: x\n"}, (Stage("call", call, None, 0.5),))
