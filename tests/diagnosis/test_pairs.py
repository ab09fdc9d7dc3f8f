"""Pairs of the best candidates of the first round."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.selection import forward_selection
from tests.diagnosis.fakes import InRound, fit, part_named, ranked


@pytest.mark.parametrize(("share", "whole"), [(0.85, True), (0.7, False)])
def test_an_effect_like_the_best_that_leaves_nearly_as_little_gets_a_round_of_all(
    share: float, whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second missing effect may make the wrong one of two springs the best: both then go on to a second round."""
    asked: list[tuple[str, list[str]]] = []

    def run_round(search: Any, base: Any, parts: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        return []

    everything = [part_named(kind) for kind in ("viscous_asymmetry", "cogging", "stribeck")]
    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: everything)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked("hardening_spring", 0.875), ranked("spring", share), ranked("offset", 0.3)]
    assert forward_selection.best_pair(search, best) == (None, False)
    assert ("hardening_spring", ["offset"]) in asked
    second = ["viscous_asymmetry", "cogging", "stribeck"] if whole else ["offset"]
    assert ("spring", second) in asked


def test_an_effect_of_another_signature_that_leaves_nearly_as_little_gets_a_round_of_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A dead zone imitated a spring with viscous friction; the friction alone was not among the best candidates."""
    asked: list[tuple[str, list[str]]] = []

    def run_round(search: Any, base: Any, parts: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked("dead_zone", 0.74), ranked("spring", 0.72), ranked("offset", 0.3)]
    forward_selection.best_pair(search, best)
    assert ("spring", ["viscous"]) in asked


def test_another_form_of_an_effect_gets_no_second_round_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Stribeck friction with an exponent leaves what the usual form leaves: both are one candidate for a pair."""
    asked: list[tuple[str, ...]] = []

    def run_round(search: Any, base: Any, parts: Any, leading: bool) -> list[Any]:
        asked.append(base.trial.parts[0].names)
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    forms = ("delta", "v_s"), ("delta", "v_s", "exponent")
    best = [ranked("stribeck", 0.99, names) for names in forms] + [ranked("offset", 0.3)]
    forward_selection.best_pair(search, best)
    assert asked == [forms[0]]


def test_an_effect_with_the_motion_of_a_better_one_gets_no_second_round_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A constant force is an asymmetric friction with another level: on an arm, a round beside each took twice as long.

    The two are no pair either.
    """
    asked: list[tuple[str, list[str]]] = []

    def run_round(search: Any, base: Any, parts: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked(kind, share) for kind, share in (("coulomb_asymmetry", 0.9), ("offset", 0.9), ("spring", 0.89))]
    system = best[0].found.trial.system
    best[0].found.part.on, best[1].found.part.on = system.contacts[0].name, system.positions[0].name
    forward_selection.best_pair(search, best)
    assert asked == [("coulomb_asymmetry", ["spring"]), ("spring", ["viscous"])]


@pytest.mark.parametrize("at_noise", [True, False])
def test_no_pair_is_sought_beyond_one_that_leaves_only_noise(at_noise: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two effects of a stage left the noise alone; a round of all for a third first effect took a sixth of the time."""
    asked: list[str] = []

    def run_round(search: Any, base: Any, parts: Any, leading: bool) -> list[Any]:
        asked.append(base.trial.parts[0].kind)
        found = fit(base.trial.parts[0], parts[0])
        found.cost = 10.0 - len(asked)
        return [InRound(found=found, why_not="")]

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    monkeypatch.setattr(forward_selection, "at_noise", lambda found: at_noise and found.cost == 8.0)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    kinds = ("offset", "spring", "cogging", "stribeck")
    pair, among_all = forward_selection.best_pair(search, [ranked(kind, 0.9) for kind in kinds])
    assert asked == list(kinds[: 2 if at_noise else 3])
    assert pair is not None and [p.kind for p in pair.trial.parts] == [asked[-1], "viscous"] and among_all
