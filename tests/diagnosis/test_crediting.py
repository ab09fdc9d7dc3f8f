"""What free runs leave of several effects."""

from __future__ import annotations

from typing import Any

import pytest

from codegen.diagnosis.selection import (
    crediting,
)
from codegen.diagnosis.selection.crediting import still_credited
from tests.diagnosis.fakes import fit, part_named, rival


@pytest.mark.parametrize("credited", [True, False])
def test_what_is_left_of_several_effects_stands_only_if_it_is_credited(
    credited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A dead zone in a real log: a lag and a Stribeck effect, each needed beside the other, together predicted held-out
    segments 15 % worse than the refit, and one of them was named. And what tied beside another effect is no rival.
    """
    asked = []

    def is_credited(search: Any, before: Any, after: Any) -> bool:
        asked.append((before, after))
        return credited

    monkeypatch.setattr(crediting, "is_credited", is_credited)
    base, one, both = fit(), fit("inertia_error"), fit("inertia_error", "cogging")
    first, second = rival("spring"), rival("inertia_error", "stribeck")
    none: Any = None
    pair = still_credited(none, base, both, [first, second])
    left = still_credited(none, base, one, [first, second])
    assert asked == [(base, both), (base, one)]
    assert pair == ((both, [first, second]) if credited else (base, []))
    assert left == ((one, [first]) if credited else (base, []))


@pytest.mark.parametrize(("left", "kept"), [(("wave", "dead_zone"), True), (("dead_zone",), False)])
def test_rivals_of_an_effect_that_is_dropped_are_dropped(
    left: tuple[str, ...], kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third effect that ties with another came first and was pruned: its rival is none of the effect behind it."""
    search: Any = None
    before, after = (fit(*map(part_named, kinds)) for kinds in (("wave", "dead_zone"), left))
    monkeypatch.setattr(crediting, "pruned", lambda search, current, candidates: after)
    rivals: Any = [rival("hardening_spring")]
    assert crediting.pruned_with_rivals(search, before, rivals) == (after, rivals if kept else [])
