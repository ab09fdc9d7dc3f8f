"""A piece of work in a fresh process, stopped after a while."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from typing import Any

from benchmarks.measure.build import Missing
from codegen.base.errors import BadInput

START_LIMIT = 60.0


def limited(work: Callable[..., Any], seconds: float, *arguments: Any) -> tuple[Any, float]:
    """(result, seconds of the processor) of a module's function; the process's start and its imports do not count.

    Args:
        seconds: that it may take by the clock.

    Raises:
        Missing: if it did not end in time, or could not do it.
    """
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        pool.apply_async(_imported, (work,)).get(START_LIMIT)
        try:
            return pool.apply_async(_timed, (work, *arguments)).get(seconds)
        except multiprocessing.TimeoutError:
            raise Missing(f"stopped after {seconds:.0f} s") from None
        except (BadInput, RecursionError, MemoryError) as error:
            raise Missing(f"{type(error).__name__}: {str(error)[:200]}") from None


def _imported(work: Callable[..., Any]) -> None:
    """Nothing: the module of ``work`` is imported when the arguments arrive."""


def _timed(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    start = time.process_time()
    result = work(*arguments)
    return result, time.process_time() - start
