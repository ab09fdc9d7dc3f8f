"""Refutations: what is claimed to be impossible is so by NumPy, and the bracket with the proof is narrow."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from codegen.certify.certify import Certificate, Refusal
from codegen.checker import verify
from tests.slow_cases import slow_except

from .certified import outcome, step_matrix

ONE = "{{kind: {kind}, velocity: estimated, gains: {gains}, sample_time: {h}, integration: {step}}}"
GAINS = {
    "cfo": "{{K_F: [[{0}]], K_v: [[{1}]]}}",
    "to": "{{K_1: [[{0}]], K_2: 0, K_v: [[{1}]]}}",
}


def spectral(content: Any) -> float:
    """The rate of the slowest eigenvalue at a refutation's point, by NumPy from the file alone; explicit steps."""
    at = {name: float(Fraction(ends[0])) for name, ends in content["variables"].items()}
    radius = np.abs(np.linalg.eigvals(step_matrix(content, at))).max()
    return (1 - radius**2) / 2 / float(Fraction(content["sample_time"]))


@pytest.mark.parametrize(
    "step", slow_except(["euler", "semi_implicit", "exponential", "implicit"], ["euler", "implicit"])
)
def test_proof_and_refutation_are_within_one_percent(step: str) -> None:
    generator = np.random.default_rng(3)
    for _ in range(6):
        k_f, k_v = generator.uniform(1, 400, 2)
        gains = f"{{K_F: {k_f:.3f}, K_v: {k_v:.3f}}}"
        found = outcome("one_mass", ONE.format(kind="cfo", gains=gains, h=0.001, step=step))
        assert isinstance(found, Certificate)
        assert found.limit is not None and found.refuted_rate is not None
        verify.check(json.dumps(found.limit))
        assert found.decay_rate <= found.spectral_rate <= found.refuted_rate
        if step == "implicit":  # the proof's condition is sufficient only; the refutation is of what V really does
            assert found.refuted_rate == pytest.approx(implicit_rate(found.limit), rel=2e-3)
        else:
            tracker = GAINS["to"].format(-k_f * k_v, k_v)
            other = outcome("one_mass", ONE.format(kind="to", gains=tracker, h=0.001, step=step))
            assert isinstance(other, Certificate) and other.refuted_rate is not None
            assert other.refuted_rate <= 1.01 * other.decay_rate  # nothing turns: V has the best rate
            assert found.refuted_rate <= 1.002 * found.spectral_rate <= 1.002 / 0.948 * found.decay_rate
            assert spectral(found.limit) == pytest.approx(found.spectral_rate, rel=1e-6)


def test_no_rate_that_an_implicit_step_reaches_is_refuted() -> None:
    """A fast, ringing loop: the real parts of A's eigenvalues say 0.99 for V a sample, those of the step 0.625."""
    gains = GAINS["to"].format(0, 1).replace("K_2: 0", "K_2: -10000")
    found = outcome("one_mass", ONE.format(kind="to", gains=gains, h=0.01, step="implicit"))
    assert isinstance(found, Certificate) and found.limit is not None and found.refuted_rate is not None
    falls = 1 / (1 + found.refuted_rate * 0.01) ** 2
    radius = np.abs(1 / (1 - 0.01 * np.linalg.eigvals(a_of(found.limit)))).max()
    assert falls == pytest.approx(radius**2, rel=0.01) and falls < 0.7
    falsified = dict(found.limit, decay_rate=str(Fraction("0.5")))  # what an earlier version of the checker accepted
    with pytest.raises(verify.Refused):
        verify.check(json.dumps(falsified))


def a_of(content: Any) -> Any:
    """A of a refutation at its point, from the file alone."""
    at = {name: float(Fraction(ends[0])) for name, ends in content["variables"].items()}
    h = float(Fraction(content["sample_time"]))
    return (step_matrix(content, at) - np.eye(len(content["error"]))) / h


def implicit_rate(content: Any) -> float:
    """The α of the slowest eigenvalue of (I − hA)⁻¹ = a factor 1/(1 + αh), by NumPy from the file alone."""
    h = float(Fraction(content["sample_time"]))
    radius = np.abs(1 / (1 - h * np.linalg.eigvals(a_of(content)))).max()
    return float((1 / radius - 1) / h)


