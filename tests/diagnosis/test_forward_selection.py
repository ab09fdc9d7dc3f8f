"""Rounds of candidates: what stands where effects were dropped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.fit.credit import NEAR_NOISE
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import candidate_fits, forward_selection, ranking, refusals, significance
from codegen.diagnosis.selection.forward_selection import still_credited
from codegen.diagnosis.selection.ranking import nearest_of_equal
from codegen.effects import CATALOGUE
from codegen.effects.register import candidates
from tests.diagnosis.stage import stage, system_of


def fit(*parts: str) -> Any:
    trial = SimpleNamespace(parts=parts)
    return SimpleNamespace(runner=SimpleNamespace(trial=trial), trial=trial, part=parts[-1] if parts else None)


def rival(*parts: str) -> Any:
    return SimpleNamespace(found=SimpleNamespace(trial=SimpleNamespace(parts=parts)))


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

    monkeypatch.setattr(forward_selection, "is_credited", is_credited)
    base, one, both = fit(), fit("inertia_error"), fit("inertia_error", "cogging")
    first, second = rival("spring"), rival("inertia_error", "stribeck")
    none: Any = None
    pair = still_credited(none, base, both, [first, second])
    left = still_credited(none, base, one, [first, second])
    assert asked == [(base, both), (base, one)]
    assert pair == ((both, [first, second]) if credited else (base, []))
    assert left == ((one, [first]) if credited else (base, []))


@dataclass(frozen=True)
class Fake:
    """A search whose refit leaves an error that grows with the square of the segments' length."""

    record: float
    shorter: Callable[[float], float]

    on_shorter = Search.on_shorter

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


def unreported(share: float) -> None:
    """Progress that nobody watches."""


def ranked(kind: str, share: float, names: tuple[str, ...] = ()) -> Any:
    found = fit(part_named(kind, names))
    found.trial.system = system_of(stage())
    return SimpleNamespace(found=found, evidence=SimpleNamespace(share=share), why_not="")


def part_named(kind: str, names: tuple[str, ...] = ()) -> Any:
    """A part; with the names of its kind's usual form, or these."""
    usual = tuple(p.name for p in CATALOGUE[kind].parameters) if kind in CATALOGUE else ()
    return SimpleNamespace(kind=kind, on="x", place=0, names=names or usual)


@pytest.mark.parametrize(("share", "whole"), [(0.85, True), (0.7, False)])
def test_an_effect_like_the_best_that_leaves_nearly_as_little_gets_a_round_of_all(
    share: float, whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second missing effect may make the wrong one of two springs the best: both then go on to a second round."""
    asked: list[tuple[str, list[str]]] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        return []

    everything = [part_named(kind) for kind in ("viscous_asymmetry", "cogging", "stribeck")]
    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: everything)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked("hardening_spring", 0.875), ranked("spring", share), ranked("offset", 0.3)]
    assert forward_selection._pair(search, best, unreported) == (None, False)
    assert ("hardening_spring", ["offset"]) in asked
    second = ["viscous_asymmetry", "cogging", "stribeck"] if whole else ["offset"]
    assert ("spring", second) in asked


def test_an_effect_of_another_signature_that_leaves_nearly_as_little_gets_a_round_of_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A dead zone imitated a spring with viscous friction; the friction alone was not among the best candidates."""
    asked: list[tuple[str, list[str]]] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked("dead_zone", 0.74), ranked("spring", 0.72), ranked("offset", 0.3)]
    forward_selection._pair(search, best, unreported)
    assert ("spring", ["viscous"]) in asked


def test_another_form_of_an_effect_gets_no_second_round_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Stribeck friction with an exponent leaves what the usual form leaves: both are one candidate for a pair."""
    asked: list[tuple[str, ...]] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any, leading: bool) -> list[Any]:
        asked.append(base.trial.parts[0].names)
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    forms = ("delta", "v_s"), ("delta", "v_s", "exponent")
    best = [ranked("stribeck", 0.99, names) for names in forms] + [ranked("offset", 0.3)]
    forward_selection._pair(search, best, unreported)
    assert asked == [forms[0]]


def test_an_effect_with_the_motion_of_a_better_one_gets_no_second_round_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A constant force is an asymmetric friction with another level: on an arm, a round beside each took twice as long.

    The two are no pair either. The progress is reported meanwhile; it stood still for 25 s.
    """
    asked: list[tuple[str, list[str]]] = []
    shares: list[float] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any, leading: bool) -> list[Any]:
        asked.append((base.trial.parts[0].kind, [p.kind for p in parts]))
        progress(0.5)
        return []

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    best = [ranked(kind, share) for kind, share in (("coulomb_asymmetry", 0.9), ("offset", 0.9), ("spring", 0.89))]
    system = best[0].found.trial.system
    best[0].found.part.on, best[1].found.part.on = system.contacts[0].name, system.positions[0].name
    forward_selection._pair(search, best, shares.append)
    assert asked == [("coulomb_asymmetry", ["spring"]), ("spring", ["viscous"])]
    assert shares == [0.5, 0.5]


