"""Rounds of candidates: what stands where effects were dropped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import (
    candidate_fits,
    forward_selection,
    parsimony,
    ranking,
    significance,
)
from codegen.effects import CATALOGUE
from codegen.effects.register import candidates
from tests.diagnosis.fakes import InRound, Placed, fit, part_named
from tests.diagnosis.stage import stage, system_of


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
    candidate_fits.fit_candidates(none, none, parts, none if present is None else present, leading)
    assert fitted == list(gains[:kept])


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
    parts = {k: Placed(kind="saturation", on="w", names=n, effect=effect) for k, n in names.items()}
    fits = {k: SimpleNamespace(part=parts[k], cost=c) for k, c in zip(names, (100.0, cost), strict=True)}
    for words, insignificant in (("fits only with unphysical values", False), ("may be chance", True)):
        tried: list[Any] = [
            InRound(
                found=fit,
                why_not=words * (k in refused),
                insignificant=insignificant and k in refused,
                contradicted=False,
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
        return significance.hypotheses_tried(search, model(*before), model(*kinds), 20)

    assert tried("viscous", "spring", before=("spring",)) == 20
    assert tried("viscous", "spring") == 190
    # The periods that are asked for are 16 % apart.
    assert 200 / 1.16 <= tried("cogging") / 20 <= 200
    assert tried("cogging", "spring") == pytest.approx(190 * tried("cogging") / 20)


@pytest.mark.parametrize(("far", "paired"), [(0, False), (7, True)])
def test_effects_are_tried_in_pairs_where_the_best_alone_is_far_off_in_some_segments(
    far: int, paired: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lag and a gain: two equal lags alone were 1.4 times the noise off in the median, and ten times in a third."""
    squares = np.where(np.arange(20) < far, 1e4, 40.0)
    alone, pair = fit("lags"), fit("lag", "gain")
    for one, cost in ((alone, 9.0), (pair, 1.0)):
        one.cost, one.by_segment, one.residual = cost, squares, np.zeros((20, 40))
    best = InRound(found=alone, why_not="", insignificant=False, contradicted=False, for_table=None)
    asked: list[Any] = []

    def in_pairs(search: Any, some: Any) -> Any:
        asked.append(some)
        return [forward_selection.SecondRound(best, (), pair)]

    for name, value in {
        "every_part": [],
        "run_round": [best],
        "hypotheses": 1,
        "ties": [],
        "credible": True,
        "worth_it": True,
        "explains_enough": True,
        "explained_share": 1.0,
    }.items():
        monkeypatch.setattr(forward_selection, name, lambda *_, value=value: value)
    monkeypatch.setattr(forward_selection, "leader_first", lambda search, some: some)
    monkeypatch.setattr(forward_selection, "with_simplest_effects", lambda search, one, rivals: (one, rivals))
    monkeypatch.setattr(forward_selection, "second_rounds", in_pairs)
    monkeypatch.setattr(forward_selection, "judged_together", lambda search, base, found, *_: (found, []))
    for where in (forward_selection, parsimony):
        monkeypatch.setattr(where, "at_noise", lambda fit: fit is pair)
    monkeypatch.setattr(forward_selection.acceptance, "is_negligible", lambda fit: False)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda one: one, record=SimpleNamespace(start=[0.0]))
    found = forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert found.final is (pair if paired else alone) and asked == [[best]] * paired
    monkeypatch.setattr(forward_selection.acceptance, "is_negligible", lambda fit: fit is alone)
    forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert asked == [[best]] * paired, "nothing is left that a pair could explain"
    monkeypatch.setattr(forward_selection.acceptance, "is_negligible", lambda fit: False)
    for where in (forward_selection, parsimony):
        monkeypatch.setattr(where, "at_noise", lambda fit: True)
    forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert asked == [[best]] * paired, "the effects of the rounds leave only noise"


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
    """The dead zone of a quiet joint was never tried, since a round that accepted nothing at a loud one ended all.

    Effects on two joints are no rivals, as neither explains what is left at the other's joint: a spring of 22 N·m/rad,
    found as 22.1, tied with a weaker motor of another joint.
    """
    asked: list[int] = []
    compared: list[set[int]] = []

    def after(fit: JointFit, part: Any, left: float) -> JointFit:
        return JointFit(fit.left | {part.place: left}, SimpleNamespace(parts=(*fit.trial.parts, part)))

    def run_round(search: Any, current: JointFit, parts: Any) -> list[Any]:
        (joint,) = {p.place for p in parts}
        asked.append(joint)
        found = after(current, SimpleNamespace(place=joint, kind=f"effect {len(asked)}"), 1.0)
        found = InRound(
            found=found,
            why_not="no" if joint == 2 or current.left[joint] == 1 else "",
            insignificant=False,
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
        "explains_enough": lambda search, before, after: True,
        "second_rounds": lambda search, some: [],
        "with_simplest_effects": lambda search, found, rivals: (found, rivals),
        "judged_together": lambda search, base, found, *_: (found, []),
        "leader_first": lambda search, some: some,
    }.items():
        monkeypatch.setattr(forward_selection, name, value)
    monkeypatch.setattr(forward_selection.acceptance, "near_noise", lambda fit: True)
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


@pytest.mark.parametrize("beside", [(), ("cogging",)])
def test_with_an_effect_in_doubt_one_more_is_sought_and_no_third(
    beside: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = {(): ("input_gain", "offset"), ("input_gain",): beside}
    begun: list[tuple[str, ...]] = []

    def run_round(search: Any, base: Any, parts: Any) -> list[Any]:
        begun.append(base.trial.parts)
        found = [fit(*base.trial.parts, kind) for kind in rounds.get(base.trial.parts, ())]
        return [
            InRound(found=f, why_not="may be chance", insignificant=True, contradicted=False, for_table=f)
            for f in found
        ]

    monkeypatch.setattr(forward_selection, "run_round", run_round)
    monkeypatch.setattr(forward_selection, "credible", lambda *_: False)
    monkeypatch.setattr(forward_selection, "every_part", lambda search, taken: [])
    monkeypatch.setattr(forward_selection, "joint_of", lambda search, part: None)
    monkeypatch.setattr(forward_selection, "hypotheses", lambda parts: 1)
    monkeypatch.setattr(forward_selection, "leader_first", lambda search, found: list(found))
    monkeypatch.setattr(forward_selection, "ties", lambda search, found: found[1:])
    monkeypatch.setattr(forward_selection, "nothing_left", lambda found: False)
    monkeypatch.setattr(forward_selection, "explained_share", lambda search, a, b: 1.0)
    monkeypatch.setattr(forward_selection, "with_simplest_effects", lambda search, current, rivals: (current, rivals))
    monkeypatch.setattr(forward_selection, "refused_when_fitted_again", lambda first, chosen: first)
    monkeypatch.setattr(forward_selection.acceptance, "near_noise", lambda found: True)
    search: Any = SimpleNamespace(rigid=None, fitted_again=lambda fit: fit, record=SimpleNamespace(start=[]))
    outcome = forward_selection.find_effects(search, fit(), lambda turn, share: None)
    assert outcome.parts == () and begun == [(), ("input_gain",)]
