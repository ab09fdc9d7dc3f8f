"""What free runs leave of several effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.trial import Trial, part_of
from codegen.diagnosis.selection import (
    parsimony,
)
from codegen.diagnosis.selection.parsimony import explains_enough, least_share, still_accepted
from codegen.effects import CATALOGUE
from tests.diagnosis.fakes import fit, part_named, rival
from tests.diagnosis.stage import stage, system_of


def searched() -> Any:
    return SimpleNamespace(system=system_of(stage()), rigid=None)


def parts_of(search: Any, *kinds: str) -> list[Any]:
    return [part_of(CATALOGUE[kind], 0, search.system) for kind in kinds]


@pytest.mark.parametrize(
    ("known", "kind", "least"),
    [
        ((), "cogging", acceptance.LEAST_SHARE),
        (("viscous",), "stribeck", acceptance.FURTHER),
        (("viscous",), "cogging", acceptance.ELSEWHERE),
        (("viscous", "spring"), "cogging", acceptance.FURTHER),
        (("coulomb_asymmetry",), "viscous", acceptance.ELSEWHERE),
    ],
)
def test_a_further_effect_must_explain_more_over_the_variable_of_a_known_one(
    known: tuple[str, ...], kind: str, least: float
) -> None:
    """Over the same variable it may correct a misfit of the other's form. An asymmetry is also a constant force."""
    search = searched()
    (part,) = parts_of(search, kind)
    assert least_share(search, parts_of(search, *known), part) == least


@pytest.mark.parametrize(
    ("known", "kind", "share", "confirmed", "enough"),
    [
        ("load_dependent_friction", "cogging", 0.25, True, True),
        ("load_dependent_friction", "cogging", 0.25, False, False),
        ("load_dependent_friction", "cogging", 0.15, True, False),
        ("load_dependent_friction", "friction_drift", 0.3, True, False),
        ("viscous", "stribeck", 0.3, True, False),
        ("viscous", "stribeck", 0.45, False, True),
    ],
)
def test_what_a_further_effect_must_explain_in_free_runs(
    known: str, kind: str, share: float, confirmed: bool, enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cogging in a servo's logs, with all else that no effect describes, explained 25 % of what its friction in
    proportion to the load left, and was not accepted. What any misfit leaves also changes in time.
    """
    search = searched()
    before, after = (
        SimpleNamespace(trial=Trial(search.system, tuple(parts_of(search, *kinds)), ()))
        for kinds in ((known,), (known, kind))
    )
    runs, force = SimpleNamespace(t=2.0), SimpleNamespace(left=0.9, p_added=lambda count: 0.001)
    if not confirmed:
        runs.t = 1.0
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: share)
    monkeypatch.setattr(parsimony, "where_they_differ", lambda search, one, other: (one, other))
    monkeypatch.setattr(parsimony, "evidence_of", lambda *_: runs)
    monkeypatch.setattr(parsimony, "ForceCriterion", lambda *_: SimpleNamespace(added_to=lambda other: force))
    search.with_noise_floor = lambda one: (search, one)
    search.fitted_again = lambda one: one
    asked: tuple[Any, Any, Any] = (search, before, after)
    assert explains_enough(*asked) is enough
    if enough and share < acceptance.FURTHER:
        force.p_added = lambda count: 0.1
        assert not explains_enough(*asked), "the force residual does not confirm it"
        force.p_added, force.left = lambda count: 0.001, 0.97
        assert not explains_enough(*asked), "it hardly changes the force residual"
        force.left = 0.9
        for kinds in (("presliding", kind), (kind, "presliding")):
            after.trial = Trial(search.system, tuple(parts_of(search, known, *kinds)), ())
            assert not explains_enough(*asked), "its force is simulated, and no second criterion"


@pytest.mark.parametrize("accepted", [True, False])
def test_what_is_left_of_several_effects_stands_only_if_it_is_accepted(
    accepted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A dead zone in a real log: a lag and a Stribeck effect, each needed beside the other, together predicted held-out
    segments 15 % worse than the refit, and one of them was named. And what tied beside another effect is no rival.
    """
    asked = []

    def is_accepted(search: Any, before: Any, after: Any) -> bool:
        asked.append((before, after))
        return accepted

    monkeypatch.setattr(parsimony, "is_accepted", is_accepted)
    base, one, both = fit(), fit("inertia_error"), fit("inertia_error", "cogging")
    first, second = rival("spring"), rival("inertia_error", "stribeck")
    search: Any = SimpleNamespace(without=lambda current, k: one)
    pair = still_accepted(search, base, both, [first, second])
    left = still_accepted(search, base, one, [first, second])
    assert asked[0] == (base, both) and asked[-1] == (base, one)
    assert pair == ((both, [first, second]) if accepted else (base, []))
    assert left == ((one, [first]) if accepted else (base, []))


@pytest.mark.parametrize(
    ("paired", "left", "asked"),
    [
        (False, ("load", "wave"), False),  # each was accepted in its round
        (False, ("load", "spring"), True),  # one was replaced
        (False, ("wave",), True),  # one was removed
        (True, ("load", "wave"), True),  # a pair has no rounds
    ],
)
def test_effects_that_were_accepted_one_after_another_are_not_asked_again_as_a_set(
    paired: bool, left: tuple[str, ...], asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a servo a friction in proportion to the load was accepted among 23 candidates, and a wave beside it among
    22,000. Among 253,000 pairs both together were not significant, and neither was named.
    """
    both, final = fit(*map(part_named, ("load", "wave"))), fit(*map(part_named, left))
    for name in ("pruned_with_rivals", "with_simplest_effects"):
        monkeypatch.setattr(parsimony, name, lambda search, found, rivals: (found, rivals))
    monkeypatch.setattr(parsimony, "reconsidered", lambda *_: (final, []))
    monkeypatch.setattr(parsimony, "largest_first", lambda search, found: found)
    monkeypatch.setattr(parsimony, "is_accepted", lambda *_: False)
    none: Any = None
    base = fit()
    assert parsimony.judged_together(none, base, both, [], paired)[0] is (base if asked else final)


@pytest.mark.parametrize(("left", "kept"), [(("wave", "dead_zone"), True), (("dead_zone",), False)])
def test_rivals_of_an_effect_that_is_dropped_are_dropped(
    left: tuple[str, ...], kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third effect that ties with another came first and was pruned: its rival is none of the effect behind it."""
    search: Any = None
    before, after = (fit(*map(part_named, kinds)) for kinds in (("wave", "dead_zone"), left))
    monkeypatch.setattr(parsimony, "pruned", lambda search, current, candidates: after)
    rivals: Any = [rival("hardening_spring")]
    assert parsimony.pruned_with_rivals(search, before, rivals) == (after, rivals if kept else [])
