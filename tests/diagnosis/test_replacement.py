"""Effects compared with others in their place, each in its simplest form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.fit.acceptance import NEAR_NOISE
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import comparison, parsimony, refusals
from codegen.diagnosis.selection.comparison import nearest_of_equal
from codegen.effects import CATALOGUE
from codegen.effects.register import candidates
from tests.diagnosis.fakes import InRound, fit, part_named
from tests.diagnosis.stage import stage, system_of

LATE = ("input_delay", "actuator_lag")


def test_the_same_motion_under_another_name_replaces_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset found second is a Coulomb asymmetry: neither is a rival of the other."""
    system = system_of(stage())
    parts = {(e.kind, place): part_of(e, place, system) for e, place in candidates(system)}
    drift, offset = parts["friction_drift", 0], parts["offset", 0]
    monkeypatch.setattr(parsimony, "every_part", lambda search, taken: list(parts.values()))
    search: Any = SimpleNamespace(rigid=None, system=system)
    assert "coulomb_asymmetry" in {c.other for c in offset.effect.confused_with}
    for effects, k in (([drift, offset], 1), ([offset, drift], 0)):
        assert "coulomb_asymmetry" not in {p.kind for p in parsimony.possible_replacements(search, effects, k)}


def test_an_effect_that_was_not_chosen_beside_the_others_is_compared_with_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dead zone and an unbalance, a pair of the first round, stood for a dead zone and a backlash: beside the dead
    zone the backlash fitted 60 nats better and was not tried.
    """
    system = system_of(stage())
    every = [part_of(e, place, system) for e, place in candidates(system)]
    monkeypatch.setattr(parsimony, "every_part", lambda search, taken: every)
    search: Any = SimpleNamespace(rigid=None, system=system)
    drag, drift = (next(p for p in every if p.kind == kind) for kind in ("quadratic_drag", "friction_drift"))
    both, whole = [drag, drift], {p.kind for p in every}
    for k, among_all in ((0, True), (0, False), (1, False)):
        assert {p.kind for p in parsimony.possible_replacements(search, both, k, among_all)} == whole - {both[k].kind}
    alike = {c.other for c in drift.effect.confused_with}
    assert {p.kind for p in parsimony.possible_replacements(search, both, 1)} == alike & whole


def test_rivals_of_a_later_effect_put_it_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """An inertia found second, of which the log says no more than that it could be a gain: the verdict is about it."""
    gain = fit(part_named("input_gain"))
    moves: list[int] = []

    def put_first(search: Any, one: Any, k: int) -> Any:
        moves.append(k)
        return "reordered"

    monkeypatch.setattr(parsimony, "fit_candidates", lambda *_: [gain])
    monkeypatch.setattr(parsimony, "is_possible", lambda search, found: True)
    monkeypatch.setattr(parsimony, "matters", lambda *_: True)
    monkeypatch.setattr(parsimony, "corrects_a_form", lambda *_: "")
    monkeypatch.setattr(parsimony, "contradicted_by_force", lambda *_: "")
    monkeypatch.setattr(parsimony, "only_attenuates_noise", lambda *_: "")
    monkeypatch.setattr(parsimony, "possible_replacements", lambda search, parts, k, paired: [gain.part] if k else [])
    monkeypatch.setattr(parsimony, "tied_by_free_runs", lambda *_: True)
    monkeypatch.setattr(parsimony, "tolerances_prefer", lambda *_: False)
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: 0.06)
    monkeypatch.setattr(parsimony, "most_left", lambda _: 1.0)
    monkeypatch.setattr(parsimony, "force_prefers", lambda *_: False)
    monkeypatch.setattr(parsimony, "as_replacement", lambda search, found, without: found)
    monkeypatch.setattr(parsimony, "put_first", put_first)
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("viscous_asymmetry"), part_named("inertia_error"))
    current.cost = gain.cost = 5.0
    assert parsimony.reconsidered(search, current, []) == ("reordered", [gain])
    assert moves == [1]
    # A weight that explains nothing in the place of a wave.
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: 0.04)
    assert parsimony.reconsidered(search, current, []) == (current, [])
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: 0.06)
    monkeypatch.setattr(parsimony, "force_prefers", lambda *_: True)
    assert parsimony.reconsidered(search, current, []) == (current, [])


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
        "corrects_a_form": "", "contradicted_by_force": "", "only_attenuates_noise": "", "force_speaks_for": True,
        "is_no_better_form": False,
    }.items():  # fmt: skip
        monkeypatch.setattr(parsimony, name, lambda *_, value=value: value)
    monkeypatch.setattr(parsimony, "possible_replacements", lambda search, parts, k, paired: [] if k else [drag.part])
    monkeypatch.setattr(comparison, "is_far", lambda _: noise > NEAR_NOISE)
    monkeypatch.setattr(comparison, "runs_prefer", lambda *_: True)
    monkeypatch.setattr(parsimony, "force_prefers", lambda here, other, most: gain < most)
    monkeypatch.setattr(parsimony, "tolerances_prefer", lambda *_: False)
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: 0.06)
    shares = {"viscous": 0.6, "quadratic_drag": 0.59}
    monkeypatch.setattr(
        parsimony,
        "as_replacement",
        lambda search, found, _: InRound(
            found=found, evidence=SimpleNamespace(share=shares[found.runner.trial.parts[0].kind])
        ),
    )
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("viscous"), part_named("cogging"))
    current.cost = drag.cost = 100.0
    _, tied = parsimony.swapped(search, current, None)
    assert [r.found for r in tied.get(0, [])] == [drag] * rivals


@pytest.mark.parametrize(("cost", "rival"), [(96.0, False), (89.0, True)])
def test_a_replacement_of_a_special_form_must_be_clearly_better_to_be_a_rival(
    cost: float, rival: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two equal lags beside a delay that was accepted together with another effect: the delay was `ambiguous`."""
    lags = fit(part_named("actuator_lag", ("tau_each",)))
    monkeypatch.setattr(parsimony, "fit_candidates", lambda *_: [lags])
    monkeypatch.setattr(parsimony, "is_possible", lambda search, found: True)
    monkeypatch.setattr(parsimony, "matters", lambda *_: True)
    monkeypatch.setattr(parsimony, "in_simplest_forms", lambda found: found)
    monkeypatch.setattr(parsimony, "corrects_a_form", lambda *_: "")
    monkeypatch.setattr(parsimony, "contradicted_by_force", lambda *_: "")
    monkeypatch.setattr(parsimony, "only_attenuates_noise", lambda *_: "")
    monkeypatch.setattr(parsimony, "force_speaks_for", lambda *_: True)
    monkeypatch.setattr(parsimony, "possible_replacements", lambda search, parts, k, paired: [] if k else [lags.part])
    monkeypatch.setattr(parsimony, "tied_by_free_runs", lambda *_: True)
    monkeypatch.setattr(parsimony, "tolerances_prefer", lambda *_: False)
    monkeypatch.setattr(parsimony, "explained_share", lambda *_: 0.06)
    monkeypatch.setattr(parsimony, "most_left", lambda _: 1.0)
    monkeypatch.setattr(parsimony, "force_prefers", lambda *_: False)
    monkeypatch.setattr(parsimony, "as_replacement", lambda search, found, without: found)
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current)
    current = fit(part_named("input_delay"), part_named("viscous_asymmetry"))
    current.cost, lags.cost = 100.0, cost
    assert parsimony.swapped(search, current, None) == (None, {0: [lags]} if rival else {})


