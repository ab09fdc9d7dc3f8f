"""BLAS within a verb runs on one thread, and as before after it."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from codegen.base.border import verb


@verb
def threads() -> list[int]:
    return _threads()


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
