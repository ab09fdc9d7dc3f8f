"""Two models that differ for a moment of the log only are told apart there, and two that are as wrong are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt, lfilter

from codegen.diagnosis.evidence.force_gain import by_shifts
from tests.slow_cases import drawn

Array = NDArray[np.float64]
SAMPLES, SLOW = 4800, 0.9975
LOW_PASS = butter(4, 0.1)


def noise(draw: np.random.Generator, slow: float, jerks: float) -> Array:
    """Low-passed noise, with a slow part, and stronger in some of 48 blocks than in others."""
    white = filtfilt(*LOW_PASS, draw.normal(size=SAMPLES))
    drift = lfilter([1.0], [1.0, -SLOW], draw.normal(size=SAMPLES + 4000))[4000:]
    blocks = np.repeat(np.exp(jerks * draw.normal(size=48)), SAMPLES // 48)
    return np.asarray((white / white.std() + slow * drift / drift.std()) * blocks)


def events(draw: np.random.Generator, count: int, size: float, width: int = 60) -> Array:
    """Bumps of a sign each, in units of the noise."""
    found = np.zeros(SAMPLES)
    for _ in range(count):
        first = draw.integers(0, SAMPLES - width)
        found[first : first + width] += size * draw.choice([-1, 1]) * np.hanning(width)
    return found


def share_told(
    draws: int, seed: int, of: Callable[[np.random.Generator], tuple[Array, Array]], slow: float, jerks: float
) -> float:
    """Share of logs in which the first of two errors, each on top of the same noise, is preferred with p ≤ 5 %."""
    draw, told = np.random.default_rng(seed), 0
    for _ in range(draws):
        common = noise(draw, slow, jerks)
        this, other = (common + error for error in of(draw))
        told += by_shifts([(other, this)]) <= 0.05
    return told / draws


KINDS = pytest.mark.parametrize(("slow", "jerks"), [(0.0, 0.0), (0.5, 0.0), (0.0, 1.0)], ids=["white", "slow", "jerks"])


@KINDS
@pytest.mark.parametrize("count", [1, 5, 40])
@drawn(80, 200)
def test_two_models_as_wrong_as_each_other_are_told_apart_as_rarely_as_stated(
    count: int, slow: float, jerks: float, draws: int
) -> None:
    """The truth is half-way between them: at 5 % each, with two standard deviations of so many logs."""

    def half_way(draw: np.random.Generator) -> tuple[Array, Array]:
        apart = events(draw, count, 3.0)
        return apart / 2, -apart / 2

    assert share_told(draws, 11, half_way, slow, jerks) <= 0.05 + 2 * np.sqrt(0.05 * 0.95 / draws)


@KINDS
@drawn(80, 200)
def test_two_models_wrong_at_times_of_their_own_are_not_told_apart(slow: float, jerks: float, draws: int) -> None:
    """In about a tenth of the log each, by three times the noise."""
    assert (
        share_told(draws, 12, lambda draw: (events(draw, 5, 3.0, 100), events(draw, 5, 3.0, 100)), slow, jerks) <= 0.02
    )


@pytest.mark.parametrize(("count", "size", "least"), [(4, 6.0, 0.5), (6, 15.0, 0.5), (6, 0.0, -1.0)])
@drawn(80, 200)
def test_a_model_that_is_wrong_for_a_few_moments_is_told_from_the_right_one(
    count: int, size: float, least: float, draws: int
) -> None:
    """Events of an eightieth of the log; never is the wrong model preferred."""

    def few(draw: np.random.Generator) -> tuple[Array, Array]:
        return np.zeros(SAMPLES), events(draw, count, size)

    assert share_told(draws, 13, few, 0.0, 0.0) >= least
    assert share_told(draws, 13, lambda draw: few(draw)[::-1], 0.0, 0.0) == 0.0


@drawn(80, 200)
def test_one_moment_tells_nothing(draws: int) -> None:
    """Two models each wrong at random in about one moment: a log then often holds a moment of one of them only."""

    def at_random(draw: np.random.Generator) -> tuple[Array, Array]:
        return events(draw, draw.poisson(1.0), 6.0), events(draw, draw.poisson(1.0), 6.0)

    assert share_told(draws, 15, at_random, 0.0, 0.0) <= 0.05


@pytest.mark.parametrize("share", [0.1, 0.3])
@drawn(80, 200)
def test_a_coordinate_that_is_used_at_few_samples_tells_no_more(share: float, draws: int) -> None:
    """The truth is half-way on it, and the other coordinate says nothing."""
    draw, told = np.random.default_rng(16), 0
    used = np.arange(SAMPLES) % 480 < 480 * share
    for _ in range(draws):
        apart = np.zeros(SAMPLES)
        for at in draw.choice(np.flatnonzero(used), 5):
            apart[at : at + 40] += 1.5 * draw.choice([-1, 1]) * np.hanning(40)[: SAMPLES - at]
        whole, part = noise(draw, 0.0, 0.0), noise(draw, 0.0, 0.0)
        told += by_shifts([(whole, whole), (used * (part + apart / 2), used * (part - apart / 2))]) <= 0.05
    assert told / draws <= 0.05 + 2 * np.sqrt(0.05 * 0.95 / draws)


def test_models_that_are_one_motion_are_not_told_apart() -> None:
    same = noise(np.random.default_rng(14), 0.0, 0.0)
    assert by_shifts([(same, same)]) == 1.0