@pytest.mark.parametrize("at_noise", [True, False])
def test_no_pair_is_sought_beyond_one_that_leaves_only_noise(at_noise: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two effects of a stage left the noise alone; a round of all for a third first effect took a sixth of the time."""
    asked: list[str] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any, leading: bool) -> list[Any]:
        asked.append(base.trial.parts[0].kind)
        found = fit(base.trial.parts[0], parts[0])
        found.cost = 10.0 - len(asked)
        return [SimpleNamespace(found=found, why_not="")]

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [part_named("viscous")])
    monkeypatch.setattr(forward_selection, "at_noise", lambda found: at_noise and found.cost == 8.0)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit)
    kinds = ("offset", "spring", "cogging", "stribeck")
    pair, among_all = forward_selection._pair(search, [ranked(kind, 0.9) for kind in kinds], unreported)
    assert asked == list(kinds[: 2 if at_noise else 3])
    assert pair is not None and [p.kind for p in pair.trial.parts] == [asked[-1], "viscous"] and among_all


@pytest.mark.parametrize(
    ("present", "leading", "kept"), [(None, False, 4), (None, True, 3), (300.0, False, 0), (120.0, False, 2)]
)
def test_candidates_far_behind_are_not_fitted_on_all_segments_where_only_the_best_is_of_use(
    present: float | None, leading: bool, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a spring, 28 candidates for an effect that gained 30,000 nats: the best gained 9,000, six were fitted."""
    gains, parts = (100.0, 70.0, 50.0, 1.0), [part_named("offset")] * 4
    for part in parts:
        part.effect = SimpleNamespace(rough=False)
    fitted: list[float] = []

    class Tried:
        def __init__(self, *_: Any) -> None:
            self.parts = parts

        def start_compiling(self) -> None: ...

        def screened(self, indices: Any) -> list[candidate_fits.Screened]:
            return [candidate_fits.Screened(k, gains[k], np.zeros(1)) for k in indices]

        def promising(self, indices: Any) -> Any:
            return indices

        def gain_of(self, found: float, k: int) -> float:
            return found

        def best_by_force(self, indices: Any) -> list[int]:
            return []

        def fitted(self, screened: Any) -> list[Any]:
            fitted.extend(s.gain for s in screened)
            return []

        def restarted(self, found: Any) -> list[Any]:
            return []

    monkeypatch.setattr(candidate_fits, "CandidateFits", Tried)
    none: Any = None
    candidate_fits.fit_candidates(none, none, parts, none, none if present is None else present, leading)
    assert fitted == list(gains[:kept])


def test_the_same_motion_under_another_name_replaces_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset found second is a Coulomb asymmetry: neither is a rival of the other."""
    system = system_of(stage())
    parts = {(e.kind, place): part_of(e, place, system) for e, place in candidates(system)}
    drift, offset = parts["friction_drift", 0], parts["offset", 0]
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: list(parts.values()))
    search: Any = SimpleNamespace(rigid=None, system=system)
    assert "coulomb_asymmetry" in {c.other for c in offset.effect.confused_with}
    for effects, k in (([drift, offset], 1), ([offset, drift], 0)):
        assert "coulomb_asymmetry" not in {p.kind for p in forward_selection._others(search, effects, k)}


def test_an_effect_that_was_not_chosen_beside_the_others_is_compared_with_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dead zone and an unbalance, a pair of the first round, stood for a dead zone and a backlash: beside the dead
    zone the backlash fitted 60 nats better and was not tried.
    """
    system = system_of(stage())
    every = [part_of(e, place, system) for e, place in candidates(system)]
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: every)
    search: Any = SimpleNamespace(rigid=None, system=system)
    drag, drift = (next(p for p in every if p.kind == kind) for kind in ("quadratic_drag", "friction_drift"))
    both, whole = [drag, drift], {p.kind for p in every}
    for k, among_all in ((0, True), (0, False), (1, False)):
        assert {p.kind for p in forward_selection._others(search, both, k, among_all)} == whole - {both[k].kind}
    alike = {c.other for c in drift.effect.confused_with}
    assert {p.kind for p in forward_selection._others(search, both, 1)} == alike & whole