@pytest.mark.parametrize(
    ("near", "prefers", "speaks"), [(False, True, True), (True, True, False), (False, False, False)]
)
def test_a_replacement_that_the_force_residual_speaks_against_is_none_far_from_the_noise(
    near: bool, prefers: bool, speaks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A saturation found to 0.4 % gave way to a soft compliance by a few nats of free runs at 25 times the noise."""
    monkeypatch.setattr(parsimony.acceptance, "near_noise", lambda found: near)
    monkeypatch.setattr(parsimony, "force_prefers", lambda here, other, most: prefers)
    here: Any = SimpleNamespace(search=None)
    assert parsimony.force_speaks_for(here, fit(part_named("compliance"))) is speaks


@pytest.mark.parametrize(
    ("cost", "names", "level", "chosen"),
    [(754.50, "b", 4.0, 1), (756.0, "b", 4.0, 0), (754.50, "b", 2.3, 0), (754.50, "b v_s", 4.0, 0)],
)
def test_of_replacements_that_fit_equally_the_one_nearest_to_the_declared_levels_is_chosen(
    cost: float, names: str, level: float, chosen: int
) -> None:
    """Beside a gain, viscous friction and an inertia error are one motion: 1e-7 nats chose a level of 2.4 N of 4."""
    search: Any = SimpleNamespace(
        refitted_symbols=("F", "m"), problem=SimpleNamespace(levels=("F",)), declared=np.array([4.0, 2.0])
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
    monkeypatch.setattr(parsimony, "fit_candidates", lambda *_: [wave])
    monkeypatch.setattr(parsimony, "possible_replacements", lambda search, parts, k, paired: [wave.part])
    monkeypatch.setattr(refusals, "admissible", lambda search, found: True)
    monkeypatch.setattr(parsimony, "matters", lambda *_: True)
    refusing = "corrects_a_form", "contradicted_by_force", "only_attenuates_noise"
    for test in refusing:
        monkeypatch.setattr(parsimony, test, lambda *_: "")
    monkeypatch.setattr(refusals, "acts_as_its_limit", lambda search, found: "")
    monkeypatch.setattr(refusals, "uncovered", lambda search, part, values: "longer than the stroke")
    monkeypatch.setattr(refusals, "_unvarying", lambda search, part, values: "")
    monkeypatch.setattr(refusals, "takes_the_level", lambda problem, system, model: "")
    shared = {"problem": None, "system": None}
    search: Any = SimpleNamespace(
        rigid=None, without=lambda current, k: current, fitted_again=lambda fit: fit, **shared
    )
    monkeypatch.setattr(parsimony, "as_replacement", lambda search, found, without: found)
    monkeypatch.setattr(parsimony, "most_left", lambda _: 1.0)
    current = fit(part_named("spring"), part_named("viscous_asymmetry"))
    current.cost = 100.0
    assert parsimony.swapped(search, current, []) == (None, {})
    monkeypatch.setattr(refusals, "uncovered", lambda search, part, values: "")
    monkeypatch.setattr(parsimony, "force_speaks_for", lambda here, found: False)
    assert parsimony.swapped(search, current, [])[0] is wave
    monkeypatch.setattr(parsimony, "force_speaks_for", lambda here, found: True)
    monkeypatch.setattr(parsimony, "tied_by_free_runs", lambda *_: False)
    assert parsimony.swapped(search, current, []) == (None, {})
    monkeypatch.setattr(parsimony, "force_speaks_for", lambda here, found: False)
    monkeypatch.setattr(parsimony, "matters", lambda *_: False)  # a lag of 1e-15 s ties with anything
    assert parsimony.swapped(search, current, []) == (None, {})
    monkeypatch.setattr(parsimony, "matters", lambda *_: True)
    for test in refusing:
        monkeypatch.setattr(parsimony, test, lambda *_: "leaves more than there was")
        assert parsimony.swapped(search, current, []) == (None, {})
        monkeypatch.setattr(parsimony, test, lambda *_: "")


@pytest.mark.parametrize(("sizes", "moved"), [((0.1, 0.3), 1), ((0.3, 0.1), None)])
def test_the_effect_of_the_largest_force_is_named_first(
    sizes: tuple[float, float], moved: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = system_of(stage())
    parts = [part_of(effect, place, system) for effect, place in candidates(system) if effect.kind in LATE]
    share_of = dict(zip(LATE, sizes, strict=True))
    monkeypatch.setattr(parsimony, "force_share", lambda search, part, values: share_of[part.kind])
    monkeypatch.setattr(parsimony, "put_first", lambda search, fit, k: k)
    trial = SimpleNamespace(parts=parts, changed=system, system=system, split=lambda theta: (None, [{}, {}]))
    both: Any = SimpleNamespace(trial=trial, values=(None, [{}, {}]))
    found: Any = parsimony.largest_first(None, both)  # type: ignore[arg-type]
    assert found == moved if moved is not None else found is both


def test_without_an_effect_nothing_is_put_first() -> None:
    """Where dropping one of two effects leaves the other no longer accepted: an error that ended the diagnosis."""
    none: Any = fit()
    assert parsimony.largest_first(none, none) is none


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

    def replaced(fit: Any, others: Any) -> Any:
        assert fit is current and others == {1: (spring, own)}
        values = [4.0], [{"f0": 1.0}, own]
        return SimpleNamespace(trial=SimpleNamespace(parts=(offset, spring)), values=values, cost=cost)

    search: Any = SimpleNamespace(system=system, rigid=None, replaced=replaced)
    rivals: Any = [InRound(found=SimpleNamespace(part=p)) for p in (spring, offset)]
    found, left = parsimony.with_simplest_effects(search, current, rivals)
    assert found.trial.parts == ((offset, spring) if kinds == "c" else (offset, play))
    assert left == (rivals[1:] if kinds == "c" else rivals)


def test_a_replacement_without_its_gap_is_a_spring_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A play with a gap of 3e-17 rad took the place of a cogging, and was named beside a friction drift."""
    kinds = ("cogging", "backlash", "compliance")
    first, play, spring = (fit(part_named("drift"), part_named(kind)) for kind in kinds)
    monkeypatch.setattr(parsimony, "reconsidered", lambda *_: (play, []))
    monkeypatch.setattr(parsimony, "pruned_with_rivals", lambda search, found, rivals: (found, rivals))
    seen = lambda search, found, rivals: (spring if found is play else found, rivals)  # noqa: E731
    monkeypatch.setattr(parsimony, "with_simplest_effects", seen)
    monkeypatch.setattr(parsimony, "still_accepted", lambda search, base, found, rivals: (found, rivals))
    monkeypatch.setattr(parsimony, "largest_first", lambda search, found: found)
    none: Any = None
    assert parsimony.judged_together(none, fit(), first, [], False)[0] is spring


@pytest.mark.parametrize("shown", [True, False])
def test_a_backlash_replaces_a_compliance_only_where_its_gap_is_shown(
    shown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both fit the log; the backlash by 100 nats better."""
    play = fit(part_named("backlash"))
    play.cost = 0.0
    for name, value in {
        "fit_candidates": [play], "is_possible": True, "matters": True,
        "corrects_a_form": "", "contradicted_by_force": "", "only_attenuates_noise": "", "force_speaks_for": False,
        "tied_by_free_runs": False, "extension_is_shown": shown, "as_replacement": play,
    }.items():  # fmt: skip
        monkeypatch.setattr(parsimony, name, lambda *_, value=value: value)
    search: Any = SimpleNamespace(rigid=None, without=lambda current, k: current, fitted_again=lambda fit: fit)
    current = fit(part_named("compliance"), part_named("cogging"))
    current.cost = 100.0
    monkeypatch.setattr(parsimony, "possible_replacements", lambda search, parts, k, _: [] if k else [play.part])
    assert parsimony.swapped(search, current, []) == ((play if shown else None), {})
