"""The score test in free runs: its rate of false alarms and its power on linear models with a known truth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import binom

from codegen.diagnosis.evidence.force_gain import (
    added_parameters,
    along_best,
    contains,
    extends,
    nested_evidence_of,
    score_test,
)
from codegen.diagnosis.fit.acceptance import Evidence, evidence_of
from codegen.diagnosis.fit.output_error import Fit, Prior, Starts, segment_weights
from codegen.effects import CATALOGUE
from tests.diagnosis.fakes import Placed
from tests.slow_cases import drawn

Array = NDArray[np.float64]

SEGMENTS, KEPT, OWN = 48, 12, 3
LEVEL = 0.01 / 23 / 5
"""p at which one of 23 candidates is accepted by the smallest of five tests."""


def fit_of(measured: Array, slopes: Array) -> Fit:
    """The fit of a linear model with these slopes (p, S, K) to a measurement (S, K), by reweighted least squares."""
    count = len(slopes)
    theta, step = np.zeros(count), np.ones(count)
    while np.abs(step).max() > 1e-3:
        residual = measured - np.tensordot(theta, slopes, axes=1)
        weighted = (slopes * segment_weights(residual)[:, None]).reshape(count, -1)
        step = np.linalg.solve(weighted @ slopes.reshape(count, -1).T, weighted @ residual.ravel())
        theta = theta + step
    return at(measured, slopes, theta)


def at(measured: Array, slopes: Array, theta: Array) -> Fit:
    """The linear model with these values."""
    residual, none = measured - np.tensordot(theta, slopes, axes=1), np.zeros(len(theta))
    starts = Starts(np.zeros((SEGMENTS, KEPT, 2)), np.zeros((SEGMENTS, 2, KEPT)), np.ones((SEGMENTS, 2)))
    prior = Prior(np.diag(none), none + np.inf, none, none + 1, none + np.inf, none - np.inf)
    runner: Any = SimpleNamespace(trial=SimpleNamespace(parts=()))
    return Fit(runner, theta, np.zeros((SEGMENTS, 2)), residual, residual, slopes, starts, prior, none > 0)


def slopes_of(count: int, draw: np.random.Generator) -> Array:
    """(count, S, K) slopes: every other one of a motion that is slow over the segments, else of any in each."""
    t, s = np.linspace(-1, 1, KEPT), np.arange(SEGMENTS)
    sizes = draw.normal(size=(count, SEGMENTS))
    for k in range(0, count, 2):
        sizes[k] = np.sin(2 * np.pi * draw.uniform(0.5, 5) * s / SEGMENTS + draw.uniform(0, 6))
    return np.asarray(
        sizes[:, :, None] * (t**2 - 1 / 3) + 0.5 * draw.normal(size=(count, SEGMENTS, 1)) * (t**3 - 0.6 * t)
    )


def noise_of(kind: str, draw: np.random.Generator) -> Array:
    """(S, K) noise: white; or correlated, of a size that differs between segments, five times the assumed one; or white
    and in each segment the response to a slow force of as much power, with a correlation time of a twelfth of the log.
    """
    noise = draw.normal(size=(SEGMENTS, KEPT))
    if kind == "far":
        return np.asarray(5 * np.exp(0.8 * draw.normal(size=(SEGMENTS, 1))) * lfilter([0.7], [1, -0.7], noise, axis=1))
    if kind == "slow":
        pole, shape = np.exp(-12 / SEGMENTS), np.linspace(-1, 1, KEPT) ** 2 - 1 / 3
        force = lfilter([np.sqrt(1 - pole**2)], [1, -pole], draw.normal(size=SEGMENTS + 100))[100:]
        noise += force[:, None] * shape / np.sqrt(np.mean(shape**2))
    return noise


@pytest.mark.parametrize("acting", [1.0, 0.15])
@pytest.mark.parametrize(("kind", "added"), [("white", 1), ("white", 4), ("far", 1)])
@drawn(100, 300)
def test_an_effect_that_is_not_there_is_accepted_as_rarely_as_stated(
    kind: str, added: int, acting: float, draws: int
) -> None:
    """Also one that acts in a share of the segments, elsewhere fifty times less: a few blocks are fitted by chance."""
    draw, p = np.random.default_rng(1), []
    for _ in range(draws):
        slopes, measured = slopes_of(OWN + added, draw), noise_of(kind, draw)
        slopes[OWN:] *= np.where(draw.uniform(size=(SEGMENTS, 1)) <= acting, 1.0, 0.02)
        p.append(score_test(fit_of(measured, slopes[:OWN]), fit_of(measured, slopes)))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


@pytest.mark.parametrize("added", [1, 3])
@drawn(100, 300)
def test_beside_a_slow_force_an_effect_that_is_not_there_is_accepted_little_more_often(added: int, draws: int) -> None:
    """Blocks of a slow force are alike; with each counted as independent it was up to 20 % at p ≤ 1 %."""
    draw, p = np.random.default_rng(2), []
    for _ in range(draws):
        slopes, measured = slopes_of(OWN + added, draw), noise_of("slow", draw)
        p.append(score_test(fit_of(measured, slopes[:OWN]), fit_of(measured, slopes)))
    assert np.mean(np.array(p) <= 0.01) <= 0.03


@pytest.mark.parametrize(
    ("kind", "errors", "least", "most"), [("white", 7, 0.7, 0.4), ("far", 9, 0.35, 0.05)], ids=["near", "far"]
)
def test_an_effect_of_so_many_standard_errors_is_found(kind: str, errors: float, least: float, most: float) -> None:
    """Among 23 candidates; by the gains in loss it is not, or in fewer logs by far."""
    draw, by_score, by_gains = np.random.default_rng(3), [], []
    for _ in range(80):
        slopes, noise = slopes_of(OWN + 1, draw), noise_of(kind, draw)
        flat = slopes[:OWN].reshape(OWN, -1)
        beside = slopes[OWN] - (np.linalg.lstsq(flat.T, slopes[OWN].ravel(), rcond=None)[0] @ flat).reshape(noise.shape)
        along = segment_weights(noise) * (beside * noise).sum(axis=1)
        one = np.sqrt(along @ along) / float(segment_weights(noise) @ (beside**2).sum(axis=1))
        measured = noise + errors * one * slopes[OWN]
        before, after = fit_of(measured, slopes[:OWN]), fit_of(measured, slopes)
        by_score.append(score_test(before, after) <= LEVEL)
        by_gains.append(evidence_of(before, after).p(1.0 if kind == "white" else 0.0) <= LEVEL * 5)
    assert np.mean(by_score) > least > most > np.mean(by_gains)


@pytest.mark.parametrize("with_effect", [False, True])
def test_a_run_that_leaves_the_motion_decides_nothing(with_effect: bool) -> None:
    """One of 48, far from the noise: of the model without an effect of 15 standard errors, or of that with it."""
    draw = np.random.default_rng(8)
    slopes, noise = slopes_of(OWN + 1, draw), noise_of("far", draw)
    measured = noise + 5 * slopes[OWN]
    before, after = fit_of(measured, slopes[:OWN]), fit_of(measured, slopes)
    assert score_test(before, after) < LEVEL
    lost = np.where(np.arange(SEGMENTS)[:, None] == 20, 1e5 * draw.normal(size=KEPT), 0.0)
    if with_effect:
        after = replace(after, residual=after.residual + lost)
    else:
        before = replace(before, residual=before.residual + lost)
    assert score_test(before, after) < LEVEL


def test_what_a_fit_lacks_to_its_optimum_is_no_evidence_for_an_effect() -> None:
    """The refit stops four standard errors before its optimum; the one with a worthless effect does not."""
    draw, p = np.random.default_rng(4), []
    for _ in range(200):
        slopes, measured = slopes_of(OWN + 1, draw), noise_of("white", draw)
        best = fit_of(measured, slopes[:OWN])
        error = 1 / np.sqrt(0.5 * np.sum(slopes[0] ** 2))
        before = at(measured, slopes[:OWN], best.theta + 4 * error * np.eye(OWN)[0])
        p.append(score_test(before, fit_of(measured, slopes)))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, 200, alpha) / 200


def test_a_value_that_its_tolerance_holds_back_leaves_evidence_for_an_effect() -> None:
    """An effect that acts as a declared value does: more than its tolerance allows is the effect."""
    draw = np.random.default_rng(5)
    slopes = slopes_of(1, draw)
    measured = noise_of("white", draw) + 3.0 * slopes[0]
    held = replace(at(measured, slopes, np.zeros(1)), limited=np.ones(1, dtype=bool))
    after = fit_of(measured, slopes)
    richer = replace(after, theta=np.append(0.0, after.theta))
    assert score_test(held, richer) < 1e-6
    assert score_test(replace(held, limited=np.zeros(1, dtype=bool)), richer) > 0.01


def test_with_as_many_parameters_as_blocks_it_shows_nothing() -> None:
    assert along_best(1e3, 13, 13) == 1.0 and along_best(-5.0, 48, 1) == 1.0
    assert along_best(2.0117, 48, 1) == pytest.approx(0.05, rel=1e-3)  # Student's t of 47, both sides


def test_it_is_one_of_five_tests_of_nested_models_and_of_no_others() -> None:
    draw = np.random.default_rng(6)
    slopes = slopes_of(OWN + 1, draw)
    measured = noise_of("far", draw) + 3 * slopes[OWN]
    before, after = fit_of(measured, slopes[:OWN]), fit_of(measured, slopes)
    one, both = evidence_of(before, after), nested_evidence_of(before, after)
    assert one.by_score is None and both.by_score == score_test(before, after)
    assert Evidence(0.0, 0.0, 3.0, 8, 8).p(0.0) == pytest.approx(4 * 0.0013498980)
    assert Evidence(0.0, 0.0, 3.0, 8, 8, by_score=1.0).p(0.0) == pytest.approx(5 * 0.0013498980)
    assert Evidence(0.0, 0.0, 3.0, 8, 8, by_score=1e-6).p(0.0) == pytest.approx(5e-6)


def test_a_trial_contains_another_with_fewer_parts_or_a_simpler_form() -> None:
    def trial(*parts: tuple[str, tuple[str, ...]]) -> Any:
        return SimpleNamespace(parts=[Placed(kind=kind, on="rail", names=names) for kind, names in parts])

    spring, hard, drag = ("spring", ("k",)), ("spring", ("k", "k3")), ("quadratic_drag", ("c",))
    assert [added_parameters(*two) for two in ((trial(), trial(hard)), (trial(spring), trial(hard)))] == [2, 1]
    assert added_parameters(trial(spring, hard), trial(drag)) == 1  # not the difference of counts, which is negative
    assert (
        contains(trial(spring, drag), trial(spring))
        and contains(trial(hard), trial(spring))
        and contains(trial(), trial())
    )
    assert not contains(trial(drag), trial(spring)) and not contains(trial(spring, drag), trial(hard))


def test_a_play_extends_the_spring_in_its_place_and_nothing_else() -> None:
    def trial(*kinds: str, on: str = "x") -> Any:
        return SimpleNamespace(parts=[Placed(kind=kind, on=on, effect=CATALOGUE[kind]) for kind in kinds])

    play = trial("offset", "backlash")
    assert extends(play, trial("offset", "compliance")) and extends(play, trial("compliance", "offset"))
    others = trial("compliance"), trial("viscous", "compliance"), trial("offset", "backlash"), trial("offset", "spring")
    assert not any(extends(play, one) for one in others) and not extends(trial("offset", "compliance"), play)
    assert not extends(trial("backlash"), trial("compliance", on="y"))
