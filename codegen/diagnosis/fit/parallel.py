"""Threads for free-run simulations and the compiler: neither holds the interpreter lock."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

WORKERS = max(1, min(2, os.cpu_count() or 1))

Item = TypeVar("Item")
Result = TypeVar("Result")
_inside = threading.local()


def in_parallel(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The results for all items, in their order, whatever the number of threads; a nested call runs serially."""
    if len(items) < 2 or WORKERS < 2 or getattr(_inside, "busy", False):
        return [function(item) for item in items]
    with ThreadPoolExecutor(WORKERS, initializer=_enter) as pool:
        return list(pool.map(function, items))


def in_background(function: Callable[..., Result], *arguments: Any) -> Callable[[], Result]:
    """Start a function in a thread; what is returned waits for its result, or raises what it raised."""
    pool = ThreadPoolExecutor(1)
    started = pool.submit(function, *arguments)
    pool.shutdown(wait=False)
    return started.result


def _enter() -> None:
    _inside.busy = True
