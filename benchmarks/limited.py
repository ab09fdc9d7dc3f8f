"""A piece of work in a process of its own, stopped after a while."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from typing import Any

from benchmarks.peer import Missing


def limited(work: Callable[..., Any], seconds: float, *arguments: Any) -> tuple[Any, float]:
    """(result, seconds that it took) of a function of a module; the process's start is not counted.

    Raises:
        Missing: if it did not end in time, or failed.
    """
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(theirs, work, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        if not mine.poll(60.0) or mine.recv() != "begun":
            raise Missing("it did not begin")
        if not mine.poll(seconds):
            raise Missing(f"stopped after {seconds:.0f} s")
        done, value, spent = mine.recv()
    except EOFError:
        raise Missing("its process ended early") from None
    finally:
        process.terminate()
        process.join()
        mine.close()
    if not done:
        raise Missing(value)
    return value, spent


def _run(connection: Any, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    connection.send("begun")
    start = time.perf_counter()
    try:
        result = (True, work(*arguments))
    except Missing as missing:
        result = (False, str(missing))
    except Exception as error:
        result = (False, f"{type(error).__name__}: {str(error)[:200]}")
    connection.send((*result, time.perf_counter() - start))
