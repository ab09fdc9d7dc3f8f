"""Assertions on the message for bad input: its code, and the names and numbers that it must show."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from codegen.base.errors import BadInput


def matches(fault: BadInput, expected: str) -> bool:
    """Whether a fault has the code that ``expected`` begins with, and shows each word that follows it there.

    ``expected`` is such as "SPEC008 `etta3` force[1]"; empty where any fault will do.
    """
    code, *shown = expected.split() or [fault.code]
    return fault.code == code and all(word in str(fault) for word in shown)


@contextmanager
def refused(expected: str) -> Iterator[pytest.ExceptionInfo[BadInput]]:
    """A block that raises a fault, and one that ``matches`` what is expected."""
    with pytest.raises(BadInput) as told:
        yield told
    assert matches(told.value, expected), told.value
