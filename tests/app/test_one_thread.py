"""BLAS within a verb runs on one thread, and as before after it."""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
import pytest
import scipy.linalg
import threadpoolctl
from threadpoolctl import threadpool_info, threadpool_limits

from codegen.base.border import verb


@verb
def threads() -> list[int]:
    return _threads()


@verb
def size() -> float:
    return float(np.eye(2).sum())


def _threads() -> list[int]:
    np.linalg.solve(np.eye(2), np.ones(2))
    scipy.linalg.solve(np.eye(2), np.ones(2))
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_a_verb_runs_blas_on_one_thread_and_gives_the_others_back() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = _threads()
        assert max(before) == 2
        assert set(threads()) == {1}
        assert _threads() == before


def test_a_library_that_a_later_module_loads_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The libraries are looked for once, and again where there are further modules."""
    looked = list[int]()

    class Controller(threadpoolctl.ThreadpoolController):
        def __init__(self) -> None:
            looked.append(len(sys.modules))
            super().__init__()

    monkeypatch.setattr(threadpoolctl, "ThreadpoolController", Controller)
    for name in ("a_module_for_one_test", "another_module_for_one_test"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
        for _ in range(2):
            size()
    assert len(looked) == len(set(looked)) == 2
