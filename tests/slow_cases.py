"""Marking of test cases as slow: `make test` runs one of each kind, `make check-all` all."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from typing import Any

import pytest


def slow_except(cases: Sequence[Any], quick: Collection[Any], several: bool = False) -> list[Any]:
    """Parameters for ``pytest.mark.parametrize``: all but the quick ones are marked slow.

    Args:
        quick: of ``cases``.
        several: whether a case is a tuple of the values of several arguments.

    Raises:
        ValueError: where one of ``quick`` is no case, so that a name that changes does not take a case out.
    """
    lost = [case for case in quick if case not in cases]
    if lost or not quick:
        raise ValueError(f"no case: {lost}")
    return [
        pytest.param(*(case if several else (case,)), marks=() if case in quick else pytest.mark.slow) for case in cases
    ]


def drawn(few: int, many: int) -> pytest.MarkDecorator:
    """The argument ``draws``, how often a random experiment is repeated: few times in `make test`, many in check-all.

    A bound on a rate is then to be computed from ``draws``, as by ``scipy.stats.binom``.
    """
    return pytest.mark.parametrize("draws", slow_except([few, many], [few]))


def examples(count: int) -> int:
    """``max_examples`` of a property: a quarter in `make test`, where they are the same each time; all in check-all."""
    return count if os.environ.get("HYPOTHESIS_PROFILE") == "random" else count // 4