def test_rivals_of_a_later_effect_put_it_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """An inertia found second, of which the log says no more than that it could be a gain: the verdict is about it."""
    gain = fit(part_named("input_gain"))
    moves: list[int] = []

    def put_first(search: Any, one: Any, k: int) -> Any:
        moves.append(k)
        return "reordered"

    monkeypatch.setattr(forward_selection, "fit_candidates", lambda *_: [gain])
    monkeypatch.setattr(forward_selection, "is_possible", lambda search, found: True)
    monkeypatch.setattr(forward_selection, "matters", lambda *_: True)
    monkeypatch.setattr(forward_selection, "_refused_by_force", lambda *_: False)
    monkeypatch.setattr(forward_selection, "_others", lambda search, parts, k, paired: [gain.part] if k else [])
    monkeypatch.setattr(forward_selection, "tied_by_free_runs", lambda *_: True)
    monkeypatch.setattr(forward_selection, "tolerances_prefer", lambda *_: False)
    monkeypatch.setattr(forward_selection, "most_left", lambda _: 1.0)
    monkeypatch.setattr(forward_selection, "force_prefers", lambda *_: False)
    monkeypatch.setattr(forward_selection, "as_replacement", lambda search, found, without: found)
    monkeypatch.setattr(forward_selection, "_put_first", put_first)
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("viscous_asymmetry"), part_named("inertia_error"))
    current.cost = gain.cost = 5.0
    assert forward_selection._reconsidered(search, current, []) == ("reordered", [gain])
    assert moves == [1]
    monkeypatch.setattr(forward_selection, "force_prefers", lambda *_: True)
    assert forward_selection._reconsidered(search, current, []) == (current, [])


@pytest.mark.parametrize(("noise", "gain", "rivals"), [(200.0, 0.95, 1), (200.0, 0.85, 0), (1.5, 0.95, 0)])
def test_far_from_the_noise_a_replacement_that_is_nearly_alike_ties(
    noise: float, gain: float, rivals: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A motor far from the noise of its encoder: viscous friction and quadratic drag differed by 1.2 % of the square,
    and the drag was named. In a round the two tie.
    """
    drag = fit(part_named("quadratic_drag"))
    for name, value in {
        "fit_candidates": [drag], "is_possible": True, "matters": True, "in_simplest_forms": [drag],
        "_refused_by_force": False, "_force_speaks_for": True, "is_no_better_form": False,
    }.items():  # fmt: skip
        monkeypatch.setattr(forward_selection, name, lambda *_, value=value: value)
    monkeypatch.setattr(forward_selection, "_others", lambda search, parts, k, paired: [] if k else [drag.part])
    monkeypatch.setattr(ranking, "is_far", lambda _: noise > NEAR_NOISE)
    monkeypatch.setattr(ranking, "runs_prefer", lambda *_: True)
    monkeypatch.setattr(forward_selection, "force_prefers", lambda here, other, most: gain < most)
    monkeypatch.setattr(forward_selection, "tolerances_prefer", lambda *_: False)
    shares = {"viscous": 0.6, "quadratic_drag": 0.59}
    monkeypatch.setattr(
        forward_selection,
        "as_replacement",
        lambda search, found, _: SimpleNamespace(
            found=found, evidence=SimpleNamespace(share=shares[found.runner.trial.parts[0].kind])
        ),
    )
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("viscous"), part_named("cogging"))
    current.cost = drag.cost = 100.0
    _, tied = forward_selection._swapped(search, current, None)
    assert [r.found for r in tied.get(0, [])] == [drag] * rivals


@pytest.mark.parametrize(("cost", "rival"), [(96.0, False), (89.0, True)])
def test_a_replacement_of_a_special_form_must_be_clearly_better_to_be_a_rival(
    cost: float, rival: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two equal lags beside a delay that was credited together with another effect: the delay was `ambiguous`."""
    lags = fit(part_named("actuator_lag", ("tau_each",)))
    monkeypatch.setattr(forward_selection, "fit_candidates", lambda *_: [lags])
    monkeypatch.setattr(forward_selection, "is_possible", lambda search, found: True)
    monkeypatch.setattr(forward_selection, "matters", lambda *_: True)
    monkeypatch.setattr(forward_selection, "in_simplest_forms", lambda found: found)
    monkeypatch.setattr(forward_selection, "_refused_by_force", lambda *_: False)
    monkeypatch.setattr(forward_selection, "_force_speaks_for", lambda *_: True)
    monkeypatch.setattr(forward_selection, "_others", lambda search, parts, k, paired: [] if k else [lags.part])
    monkeypatch.setattr(forward_selection, "tied_by_free_runs", lambda *_: True)
    monkeypatch.setattr(forward_selection, "tolerances_prefer", lambda *_: False)
    monkeypatch.setattr(forward_selection, "most_left", lambda _: 1.0)
    monkeypatch.setattr(forward_selection, "force_prefers", lambda *_: False)
    monkeypatch.setattr(forward_selection, "as_replacement", lambda search, found, without: found)
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("input_delay"), part_named("viscous_asymmetry"))
    current.cost, lags.cost = 100.0, cost
    assert forward_selection._swapped(search, current, None) == (None, {0: [lags]} if rival else {})


