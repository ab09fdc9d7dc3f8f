"""Significance of a gain on held-out segments: its rate of false alarms, and an effect that acts in few segments."""

from __future__ import annotations

import json
from dataclasses import asdict
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, norm, ttest_1samp

from codegen.diagnosis.fit.acceptance import evidence, p_of_sign_flips
from codegen.diagnosis.selection import significance
from tests.slow_cases import drawn

KEPT, SEGMENTS = 40, 48
FLOOR = 0.5 * KEPT * np.log(2.0)
"""Loss of a segment whose squared residual is that of the noise, one a value."""


def losses(squares: NDArray[np.float64]) -> NDArray[np.float64]:
    """The losses of segments with these squared residuals, as ``segment_losses`` has them."""
    return np.asarray(0.5 * KEPT * np.log1p(squares / KEPT))


def test_an_effect_that_acts_in_seven_segments_and_leaves_noise_there_is_significant() -> None:
    """The signs of seven gains alone are chance with a probability of 1/128."""
    generator = np.random.default_rng(1)
    before = KEPT * (1 + 0.2 * generator.normal(size=SEGMENTS))
    after = before * np.exp(0.05 * generator.normal(size=SEGMENTS))
    before[5:40:5] = KEPT * generator.uniform(300, 900, 7)
    found = evidence(losses(before), losses(after), KEPT, FLOOR)
    assert found.t < 3 and found.p(0.0) < 1e-4
    assert found.where_far < 1e-5


def test_an_effect_of_a_few_accelerations_is_significant_far_above_the_noise() -> None:
    """A machine that is nowhere at the noise of its encoder: twelve segments lose a factor of 30, others none."""
    generator = np.random.default_rng(5)
    left = KEPT * 2000 * np.exp(0.8 * generator.normal(size=SEGMENTS))
    before = left * np.exp(0.1 * generator.normal(size=SEGMENTS))
    before[::4] = left[::4] * generator.uniform(15, 60, 12)
    found = evidence(losses(before), losses(left), KEPT, FLOOR)
    assert found.where_far > 1e-4 and found.p(0.0) < 1e-5


@pytest.mark.parametrize("count", [1, 3, 5, 8])
def test_equal_gains_in_all_blocks_are_chance_as_often_as_so_many_coins_agree(count: int) -> None:
    """The normal approximation says 1.3 % of five blocks, of which one in 32 is right."""
    assert p_of_sign_flips(np.full(count, 0.7)) == pytest.approx(0.5**count)


def test_random_signs_are_counted() -> None:
    """Compared with all 2¹² signs of gains of very different size; sums as large as the observed one count."""
    draw = np.random.default_rng(11)
    signs = np.array(list(product((-1, 1), repeat=12)))
    for _ in range(20):
        gains = draw.normal(size=12) * np.exp(1.5 * draw.normal(size=12))
        p, normal = np.mean(signs @ np.abs(gains) >= gains.sum() - 1e-9), norm.sf(gains.sum() / np.linalg.norm(gains))
        assert p_of_sign_flips(gains) == pytest.approx(max(p, normal), rel=0.02)
    assert p_of_sign_flips(np.zeros(4)) == p_of_sign_flips(np.array([])) == 1.0
    assert p_of_sign_flips(np.array([3.0, -3.0])) == pytest.approx(0.75)
    assert p_of_sign_flips(np.full(48, 2.0)) == pytest.approx(norm.sf(np.sqrt(48)))


def test_a_worse_model_is_never_significant() -> None:
    generator = np.random.default_rng(6)
    before = KEPT * 500 * np.exp(generator.normal(size=SEGMENTS))
    worse = before * np.exp(0.3 + 0.2 * generator.normal(size=SEGMENTS))
    assert evidence(losses(before), losses(worse), KEPT, FLOOR).p(0.0) == 1.0


@drawn(500, 2000)
def test_as_good_a_model_is_accepted_as_rarely_as_stated(draws: int) -> None:
    """Two models whose residuals are drawn alike, far above the noise in a few segments each: p is below 5 % in no more
    of the draws than chance allows.
    """
    generator, level = np.random.default_rng(2), 0.05
    rare = 0
    for _ in range(draws):
        common = KEPT * np.exp(3.5 * generator.normal(size=SEGMENTS))
        one, other = (common * np.exp(1.5 * generator.normal(size=SEGMENTS)) for _ in range(2))
        rare += evidence(losses(one), losses(other), KEPT, FLOOR).p(0.0) < level
    assert rare <= binom.ppf(0.999, draws, level)


@pytest.mark.parametrize("count", [0, 4])
def test_few_segments_far_from_the_noise_say_nothing_by_themselves(count: int) -> None:
    before = np.full(SEGMENTS, float(KEPT))
    before[:count] *= 1e4
    assert evidence(losses(before), losses(np.full(SEGMENTS, float(KEPT))), KEPT, FLOOR).where_far == 1.0


@drawn(500, 2000)
def test_a_disturbance_that_no_model_explains_is_no_likelihood_for_one_that_leaves_less_of_it(draws: int) -> None:
    """White noise, and in one to five of 48 segments a push: what two models leave of it differs by chance.

    One segment of 112 was 41 nats for a compliance of 0.01 % of the drive force, with p = 2e-16 over 22 candidates.
    """
    generator, level = np.random.default_rng(4), 0.01
    rare = 0
    for _ in range(draws):
        one, other = np.tile((generator.normal(size=(SEGMENTS, KEPT)) ** 2).sum(axis=1), (2, 1))
        pushed = generator.permutation(SEGMENTS)[: generator.integers(1, 6)]
        one[pushed], other[pushed] = KEPT * 15 * np.exp(0.7 * generator.normal(size=(2, len(pushed))))
        rare += evidence(losses(one), losses(other), KEPT, FLOOR).p(1.0) <= level
    assert rare <= binom.ppf(0.999, draws, level)


