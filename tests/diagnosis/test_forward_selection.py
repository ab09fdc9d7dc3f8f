"""Rounds of candidates: what stands where effects were dropped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis import forward_selection
from codegen.diagnosis.forward_selection import still_credited


def fit(*parts: str) -> Any:
    return SimpleNamespace(runner=SimpleNamespace(trial=SimpleNamespace(parts=parts)))


def rival(*parts: str) -> Any:
    return SimpleNamespace(found=SimpleNamespace(trial=SimpleNamespace(parts=parts)))


@pytest.mark.parametrize("alone_is_credited", [True, False])
def test_one_effect_of_a_pair_stands_alone_only_if_it_is_credited_alone(
    alone_is_credited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what tied with the other one beside it is no rival of it."""
    asked = []

    def credible(search: Any, before: Any, after: Any, candidates: int) -> bool:
        asked.append((before, after, candidates))
        return alone_is_credited

    monkeypatch.setattr(forward_selection, "credible", credible)
    base, one, both = fit(), fit("inertia_error"), fit("inertia_error", "cogging")
    first, second = rival("spring"), rival("inertia_error", "stribeck")
    none: Any = None
    assert still_credited(none, base, both, [first, second], 9) == (both, [first, second]) and not asked
    left = still_credited(none, base, one, [first, second], 9)
    assert asked == [(base, one, 9)]
    assert left == ((one, [first]) if alone_is_credited else (base, []))


@dataclass(frozen=True)
class Fake:
    """A search whose refit leaves an error that grows with the square of the segments' length."""

    record: float
    shorter: Callable[[float], float]

    def refit(self) -> float:
        return 1600.0 * self.record**2


@pytest.mark.parametrize(("scale", "share"), [(0.05, 1.0), (0.2, 0.5), (1.0, 0.25), (100.0, 0.25)])
def test_segments_are_halved_while_free_runs_are_far_off(
    scale: float, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """80, 320, 1,600 and 160,000 times the noise at full length; a quarter is the shortest."""
    monkeypatch.setattr(forward_selection, "noise_ratio", lambda error: scale * error)
    search: Any = Fake(1.0, lambda share: share)
    near, base = forward_selection.within_reach(search)
    assert (near.record, base) == (share, 1600.0 * share**2)
    assert near.shorter(0.5) == 0.5 * share