@pytest.mark.parametrize(
    ("near", "prefers", "speaks"), [(False, True, True), (True, True, False), (False, False, False)]
)
def test_a_replacement_that_the_force_residual_speaks_against_is_none_far_from_the_noise(
    near: bool, prefers: bool, speaks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A saturation found to 0.4 % gave way to a soft compliance by a few nats of free runs at 25 times the noise."""
    monkeypatch.setattr(forward_selection.credit, "near_noise", lambda found: near)
    monkeypatch.setattr(forward_selection, "force_prefers", lambda here, other, most: prefers)
    here: Any = SimpleNamespace(search=None)
    assert forward_selection._force_speaks_for(here, fit(part_named("compliance"))) is speaks


@pytest.mark.parametrize(
    ("cost", "names", "level", "chosen"),
    [(754.50, "b", 4.0, 1), (756.0, "b", 4.0, 0), (754.50, "b", 2.3, 0), (754.50, "b v_s", 4.0, 0)],
)
def test_of_replacements_that_fit_equally_the_one_nearest_to_the_declared_levels_is_chosen(
    cost: float, names: str, level: float, chosen: int
) -> None:
    """Beside a gain, viscous friction and an inertia error are one motion: 1e-7 nats chose a level of 2.4 N of 4."""
    search: Any = SimpleNamespace(
        moved=("F", "m"), problem=SimpleNamespace(levels=("F",)), declared=np.array([4.0, 2.0])
    )
    found: list[Any] = [
        SimpleNamespace(cost=one, part=SimpleNamespace(names=own.split()), values=(np.array([a, 2.0]), []))
        for one, own, a in ((754.46, "delta", 2.4), (cost, names, level))
    ]
    assert nearest_of_equal(search, found) is found[chosen]
    assert nearest_of_equal(search, []) is None


def test_a_replacement_whose_period_the_log_cannot_show_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Part of a wave longer than the stroke fits a spring's line; it replaced the spring and was then refused."""
    wave = fit(part_named("cogging"))
    wave.cost, wave.model, wave.parameters = 0.0, None, {}
    monkeypatch.setattr(forward_selection, "fit_candidates", lambda *_: [wave])
    monkeypatch.setattr(forward_selection, "_others", lambda search, parts, k, paired: [wave.part])
    monkeypatch.setattr(refusals, "hides_an_effect", lambda search, found: "")
    monkeypatch.setattr(refusals, "admissible", lambda search, found: True)
    monkeypatch.setattr(forward_selection, "matters", lambda *_: True)
    refusing = "corrects_a_form", "contradicted_by_force"
    for test in refusing:
        monkeypatch.setattr(forward_selection, test, lambda *_: "")
    monkeypatch.setattr(refusals, "acts_as_its_limit", lambda search, found: "")
    monkeypatch.setattr(refusals, "unseen", lambda search, part, values: "longer than the stroke")
    monkeypatch.setattr(refusals, "takes_the_level", lambda problem, system, model: "")
    shared = {"problem": None, "system": None}
    search: Any = SimpleNamespace(
        rigid=None, without=lambda current, k: current, fitted_again=lambda fit: fit, **shared
    )
    monkeypatch.setattr(forward_selection, "as_replacement", lambda search, found, without: found)
    monkeypatch.setattr(forward_selection, "most_left", lambda _: 1.0)
    current = fit(part_named("spring"), part_named("viscous_asymmetry"))
    current.cost = 100.0
    assert forward_selection._swapped(search, current, []) == (None, {})
    monkeypatch.setattr(refusals, "unseen", lambda search, part, values: "")
    monkeypatch.setattr(forward_selection, "_force_speaks_for", lambda here, found: False)
    assert forward_selection._swapped(search, current, [])[0] is wave
    monkeypatch.setattr(forward_selection, "_force_speaks_for", lambda here, found: True)
    monkeypatch.setattr(forward_selection, "tied_by_free_runs", lambda *_: False)
    assert forward_selection._swapped(search, current, []) == (None, {})
    monkeypatch.setattr(forward_selection, "_force_speaks_for", lambda here, found: False)
    monkeypatch.setattr(forward_selection, "matters", lambda *_: False)  # a lag of 1e-15 s ties with anything
    assert forward_selection._swapped(search, current, []) == (None, {})
    monkeypatch.setattr(forward_selection, "matters", lambda *_: True)
    for test in refusing:
        monkeypatch.setattr(forward_selection, test, lambda *_: "leaves more than there was")
        assert forward_selection._swapped(search, current, []) == (None, {})
        monkeypatch.setattr(forward_selection, test, lambda *_: "")


@pytest.mark.parametrize(("left", "kept"), [(("wave", "dead_zone"), True), (("dead_zone",), False)])
def test_rivals_of_an_effect_that_is_dropped_are_dropped(
    left: tuple[str, ...], kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third effect that ties with another came first and was pruned: its rival is none of the effect behind it."""
    search: Any = None
    before, after = (fit(*map(part_named, kinds)) for kinds in (("wave", "dead_zone"), left))
    monkeypatch.setattr(forward_selection, "pruned", lambda search, current, candidates: after)
    rivals: Any = [rival("hardening_spring")]
    assert forward_selection._pruned_with_rivals(search, before, rivals) == (after, rivals if kept else [])


@pytest.mark.parametrize(
    ("cost", "refused", "kept"),
    [
        (95.0, (), ["sharp"]),
        (85.0, (), ["sharp", "rounded"]),
        (95.0, ("sharp",), ["sharp", "rounded"]),
        (95.0, ("rounded",), ["sharp"]),
        (95.0, ("sharp", "rounded"), ["sharp"]),
    ],
)
def test_a_form_with_more_parameters_must_fit_clearly_better_than_one_that_is_admitted(
    cost: float, refused: tuple[str, ...], kept: list[str]
) -> None:
    """A rounded saturation is tried with the sharp one; 10 nats decide, unless the sharp one alone is refused."""
    names = {"sharp": ("limit",), "rounded": ("limit", "rounding")}
    effect = CATALOGUE["saturation"]
    parts = {k: SimpleNamespace(kind="saturation", on="w", names=n, effect=effect) for k, n in names.items()}
    fits = {k: SimpleNamespace(part=parts[k], cost=c) for k, c in zip(names, (100.0, cost), strict=True)}
    for words, unsure in (("fits only with unphysical values", False), ("may be chance", True)):
        tried: list[Any] = [
            SimpleNamespace(
                found=fit, why_not=words * (k in refused), unsure=unsure and k in refused, contradicted=False
            )
            for k, fit in fits.items()
        ]
        assert [r.found for r in ranking.in_simplest_admitted_forms(tried)] == [fits[k] for k in kept]
    possible: list[Any] = [fit for k, fit in fits.items() if k not in refused]
    simplest = [fits[k] for k in kept if k not in refused]
    assert candidate_fits.in_simplest_forms(possible) == simplest


def test_forms_of_an_effect_are_one_hypothesis() -> None:
    """Bonferroni's correction counts a saturation with and without rounding once; each place of an effect counts."""
    system = system_of(stage())
    parts = [part_of(form, place, system) for effect, place in candidates(system) for form in effect.forms]
    kinds = {(effect.kind, place) for effect, place in candidates(system)}
    assert len(parts) > len(kinds) == significance.hypotheses(parts)


def test_a_large_p_is_told_with_the_number_of_hypotheses() -> None:
    """ "Better on 8 of 8 held-out parts, with p = 1 over all candidates" contradicted itself to a reader."""
    told = significance.chance_in_words(1.0, 5400.0)
    assert told.startswith("of 5,400 hypotheses tried (effects, places, periods) one gains as much without any effect")
    assert told.endswith("p = 1, and at most 0.01 is accepted")
    assert "hypotheses" not in significance.chance_in_words(0.02, 1.0)


def test_an_unknown_period_counts_as_many_hypotheses_and_sets_of_effects_each() -> None:
    """Of a ramp of 1 m at 0.1 m/s, a fine filter of 20 Hz shows waves down to 5 mm: 200 in the stroke. 20 candidates
    make 190 pairs.
    """
    time = np.arange(0.0, 10.0, 0.002)
    motion = SimpleNamespace(
        positions=0.1 * time[:, None],
        velocities=np.full((len(time), 1), 0.1),
        usable=np.ones(len(time), dtype=bool),
        fine_hz=20.0,
    )
    search: Any = SimpleNamespace(system=system_of(stage()), motion=motion)

    def model(*kinds: str) -> Any:
        parts = tuple(part_of(CATALOGUE[kind], 0, search.system) for kind in kinds)
        values = [dict.fromkeys(p.names, 0.1) for p in parts]
        return SimpleNamespace(trial=SimpleNamespace(parts=parts), values=([], values))

    def tried(*kinds: str, before: tuple[str, ...] = ()) -> float:
        return significance.tried(search, model(*before), model(*kinds), 20)

    assert tried("viscous", "spring", before=("spring",)) == 20
    assert tried("viscous", "spring") == 190
    # The periods that are asked for are 16 % apart.
    assert 200 / 1.16 <= tried("cogging") / 20 <= 200
    assert tried("cogging", "spring") == pytest.approx(190 * tried("cogging") / 20)


@pytest.mark.parametrize(("sizes", "moved"), [((0.1, 0.3), 1), ((0.3, 0.1), None)])
def test_the_effect_of_the_largest_force_is_named_first(
    sizes: tuple[float, float], moved: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = system_of(stage())
    parts = [part_of(effect, place, system) for effect, place in candidates(system) if effect.kind in LATE]
    share_of = dict(zip(LATE, sizes, strict=True))
    monkeypatch.setattr(forward_selection, "force_share", lambda search, part, values: share_of[part.kind])
    monkeypatch.setattr(forward_selection, "_put_first", lambda search, fit, k: k)
    trial = SimpleNamespace(parts=parts, changed=system, system=system, split=lambda theta: (None, [{}, {}]))
    both: Any = SimpleNamespace(trial=trial, values=(None, [{}, {}]))
    found: Any = forward_selection._largest_first(None, both)  # type: ignore[arg-type]
    assert found == moved if moved is not None else found is both


def test_without_an_effect_nothing_is_put_first() -> None:
    """Where dropping one of two effects leaves the other without credit: an error that ended the diagnosis."""
    none: Any = fit()
    assert forward_selection._largest_first(none, none) is none


LATE = ("input_delay", "actuator_lag")


@pytest.mark.parametrize(("far", "paired"), [(0, False), (7, True)])
def test_effects_are_tried_in_pairs_where_the_best_alone_is_far_off_in_some_segments(
    far: int, paired: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lag and a gain: two equal lags alone were 1.4 times the noise off in the median, and ten times in a third."""
    squares = np.where(np.arange(20) < far, 1e4, 40.0)
    alone, pair = fit("lags"), fit("lag", "gain")
    for one, cost in ((alone, 9.0), (pair, 1.0)):
        one.cost, one.by_segment, one.residual = cost, squares, np.zeros((20, 40))
    best = SimpleNamespace(found=alone, why_not="", unsure=False, contradicted=False, for_table=None)
    asked: list[Any] = []

    def in_pairs(search: Any, some: Any, progress: Any) -> Any:
        asked.append(some)
        return pair, True

    for name, value in {
        "every_part": [],
        "run_round": [best],
        "hypotheses": 1,
        "ties": [],
        "credible": True,
        "worth_it": True,
        "explained_share": 1.0,
        "_split": None,
        "_reconsidered": (pair, []),
        "_pruned_with_rivals": (pair, []),
        "still_credited": (pair, []),
        "_largest_first": pair,
    }.items():
        monkeypatch.setattr(forward_selection, name, lambda *_, value=value: value)
    monkeypatch.setattr(forward_selection, "leader_first", lambda search, some: some)
    monkeypatch.setattr(forward_selection, "_in_simplest_forms", lambda search, one, rivals: (one, rivals))
    monkeypatch.setattr(forward_selection, "_pair", in_pairs)
    monkeypatch.setattr(forward_selection, "at_noise", lambda fit: fit is pair)
    monkeypatch.setattr(forward_selection.credit, "is_negligible", lambda fit: False)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda one: one, record=SimpleNamespace(start=[0.0]))
    found = forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert found.final is (pair if paired else alone) and asked == [[best]] * paired
    monkeypatch.setattr(forward_selection.credit, "is_negligible", lambda fit: fit is alone)
    forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert asked == [[best]] * paired, "nothing is left that a pair could explain"
    monkeypatch.setattr(forward_selection.credit, "is_negligible", lambda fit: False)
    monkeypatch.setattr(forward_selection, "at_noise", lambda fit: True)
    forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert asked == [[best]] * paired, "the effects of the rounds leave only noise"


@pytest.mark.parametrize(("cost", "kinds"), [(104.0, "c"), (111.0, "b")])
def test_a_play_of_nothing_is_a_spring(cost: float, kinds: str) -> None:
    """Beside an inertia error a play was named that came out as 6.6e-15 rad."""
    system = system_of(stage())
    play, spring, offset = (part_of(CATALOGUE[kind], 0, system) for kind in ("backlash", "compliance", "offset"))
    own = {"k": 30.0, "c": 0.1, "load_fraction": 0.3}
    current: Any = SimpleNamespace(
        trial=SimpleNamespace(parts=(offset, play)),
        values=([4.0], [{"f0": 1.0}, own | {"gap": 1e-15}]),
        cost=100.0,
    )

    def with_parts(fit: Any, moved: Any, parts: Any, values: Any) -> Any:
        assert (moved, parts, values) == ([4.0], [offset, spring], [{"f0": 1.0}, own])
        return SimpleNamespace(trial=SimpleNamespace(parts=tuple(parts)), values=(moved, values), cost=cost)

    search: Any = SimpleNamespace(system=system, rigid=None, with_parts=with_parts)
    rivals: Any = [SimpleNamespace(found=SimpleNamespace(part=p)) for p in (spring, offset)]
    found, left = forward_selection._in_simplest_forms(search, current, rivals)
    assert found.trial.parts == ((offset, spring) if kinds == "c" else (offset, play))
    assert left == (rivals[1:] if kinds == "c" else rivals)


def test_a_replacement_without_its_gap_is_a_spring_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A play with a gap of 3e-17 rad took the place of a cogging, and was named beside a friction drift."""
    first, play, spring = fit("drift", "cogging"), fit("drift", "backlash"), fit("drift", "compliance")
    for one in (first, play, spring):
        one.cost, one.by_segment, one.residual = 9.0, np.full(20, 40.0), np.zeros((20, 40))
    best = SimpleNamespace(found=first, why_not="", unsure=False, contradicted=False)
    for name, value in {
        "every_part": [],
        "run_round": [best],
        "hypotheses": 1,
        "ties": [],
        "credible": True,
        "nothing_left": True,
        "explained_share": 1.0,
        "_pair": None,
        "_split": None,
        "_reconsidered": (play, []),
        "_pruned_with_rivals": (play, []),
    }.items():
        monkeypatch.setattr(forward_selection, name, lambda *_, value=value: value)
    seen = lambda search, found, rivals: (spring if found is play else found, rivals)  # noqa: E731
    monkeypatch.setattr(forward_selection, "_in_simplest_forms", seen)
    monkeypatch.setattr(forward_selection, "leader_first", lambda search, some: some)
    monkeypatch.setattr(forward_selection, "still_credited", lambda search, base, found, rivals: (found, []))
    monkeypatch.setattr(forward_selection, "_largest_first", lambda search, found: found)
    monkeypatch.setattr(forward_selection.credit, "near_noise", lambda fit: True)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda one: one, record=SimpleNamespace(start=[0.0]))
    assert forward_selection.find_effects(search, fit(), lambda turn, share: None).final is spring


@dataclass(frozen=True)
class JointFit:
    """A fit of an arm: the loss that each joint has left, and its effects, named by the joint at which they are."""

    left: dict[int, float]
    trial: Any

    @property
    def cost(self) -> float:
        return sum(self.left.values())

    def of_joint(self, joint: int) -> JointFit:
        return replace(self, left={joint: self.left[joint]})


def test_each_joint_of_an_arm_has_rounds_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """The dead zone of a quiet joint was never tried, since a round that credited nothing at a loud one ended all.

    Effects on two joints are no rivals, as neither explains what is left at the other's joint: a spring of 22 N·m/rad,
    found as 22.1, tied with a weaker motor of another joint.
    """
    asked: list[int] = []
    compared: list[set[int]] = []

    def after(fit: JointFit, part: Any, left: float) -> JointFit:
        return JointFit(fit.left | {part.place: left}, SimpleNamespace(parts=(*fit.trial.parts, part)))

    def run_round(search: Any, current: JointFit, parts: Any, progress: Any) -> list[Any]:
        (joint,) = {p.place for p in parts}
        asked.append(joint)
        found = after(current, SimpleNamespace(place=joint, kind=f"effect {len(asked)}"), 1.0)
        found = SimpleNamespace(
            found=found,
            why_not="no" if joint == 2 or current.left[joint] == 1 else "",
            unsure=False,
            contradicted=False,
            for_table=found,
        )
        return [found]

    def ties(search: Any, some: Any) -> list[Any]:
        compared.append({r.found.trial.parts[-1].place for r in some})
        return []

    for name, value in {
        "run_round": run_round,
        "every_part": lambda search, taken: [SimpleNamespace(place=k) for k in range(4)],
        "joint_of": lambda search, part: part.place,
        "hypotheses": lambda parts: len(parts),
        "ties": ties,
        "credible": lambda search, before, after, count: True,
        "nothing_left": lambda own: own.cost < 0.5,
        "explained_share": lambda search, before, after: 1.0,
        "_pair": lambda search, some, progress: None,
        "_split": lambda search, found, progress: None,
        "_in_simplest_forms": lambda search, found, rivals: (found, rivals),
        "_reconsidered": lambda search, found, rivals, among_all, progress: (found, []),
        "_pruned_with_rivals": lambda search, found, rivals: (found, []),
        "still_credited": lambda search, base, found, rivals: (found, []),
        "_largest_first": lambda search, found: found,
        "leader_first": lambda search, some: some,
    }.items():
        monkeypatch.setattr(forward_selection, name, value)
    monkeypatch.setattr(forward_selection.credit, "near_noise", lambda fit: True)
    search: Any = SimpleNamespace(
        rigid=object(),
        fitted_again=lambda one: one,
        record=SimpleNamespace(start=[0.0], joints=(0, 1, 2, 3)),
    )
    base: Any = JointFit({0: 30.0, 1: 0.1, 2: 900.0, 3: 80.0}, SimpleNamespace(parts=()))
    found: Any = forward_selection.find_effects(search, base, lambda turn, share: None)
    assert asked == [2, 3, 0, 0, 3], "the loudest joint first, and again where an effect was found; 1 is at the noise"
    assert [p.place for p in found.final.trial.parts] == [3, 0]
    assert compared == [{3}, {0}]
    assert len(found.later) == len(asked) - 1
    asked.clear()
    found = forward_selection.find_effects(search, base, lambda turn, share: None, False, lambda fit: True)
    assert asked == [2, 3] and [p.place for p in found.final.trial.parts] == [3]


@pytest.mark.parametrize(("share", "named"), [(0.946, ("offset",)), (0.5, ())])
@pytest.mark.parametrize("beside", [(), ("cogging",)])
def test_an_effect_that_passes_alone_is_tried_where_a_doubtful_one_gets_no_second(
    beside: tuple[str, ...], share: float, named: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lift's counterbalance: a gain fitted a little better than the offset, and failed the significance test with
    whatever was added to it. The offset had passed every test, and the verdict was `unknown`. An effect that predicts
    held-out segments clearly worse than the doubtful one does not take its place. With a doubtful second effect no
    third is sought.
    """
    rounds = {(): ("input_gain", "offset"), ("input_gain",): beside, ("offset",): ()}
    credited = [("offset",)]
    begun: list[tuple[str, ...]] = []

    def run_round(search: Any, base: Any, parts: Any, progress: Any) -> list[Any]:
        begun.append(base.trial.parts)
        found = [fit(*base.trial.parts, kind) for kind in rounds.get(base.trial.parts, ())]
        doubtful = ("input_gain", "cogging")
        shares = [SimpleNamespace(share=share if f.part == "offset" else 0.953) for f in found]
        return [
            SimpleNamespace(
                found=f, evidence=e, why_not=f.part in doubtful, unsure=True, contradicted=False, for_table=f
            )
            for f, e in zip(found, shares, strict=True)
        ]

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "credible", lambda search, a, b, count: b.trial.parts in credited)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [])
    monkeypatch.setattr(forward_selection, "joint_of", lambda search, part: None)
    monkeypatch.setattr(forward_selection, "hypotheses", lambda parts: 1)
    monkeypatch.setattr(forward_selection, "leader_first", lambda search, found: list(found))
    monkeypatch.setattr(forward_selection, "ties", lambda search, found: found[1:])
    monkeypatch.setattr(forward_selection, "nothing_left", lambda found: False)
    monkeypatch.setattr(forward_selection, "explained_share", lambda search, a, b: 1.0)
    monkeypatch.setattr(forward_selection, "_split", lambda search, current, progress: None)
    monkeypatch.setattr(forward_selection, "_in_simplest_forms", lambda search, current, rivals: (current, rivals))
    monkeypatch.setattr(forward_selection, "refused_when_fitted_again", lambda first, chosen: first)
    monkeypatch.setattr(forward_selection.credit, "near_noise", lambda found: True)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit, record=SimpleNamespace(start=[]))
    outcome = forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert outcome.parts == named
    # The doubtful leader fits better: it ties with the effect that takes its place, which is no rival of itself.
    assert [r.found.part for r in outcome.rivals] == (["input_gain"] if named else [])
    assert begun == [(), ("input_gain",), *([named] if named else [])]
