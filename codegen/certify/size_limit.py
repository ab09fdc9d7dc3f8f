"""Largest size of an observer that the checker accepts."""

from codegen.base.text import render
from codegen.observers.equations import Observer

LARGEST = 32
"""Largest number of error components; equal to the checker's MAX_SIZE, whose import would take 0.1 s."""


def beyond_checker(observer: Observer) -> str:
    """The reason why an observer is too large for the checker, with the limit; empty if it is not."""
    count = len(observer.errors)
    return "" if count <= LARGEST else render("text/beyond_checker.j2", count=count, limit=LARGEST).strip()
