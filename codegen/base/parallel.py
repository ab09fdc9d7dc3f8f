"""Parallel computation: threads for compiled code, which releases the interpreter lock, and processes for fits.

Results do not depend on the number of cores: each is computed independently, and they are returned in the order of the
items.
"""

from __future__ import annotations

import ctypes
import io
import os
import pickle
import signal
import sys
import threading
import warnings
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
"""Number of cores that this process may use."""
WORKERS, PROCESSES = max(1, min(2, CORES)), max(1, min(4, CORES))
"""Largest number of threads, and of processes including this one."""
MOST_ITEMS = 8192
"""Largest number of items for which ``in_processes`` forks: their indices are in a pipe, which has 64 KiB."""
_DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)

Item = TypeVar("Item")
Result = TypeVar("Result")
_inside = threading.local()
"""``busy`` is True in a worker thread or process, where nested calls run serially."""
_background: set[Future[Any]] = set()
"""Work of ``in_background`` that is running."""
_forks = False
"""Whether processes may be forked (``allow_processes``)."""


def in_parallel(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The results for all items, in their order, by threads, this one among them; a nested call runs serially.

    After an error, or Ctrl-C, no further item is begun. The error of the first item that has one is raised.
    """
    if len(items) < 2 or WORKERS < 2 or getattr(_inside, "busy", False):
        return [function(item) for item in items]
    order, found, errors = iter(range(len(items))), dict[int, Result](), dict[int, BaseException]()

    def work() -> None:
        _inside.busy = True
        for k in order:
            try:
                found[k] = function(items[k])
            except BaseException as error:  # Ctrl-C too, which the calling thread receives
                errors[k] = error
                deque(order, 0)
        _inside.busy = False

    with ThreadPoolExecutor(WORKERS - 1) as pool:
        for _ in range(WORKERS - 1):
            pool.submit(work)
        work()
    if errors:
        raise errors[min(errors)]
    return [found[k] for k in range(len(items))]


def in_background(function: Callable[..., Result], *arguments: Any) -> Callable[[], Result]:
    """Start a function in a thread.

    Returns:
        a function that waits for the result and returns it, or raises the exception that the work raised.
    """
    pool = ThreadPoolExecutor(1)
    started = pool.submit(function, *arguments)
    _background.add(started)
    started.add_done_callback(_background.discard)
    pool.shutdown(wait=False)
    return started.result


def allow_processes(allowed: bool = True) -> None:
    """Allow ``in_processes`` to fork (on Linux), or not, as at the start. Only the command line calls this.

    A program that imports the package may have threads of its own, and forking a process with threads is unsafe.
    """
    global _forks
    _forks = allowed and sys.platform == "linux"


def in_processes(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    shared: Sequence[object] = (),
    begun: Callable[[int], object] = lambda count: None,
    threads: bool = True,
) -> list[Result]:
    """The results for all items, in their order, by forked processes; by threads where no process may be forked.

    Each process, this one too, takes the next item when it has finished one. An item without a result, because its
    process was killed or the function raised an error, is computed again in this process. While ``in_background`` has
    work running, items are computed in this process and nothing is forked: a forked process has no copy of the thread.

    Args:
        function: its result is pickled; side effects in a forked process are lost.
        shared: objects that results refer to; a result keeps the reference, and they are not pickled.
        begun: called in this process at the start of each item that it computes itself, with the item's index.
        threads: whether the function may run in several threads at once.
    """

    def work(k: int) -> Result:
        begun(k)
        return function(items[k])

    if not _may_fork() or min(PROCESSES, len(items)) < 2 or len(items) > MOST_ITEMS:
        return in_parallel(work, range(len(items))) if threads else [work(k) for k in range(len(items))]
    found: dict[int, Result] = {}
    while _background and len(found) < len(items):
        found[len(found)] = work(len(found))
    children: list[_Child] = []
    try:
        rest = _Order(range(len(found), len(items)))
    except OSError:  # no further file may be opened
        return [found[k] if k in found else function(item) for k, item in enumerate(items)]
    with rest as order:
        try:
            with suppress(OSError):  # no further process is admitted
                for _ in range(min(PROCESSES, len(items) - len(found)) - 1):
                    children.append(_Child(function, items, order, shared))
            _inside.busy = True
            found |= {k: work(k) for k in order}
            for child in children:
                found |= child.results()
        finally:
            _inside.busy = False
            for child in children:
                child.end()
    return [found[k] if k in found else function(item) for k, item in enumerate(items)]


def in_another_process(function: Callable[..., Result], *arguments: Any) -> Callable[[], Result]:
    """Start a function in a forked process.

    Returns:
        a function that waits for the result, which is pickled, and returns it. Where no process may be forked, or the
        process ends without a result, it calls ``function`` in this process.
    """
    if not _may_fork() or PROCESSES < 2:
        return partial(function, *arguments)
    wait(list(_background))
    try:
        with _Order(range(1)) as order:
            child = _Child(lambda given: function(*given), [arguments], order, ())
    except OSError:  # no further process is admitted, or no further file
        return partial(function, *arguments)

    def result() -> Result:
        try:
            found = child.results()
        finally:
            child.end()
        return found[0] if found else function(*arguments)

    return result


def _may_fork() -> bool:
    """Whether processes are allowed and this is not a nested call."""
    return _forks and not getattr(_inside, "busy", False)


class _Order:
    """Work queue of item indices, shared with forked processes through a pipe; each index is read by one process."""

    def __init__(self, indices: range) -> None:
        self._rest, given = os.pipe()
        os.write(given, array("i", indices).tobytes())
        os.close(given)

    def __enter__(self) -> _Order:
        return self

    def __exit__(self, *error: object) -> None:
        os.close(self._rest)

    def __iter__(self) -> Iterator[int]:
        while one := os.read(self._rest, array("i").itemsize):
            yield array("i", one)[0]


class _Child:
    """A forked process that computes items of a queue, and writes its results into a pipe when the queue is empty."""

    def __init__(
        self, function: Callable[[Any], Any], items: Sequence[Any], order: _Order, shared: Sequence[object]
    ) -> None:
        self._shared = shared
        self._answer, answer = os.pipe()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C is the parent's, which ends us
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)  # of threads: BLAS has some, which are idle
                self._process = os.fork()
            if self._process == 0:
                try:
                    self._work(function, items, order, answer)
                finally:
                    os._exit(0)
        except OSError:
            os.close(self._answer)
            raise
        finally:
            os.close(answer)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def _work(self, function: Callable[[Any], Any], items: Sequence[Any], order: _Order, answer: int) -> None:
        ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, int(signal.SIGKILL))
        _inside.busy = True
        found, written = {}, io.BytesIO()
        with suppress(Exception):  # the parent computes missing items itself, which raises the error there
            for k in order:
                found[k] = function(items[k])
        _Pickler(written, self._shared).dump(found)
        with os.fdopen(answer, "wb", closefd=False) as stream:
            stream.write(written.getbuffer())

    def results(self) -> dict[int, Any]:
        """Item index → result; {} where the process ended without writing them."""
        with os.fdopen(self._answer, "rb", closefd=False) as stream:
            written = stream.read()
        found: dict[int, Any] = {}
        with suppress(EOFError, pickle.UnpicklingError):  # killed
            found = _Unpickler(io.BytesIO(written), self._shared).load()
        return found

    def end(self) -> None:
        """Kill the process, if it still runs, and wait for its end."""
        os.close(self._answer)
        with suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)


class _Pickler(pickle.Pickler):
    """Writes shared objects as their index."""

    def __init__(self, stream: Any, shared: Sequence[object]) -> None:
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self._index = {id(one): k for k, one in enumerate(shared)}

    def persistent_id(self, found: object) -> int | None:
        return self._index.get(id(found))


class _Unpickler(pickle.Unpickler):
    """Reads what ``_Pickler`` wrote. Only results of our own forked processes are unpickled, no file or input."""

    def __init__(self, stream: Any, shared: Sequence[object]) -> None:
        super().__init__(stream)
        self._shared = shared

    def persistent_load(self, index: int) -> object:
        return self._shared[index]
