"""How large an observer the checker takes."""

from __future__ import annotations

from codegen.base.text import render
from codegen.checker import verify
from codegen.observers.equations import Observer


def beyond_checker(observer: Observer) -> str:
    """Why an observer is too large for the checker, in words that say the limit; empty where it is not."""
    count = len(observer.errors)
    return (
        "" if count <= verify.MAX_SIZE else render("text/beyond_checker.j2", count=count, limit=verify.MAX_SIZE).strip()
    )
