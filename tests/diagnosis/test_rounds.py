"""Rounds of candidates: what stands where effects were dropped."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis import rounds
from codegen.diagnosis.rounds import standing


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

    monkeypatch.setattr(rounds, "credible", credible)
    base, one, both = fit(), fit("inertia_error"), fit("inertia_error", "cogging")
    first, second = rival("spring"), rival("inertia_error", "stribeck")
    assert standing(None, base, both, [first, second], 9) == (both, [first, second]) and not asked  # type: ignore[arg-type]
    left = standing(None, base, one, [first, second], 9)  # type: ignore[arg-type]
    assert asked == [(base, one, 9)]
    assert left == ((one, [first]) if alone_is_credited else (base, []))
