"""The probability that is stated beside a verdict."""

from __future__ import annotations

import pytest
from scipy.stats import beta

from codegen.diagnosis import reliability
from codegen.diagnosis.reliability import Reliability, class_of, measured, reliability_of


def test_the_probability_is_the_posterior_mean_under_jeffreys_prior() -> None:
    found = Reliability(right=83, of=85)
    posterior = beta(83.5, 2.5)
    assert found.probability == pytest.approx(posterior.mean())
    assert found.interval == pytest.approx((posterior.ppf(0.025), posterior.ppf(0.975)))


def test_few_logs_leave_a_wide_interval() -> None:
    low, high = Reliability(right=2, of=2).interval
    assert low < 0.4 and high > 0.99


@pytest.mark.parametrize("verdict", ["unknown", "unfit"])
def test_a_verdict_that_claims_nothing_has_no_probability(verdict: str) -> None:
    assert class_of(verdict, near=True) is None
    assert reliability_of(verdict, near=True) is None


def test_a_class_of_few_logs_has_no_probability(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = {"none, above the noise": (1, 4), "effect, at the noise": (9, 10)}
    monkeypatch.setattr(reliability, "measured", lambda: counts)
    assert reliability_of("none", near=False) is None
    assert reliability_of("effect", near=True) == Reliability(9, 10, "effect, at the noise")


def test_a_class_is_printed_by_what_it_means() -> None:
    assert "(effect, simulation error near the noise) were" in Reliability(9, 10, "effect, at the noise").words
    assert "(none, simulation error above the noise) were" in Reliability(9, 10, "none, above the noise").words


def test_the_probability_is_said_to_be_an_estimate() -> None:
    """22 of 24 are 91.7 %, the estimate from them is 90 %: the two stood beside each other as if they were one."""
    told = Reliability(22, 24, "effect, at the noise").words
    assert told.endswith("known truth: probability about 90 %, estimated from these (95 %: 76 to 98 %).")


def test_the_shipped_counts_are_of_the_classes_that_a_diagnosis_asks_for() -> None:
    asked = {class_of(verdict, near) for verdict in ("effect", "none", "ambiguous") for near in (True, False)}
    assert set(measured()) <= asked
    assert all(0 <= right <= of and of > 0 for right, of in measured().values())
    shipped = measured()["effect, at the noise"]
    assert reliability_of("effect", near=True) == Reliability(*shipped, "effect, at the noise")
