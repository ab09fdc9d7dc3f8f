"""Free runs on both cores: compiled loops leave the interpreter free while they run."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

WORKERS = max(1, min(2, os.cpu_count() or 1))

Item = TypeVar("Item")
Result = TypeVar("Result")
_inside = threading.local()


def side_by_side(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The results for all items, in their order, whatever the number of threads.

    One after the other within a call of this function: the cores are busy then.
    """
    if len(items) < 2 or WORKERS < 2 or getattr(_inside, "busy", False):
        return [function(item) for item in items]
    with ThreadPoolExecutor(WORKERS, initializer=_enter) as pool:
        return list(pool.map(function, items))


def _enter() -> None:
    _inside.busy = True