def test_an_effect_in_two_segments_that_leaves_noise_there_is_likely() -> None:
    """Two segments are too few for any test on blocks; 48 segments of white noise beside them say nothing."""
    generator = np.random.default_rng(7)
    after = (generator.normal(size=(SEGMENTS, KEPT)) ** 2).sum(axis=1)
    before = after * np.where(np.isin(np.arange(SEGMENTS), [9, 30]), 8.0, 1.0)
    found = evidence(losses(before), losses(after), KEPT, FLOOR)
    assert found.p(1.0) < 1e-9 and found.p(0.0) > 0.1


@drawn(500, 2000)
def test_a_likelihood_accepts_none_of_two_models_that_are_wrong_alike(
    monkeypatch: pytest.MonkeyPatch, draws: int
) -> None:
    """13 segments at 2.6 times the noise: each has one error of its own, which counts once and not for each sample.

    A log of a swing-up accepted a Stribeck effect in place of a friction that falls with time, by three segments.
    """
    generator, level, few = np.random.default_rng(4), 0.05, 13
    monkeypatch.setattr(significance, "independent_share", lambda fit: 0.2)
    record: Any = SimpleNamespace(noise=np.ones(1), joints=None)
    search: Any = SimpleNamespace(record=record)
    rare = likely = 0
    for _ in range(draws):
        one, other = (KEPT * (1 + 6 * np.exp(0.5 * generator.normal(size=few))) for _ in range(2))
        runner = SimpleNamespace(record=record)
        fit: Any = SimpleNamespace(by_segment=other, residual=np.zeros((few, KEPT)), runner=runner)
        found = evidence(losses(one), losses(other), KEPT, FLOOR)
        rare += found.p(significance.whiteness(search, fit)) < level
        likely += found.p(0.2) < level
    assert rare <= binom.ppf(0.999, draws, level) < likely


def test_above_the_noise_a_likelihood_counts_only_as_far_as_the_blocks_agree() -> None:
    """13 segments at 1.5 times the noise: the same gain in one of them, or shared by all."""
    generator = np.random.default_rng(8)
    after = losses(KEPT * 2.2 * np.exp(0.05 * generator.normal(size=13)))
    spread = np.abs(generator.normal(size=13)) + 1
    shared, single = 60 * spread / spread.sum(), np.where(np.arange(13) == 5, 60.0, 0.0)
    for gains, blocks in ((shared, True), (single, False)):
        found = evidence(after + gains, after, KEPT, FLOOR)
        assert found.gain == pytest.approx(60) and found.p(0.3) < 1e-6
        assert found.by_blocks == pytest.approx(ttest_1samp(gains, 0.0, alternative="greater").pvalue)
        assert (found.p(0.3, only_noise=False) < 1e-4) is blocks


@pytest.mark.parametrize(("segments", "nats", "least"), [(13, 9, 0.85), (48, 9, 0.85), (48, 14, 0.95)])
@drawn(150, 400)
def test_at_the_noise_a_gain_shared_by_many_segments_tells_two_rivals_apart(
    segments: int, nats: float, least: float, draws: int
) -> None:
    """One model leaves white noise, its rival that and so much more; the t test on blocks alone is slower.

    A lag of 1.35 ms was better than a delay by 9 nats, and the two were called a tie (p = 0.14).
    """
    generator, level = np.random.default_rng(1), 0.05
    told = by_blocks = wrongly = 0
    for _ in range(draws):
        noise, more = generator.normal(size=(2, segments, KEPT))
        more *= np.sqrt(4 * nats / (more**2).sum())
        true, rival = (losses((r**2).sum(axis=1)) for r in (noise, noise + more))
        one, other = evidence(rival, true, KEPT), evidence(true, rival, KEPT)
        told += one.p_of_rivals(1.0, at_noise=True) <= level
        by_blocks += one.p_of_rivals(1.0, at_noise=False) <= level
        wrongly += other.p_of_rivals(1.0, at_noise=True) <= level
    assert told > least * draws > by_blocks and wrongly == 0


@pytest.mark.parametrize("segments", [13, 48])
@drawn(300, 1000)
def test_errors_of_its_own_in_few_segments_tell_no_model_from_another(segments: int, draws: int) -> None:
    """Two models alike, each at twice the noise in a tenth of the segments: the likelihood ratio alone tells half."""
    generator, level = np.random.default_rng(2), 0.05
    told = likely = 0
    for _ in range(draws):
        noise, more = generator.normal(size=(2, segments, KEPT))
        wrong = generator.random((2, segments)) < 0.1
        one, other = (losses((np.where(w[:, None], 2 * more, noise) ** 2).sum(axis=1)) for w in wrong)
        found = evidence(one, other, KEPT)
        told += found.p_of_rivals(1.0, at_noise=True) <= level
        likely += found.p(1.0) <= level
    assert told <= binom.ppf(0.999, draws, level) < 0.3 * draws < likely


def test_the_numbers_of_an_evidence_can_be_written_as_json() -> None:
    """A count of numpy's made every diagnosis end in an internal error."""
    base = np.linspace(20.0, 40.0, 48)
    counted = evidence(base, 0.5 * base, 40, 1.0)
    assert json.loads(json.dumps(asdict(counted)))["won"] == counted.won == counted.blocks
