"""Results of several threads or processes are those of one, in the order of the items."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from codegen.base import parallel

forked = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")


@pytest.fixture
def several(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(parallel, "PROCESSES", 3)
    parallel.allow_processes()
    yield
    parallel.allow_processes(False)


def no_child_is_left() -> bool:
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)
    return True


def test_results_stand_in_order_and_calls_within_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the calling thread and another one, in each of two calls: the barrier holds the first item of either."""
    monkeypatch.setattr(parallel, "WORKERS", 2)
    both = threading.Barrier(2, timeout=60)

    def within(k: int) -> list[tuple[int, int]]:
        if k < 2:
            both.wait()
        return parallel.in_parallel(lambda j: (10 * k + j, threading.get_ident()), range(3))

    for _ in range(2):
        found = parallel.in_parallel(within, range(5))
        assert [[value for value, _ in some] for some in found] == [[10 * k + j for j in range(3)] for k in range(5)]
        assert all(len({thread for _, thread in some}) == 1 for some in found)
        threads = {thread for some in found for _, thread in some}
        assert len(threads) == 2 and threading.get_ident() in threads


@pytest.mark.parametrize("wrong", [{0}, {1}, {0, 1}])
def test_the_error_of_the_first_item_is_raised_and_no_further_item_is_begun(
    wrong: set[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All other items were computed first, and of two errors it was that of the calling thread."""
    monkeypatch.setattr(parallel, "WORKERS", 2)
    both, begun = threading.Barrier(2, timeout=60), list[int]()

    def work(k: int) -> None:
        begun.append(k)
        if k < 2:
            both.wait()
        if k in wrong:
            raise ValueError(f"item {k}")
        time.sleep(0.3)

    for _ in range(2):  # a call after an error has several threads again, or the barrier would not open
        begun.clear()
        with pytest.raises(ValueError, match=f"^item {min(wrong)}$"):
            parallel.in_parallel(work, range(9))
        assert sorted(begun) == [0, 1]


def test_what_runs_in_the_background_gives_its_result_or_its_error_to_each_that_asks() -> None:
    assert [parallel.in_background(divmod, 7, 2)() for _ in range(2)] == [(3, 1)] * 2
    failing = parallel.in_background(divmod, 7, 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            failing()


@pytest.mark.parametrize("threads", [False, True])
def test_without_other_processes_it_is_told_too_when_an_item_begins(
    threads: bool,
) -> None:
    """A caller from Python, or a machine of one core, saw no progress of a search that takes a minute."""
    parallel.allow_processes(False)
    begun: list[int] = []
    assert parallel.in_processes(lambda k: 2 * k, range(9), (), begun.append, threads) == [2 * k for k in range(9)]
    assert sorted(begun) == list(range(9))


@forked
@pytest.mark.usefixtures("several")
def test_processes_give_their_results_in_order_and_run_calls_within_alone() -> None:
    begun: list[int] = []

    def within(k: int) -> list[tuple[int, int, int]]:
        time.sleep(0.01)
        return parallel.in_processes(lambda j: (10 * k + j, os.getpid(), threading.get_ident()), range(2))

    found = parallel.in_processes(within, range(20), (), begun.append)
    assert [[value for value, *_ in some] for some in found] == [[10 * k, 10 * k + 1] for k in range(20)]
    assert len({process for some in found for _, process, _ in some}) == 3
    assert all(some[0][1:] == some[1][1:] for some in found)
    assert begun == [k for k, some in enumerate(found) if some[0][1] == os.getpid()]
    assert no_child_is_left()


@forked
@pytest.mark.usefixtures("several")
def test_what_is_shared_is_not_copied() -> None:
    lock, own = threading.Lock(), [1, 2]  # a lock cannot be pickled
    found = parallel.in_processes(lambda k: (k, time.sleep(0.01), lock, own, [own]), range(12), (lock, own))
    assert all(one[2] is lock and one[3] is own and one[4][0] is own for one in found)


@forked
@pytest.mark.usefixtures("several")
def test_an_error_is_that_of_the_item() -> None:
    with pytest.raises(ZeroDivisionError):
        parallel.in_processes(lambda k: time.sleep(0.01) or 1 / (k - 7), range(12))
    assert no_child_is_left()


@forked
@pytest.mark.usefixtures("several")
@pytest.mark.parametrize("result", [lambda k: os.kill(os.getpid(), signal.SIGKILL), lambda k: threading.Lock()])
def test_what_a_process_does_not_deliver_is_computed_here(result: Any) -> None:
    """It was killed, or what it has cannot be pickled."""
    here = os.getpid()

    def work(k: int) -> Any:
        time.sleep(0.01)
        return k if os.getpid() == here else result(k)

    assert parallel.in_processes(work, range(9)) == list(range(9))
    assert no_child_is_left()


@forked
@pytest.mark.usefixtures("several")
def test_processes_begin_when_nothing_runs_in_the_background() -> None:
    ended = threading.Event()
    parallel.in_background(ended.wait, 60)

    def work(k: int) -> int:
        if k == 3:
            ended.set()
        time.sleep(0.02)
        return os.getpid()

    found = parallel.in_processes(work, range(30))
    assert set(found[:4]) == {os.getpid()}
    assert len(set(found)) == 3


@forked
@pytest.mark.usefixtures("several")
def test_another_process_gives_its_result_or_its_error() -> None:
    found = parallel.in_another_process(lambda a, b: (a + b, os.getpid()), 3, 4)
    assert found()[0] == 7 and no_child_is_left()
    failing = parallel.in_another_process(divmod, 7, 0)
    with pytest.raises(ZeroDivisionError):
        failing()
    assert no_child_is_left()
    process = parallel.in_another_process(os.getpid)()
    assert process != os.getpid()


@pytest.mark.usefixtures("several")
def test_without_a_free_file_descriptor_all_is_computed_here(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_free() -> tuple[int, int]:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(os, "pipe", none_free)
    assert parallel.in_processes(abs, [-1, -2, -3]) == [1, 2, 3]
    assert parallel.in_another_process(abs, -4)() == 4


def test_no_process_is_forked_for_others_than_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "PROCESSES", 3)
    parallel.allow_processes(False)
    assert set(parallel.in_processes(lambda k: os.getpid(), range(6))) == {os.getpid()}
    assert parallel.in_another_process(os.getpid)() == os.getpid()