def unstable_sets(count: int) -> None:
    """Random gains that NumPy finds unstable, from a matrix written by hand: refused, with a proof that is accepted."""
    generator, h, m, b = np.random.default_rng(11), 0.01, 1.7, 0.4
    found = 0
    while found < count:
        kind = ("cfo", "to")[found % 2]
        k, k_v = (round(float(g), 2) for g in generator.uniform(-400, 400, 2))
        below = k * k_v if kind == "cfo" else -k
        step = np.eye(2) + h * np.array([[-k_v - b / m, -1 / m], [below, 0]])
        if np.abs(np.linalg.eigvals(step)).max() < 1.0001:
            continue
        found += 1
        result = outcome("one_mass", ONE.format(kind=kind, gains=GAINS[kind].format(k, k_v), h=h, step="euler"))
        assert isinstance(result, Refusal)
        assert result.proof is not None, (kind, k, k_v)
        assert verify.check(json.dumps(result.proof)).facts[0] == "P is not positive definite"
        assert spectral(result.proof) < 1e-6


def test_unstable_gains_are_refused_with_a_proof() -> None:
    unstable_sets(30)


@pytest.mark.slow
def test_a_thousand_unstable_gain_sets_are_refused_with_a_proof() -> None:
    unstable_sets(1000)


@pytest.mark.slow
def test_no_refutation_of_what_is_true() -> None:
    """The limit of a stable set with a rate below the spectral one, or another sign, point or direction, is refused."""
    found = outcome(
        "two_mass", "{kind: gcfo, velocity: estimated, gains: {K_F: [500, 700], K_v: [10, 10]}, sample_time: 0.001}"
    )
    assert isinstance(found, Certificate) and found.limit is not None
    proof = dict(found.limit)
    lower = {**proof, "decay_rate": str(Fraction(proof["decay_rate"]) * 99 / 100)}
    certificate = {**found.content, "along": ["1", "0", "0", "0"]}
    turned = {**proof, "along": ["0"] * 4}
    short = {**proof, "along": proof["along"][:3]}
    swapped = {**proof, "lyapunov_matrix": found.content["lyapunov_matrix"]}
    negated = {**proof, "lyapunov_matrix": [[str(-Fraction(x)) for x in row] for row in proof["lyapunov_matrix"]]}
    for false in (lower, certificate, turned, short, swapped, negated, {**proof, "along": []}):
        with pytest.raises(verify.Refused):
            verify.check(json.dumps(false))


def test_mutated_refutations_stay_true_or_are_refused() -> None:
    """Any number of a refutation changed: what is accepted is still true by NumPy's eigenvalues."""
    found = outcome("one_mass", ONE.format(kind="cfo", gains="{K_F: 10, K_v: 100}", h=0.001, step="euler"))
    assert isinstance(found, Certificate) and found.limit is not None
    generator, accepted = np.random.default_rng(5), 0
    for _ in range(300):
        mutant = json.loads(json.dumps(found.limit))
        where = [("decay_rate", None, None), ("sample_time", None, None)]
        where += [(key, i, j) for key in ("matrix", "lyapunov_matrix") for i in range(2) for j in range(2)]
        key, i, j = where[int(generator.integers(len(where)))]
        factor = Fraction(float(generator.choice([-1, 0, 0.5, 0.9, 0.99, 1.01, 2.0, 10.0]))).limit_denominator(1000)
        if i is None:
            mutant[key] = str(Fraction(mutant[key]) * factor)
        else:
            mutant[key][i][j] = str(Fraction(mutant[key][i][j]) * factor)
            if key == "lyapunov_matrix":
                mutant[key][j][i] = mutant[key][i][j]
        try:
            verify.check(json.dumps(mutant))
        except verify.Refused:
            continue
        accepted += 1
        assert spectral(mutant) <= float(Fraction(mutant["decay_rate"])) * (1 + 1e-9)
    assert 5 < accepted < 250
