"""Pairs of the best candidates of the first round."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.selection import forward_selection
from tests.diagnosis.fakes import InRound, fit, part_named, ranked
from tests.diagnosis.stage import among, log_of, stage
from tests.diagnosis.test_adoption import search_of


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
    assert forward_selection.second_rounds(search, best) == []
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
    forward_selection.second_rounds(search, best)
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
    forward_selection.second_rounds(search, best)
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
    forward_selection.second_rounds(search, best)
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
    last = forward_selection.second_rounds(search, [ranked(kind, 0.9) for kind in kinds])[-1]
    assert asked == list(kinds[: 2 if at_noise else 3])
    assert [p.kind for p in last.pair.trial.parts] == [asked[-1], "viscous"]


STROKES = "0.854 + 0.004*t + 0.0011*t*t + 0.197*sin(0.176*t + 1.708) + 0.023*sin(2.72*t + 2.885)"
"""Ever farther from the zero of the position, where a spring acts like a constant force."""
PUSH = "{kind: coulomb_asymmetry, on: rail, parameters: {d: 1.5}}, {kind: viscous, on: rail, parameters: {b: 20}}"


def test_an_effect_that_explains_more_with_a_further_one_is_a_rival_of_the_best_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A real motor with a constant force and viscous friction, neither declared: a spring was named with certainty.

    Alone the spring explained more and the force residual preferred it; beside viscous friction neither criterion did.
    Here too a spring explains more alone, and a force that nothing describes is left.
    """
    log = log_of(stage(f"[{PUSH}]", 4.5, STROKES, 28.0), tmp_path, "log.csv")
    noise, steps = 0.0, np.random.default_rng(2)
    unknown = np.array([noise := 0.987 * noise + 0.16 * steps.standard_normal() for _ in log.time])
    search = search_of(stage(), replace(log, inputs=log.inputs + 0.8 * unknown[:, None]))
    search, base = forward_selection.within_reach(search)
    monkeypatch.setattr(forward_selection, "ties", lambda *_: [])  # as by the force residual of the motor
    with among("spring", "coulomb_asymmetry", "viscous", "quadratic_drag"):
        found = forward_selection.find_effects(search, base, lambda turn, share: None)
    assert [p.kind for p in found.parts] == ["spring"]
    assert [r.part.kind for r in found.rivals] == ["coulomb_asymmetry"]


@pytest.mark.parametrize(
    ("cost", "preferred", "explains"),
    [
        (80.0, [("pair", "alone")], True),
        (95.0, [("pair", "alone")], False),
        (80.0, [], False),
        (80.0, [("pair", "alone"), ("other", "pair")], False),
    ],
)
@pytest.mark.parametrize("by_runs", [False, True])
def test_a_pair_explains_more_than_an_effect_and_no_less_than_that_with_the_same_further_effect(
    cost: float, preferred: list[tuple[str, str]], explains: bool, by_runs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``other``: the effect with the second of the pair; either criterion may prefer it."""
    none = SimpleNamespace(parts=())
    alone, pair = (SimpleNamespace(name=name, cost=c, trial=none) for name, c in (("alone", 100.0), ("pair", cost)))
    alone.values, pair.part, pair.parameters = (np.zeros(1), []), "viscous", {"b": 1.0}
    other = SimpleNamespace(name="other")
    asked = set(preferred)
    monkeypatch.setattr(forward_selection, "ForceCriterion", lambda search, found: found)
    monkeypatch.setattr(forward_selection, "most_left", lambda found: 1.0)
    by_force = asked - {("other", "pair")} if by_runs else asked
    monkeypatch.setattr(forward_selection, "force_prefers", lambda one, two, *_: (one.name, two.name) in by_force)
    monkeypatch.setattr(
        forward_selection, "runs_prefer", lambda search, one, two: by_runs and (one.name, two.name) in asked
    )
    search: Any = SimpleNamespace(with_parts=lambda *_: other)
    led: Any = alone
    both: Any = pair
    assert forward_selection.explains_more(search, led, both) == explains


@pytest.mark.parametrize("why_not", ["", "may be chance"])
def test_a_rival_in_a_pair_is_accepted_alone(why_not: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wave of any period explains more than a load behind a spring with a third effect, and might alone be chance."""
    monkeypatch.setattr(forward_selection, "explains_more", lambda *_: True)
    search: Any = SimpleNamespace(fitted_again=lambda found: found)
    first, second, led = ranked("cogging", 0.3), ranked("viscous", 0.3), ranked("compliance", 0.3).found
    first.why_not = why_not
    rounds = forward_selection._Rounds(search, lambda *_: None, {}, led, led, led)
    alone = forward_selection.SecondRound(first, (second,), second.found)
    assert rounds._is_rival(alone) == (not why_not)


@pytest.mark.parametrize(
    ("cost", "worth", "further", "rivals"),
    [
        (1.0, False, False, ["spring", "offset"]),
        (99.0, True, False, ["spring", "offset"]),  # no better than the effect alone
        (99.0, True, True, ["spring"]),  # a second effect was accepted
        (1.0, True, False, []),  # the pair is taken
    ],
)
def test_rivals_by_pairs_are_added_where_no_second_effect_is_accepted(
    cost: float, worth: bool, further: bool, rivals: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The spring tied already; a pair with the leader itself as the second effect says nothing."""
    leader, *others = [ranked(kind, 0.3) for kind in ("hardening_spring", "spring", "offset", "viscous")]
    for one in others:
        one.found.cost = cost
    led = leader.found
    led.cost = 50.0
    seconds = [leader if one is others[2] else ranked("cogging", 0.3) for one in others]
    pairs = [
        forward_selection.SecondRound(one, (second,), one.found) for one, second in zip(others, seconds, strict=True)
    ]
    monkeypatch.setattr(forward_selection, "second_rounds", lambda search, some: pairs)
    monkeypatch.setattr(forward_selection, "at_noise", lambda found: False)
    monkeypatch.setattr(forward_selection, "worth_it", lambda *_: worth)
    monkeypatch.setattr(forward_selection, "explains_more", lambda *_: True)
    monkeypatch.setattr(forward_selection, "with_simplest_effects", lambda search, one, known: (one, known))
    search: Any = SimpleNamespace(fitted_again=lambda found: found)
    confirmed: Any = SimpleNamespace(trial=led.trial, cost=50.0) if further else led
    rounds = forward_selection._Rounds(search, lambda *_: None, {None: 1}, confirmed, confirmed, led)
    rounds.leaders, rounds.rivals = [leader, *others], [others[0]]
    rounds._try_pairs()
    assert [r.part.kind for r in rounds.rivals] == rivals
    assert (rounds.confirmed is confirmed) == bool(rivals)
