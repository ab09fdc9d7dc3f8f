"""How large an observer the checker takes."""

from __future__ import annotations

from codegen.base.text import render
from codegen.observers.equations import Observer

LARGEST = 32
"""Error components: the checker's MAX_SIZE, written here since loading the checker takes a tenth of a second."""


def beyond_checker(observer: Observer) -> str:
    """Why an observer is too large for the checker, in words that say the limit; empty where it is not."""
    count = len(observer.errors)
    return "" if count <= LARGEST else render("text/beyond_checker.j2", count=count, limit=LARGEST).strip()
