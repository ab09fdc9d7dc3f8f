"""The proposal of P does not hang on the last bit of the matrices, and its rate is near the best there is."""

from __future__ import annotations

from typing import Any

import cvxpy
import numpy as np
import pytest

from codegen.certify import lyapunov
from codegen.certify.centre import analytic_centre, certified_rates
from codegen.certify.lyapunov import (
    analytic_centre_at,
    common_lyapunov,
    common_lyapunov_at,
)


def family(h: float) -> list[Any]:
    """A stable matrix and its changes over a box, whose corners are some of them nearly mixtures of others."""
    dice = np.random.default_rng(5)
    middle, turns = np.diag([-30.0, -8.0, -3.0]), dice.normal(size=(4, 3, 3))
    corners = [middle + sum(s * t for s, t in zip(signs, turns, strict=True)) for signs in np.ndindex(2, 2, 2, 2)]
    return [a / (1 + h) for a in corners]


def shaken(matrices: list[Any], seed: int) -> list[Any]:
    """As another processor may round them."""
    dice = np.random.default_rng(seed)
    return [a * (1 + 1e-15 * dice.uniform(-1, 1, a.shape)) for a in matrices]


def normed(p: Any) -> Any:
    root = np.sqrt(np.diag(p))
    return p / np.outer(root, root)


@pytest.mark.parametrize("h", [0.0, 1e-3])
@pytest.mark.parametrize("near", [2e-3, 1e-5])
def test_another_rounding_gives_the_same_p_and_rate(near: float, h: float) -> None:
    def found(matrices: list[Any]) -> tuple[Any, float]:
        result = common_lyapunov(matrices, h, near=near)
        assert result is not None
        return result

    p, rate = found(family(h))
    for seed in range(4):
        other, slower = found(shaken(family(h), seed))
        assert slower == pytest.approx(rate, rel=1e-9)
        assert np.abs(normed(other) - normed(p)).max() < 1e-8


def test_thousands_of_matrices_need_the_inequalities_of_a_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Matrices within the hull of others change nothing, and with six directions that hull is not computed."""
    dice = np.random.default_rng(3)
    turns, shares = dice.normal(size=(6, 3, 3)), np.array([*np.ndindex(*[2] * 6)])
    corners = np.diag([-30.0, -8.0, -3.0]) + np.tensordot(shares, turns, axes=1) / 2
    inside = np.tensordot(dice.dirichlet(np.ones(len(corners)), 2000), corners, axes=1)
    sizes, solve = [], lyapunov.solve_lmi

    def counting(conditions: Any, structure: Any = None) -> Any:
        sizes.append(len(conditions))
        return solve(conditions, structure)

    few = common_lyapunov(corners, 1e-3)
    monkeypatch.setattr(lyapunov, "solve_lmi", counting)
    many = common_lyapunov(np.concatenate([corners, inside]), 1e-3)
    assert few is not None and many is not None
    assert many[1] == pytest.approx(few[1], rel=0.02) and max(sizes) < 60
    assert certified_rates(many[0], np.concatenate([corners, inside]), 1e-3).min() >= many[1]


def test_a_p_for_two_rates_is_the_same_too() -> None:
    matrices = family(1e-3)
    groups = [(matrices[:8], 0.5), (matrices[8:], -1.0)]
    p = analytic_centre_at(groups, 1e-3, common_lyapunov_at(groups, 1e-3))
    assert p is not None
    for stack, rate in groups:
        assert certified_rates(p, np.array(stack), 1e-3).min() > rate
    shaken_too = [(shaken(stack, 1), rate) for stack, rate in groups]
    other = analytic_centre_at(shaken_too, 1e-3, common_lyapunov_at(shaken_too, 1e-3))
    assert other is not None and np.abs(normed(other) - normed(p)).max() < 1e-8


@pytest.mark.parametrize("near", [2e-3, 1e-5])
def test_the_rate_is_within_half_a_percent_of_the_best(near: float) -> None:
    """Half a percent above it no P falls everywhere, by a problem of CVXPY's; just below it one does."""
    h, matrices = 1e-3, family(1e-3)
    found = common_lyapunov(matrices, h, near=near)
    assert found is not None
    p, fall = cvxpy.Variable((3, 3), symmetric=True), cvxpy.Variable()
    falls = {}
    for share in (0.999, 1.005):
        alpha = share * found[1]
        above = [-(a.T @ p + p @ a + h * a.T @ p @ a + 2 * alpha * p) >> fall * np.eye(3) for a in matrices]
        falls[share] = cvxpy.Problem(cvxpy.Maximize(fall), [p >> 0, cvxpy.trace(p) == 1, *above]).solve(
            solver="CLARABEL"
        )
    assert falls[0.999] > 1e-6 and falls[1.005] < -1e-6


def test_the_centre_is_where_the_slope_is_zero() -> None:
    """Against differences of the function itself; a start that does not serve gives none."""
    matrices, h, alpha = family(0.0), 0.0, 0.5
    start = common_lyapunov(matrices, h)
    assert start is not None
    p = analytic_centre([(matrices, alpha)], h, start[0])
    assert p is not None

    def value(q: Any) -> float:
        falls = [-(a.T @ q + q @ a + 2 * alpha * q) for a in matrices]
        return float(np.trace(q) - sum(np.linalg.slogdet(f)[1] for f in [*falls, q]))

    dice = np.random.default_rng(2)
    for _ in range(5):
        turn = dice.normal(size=(3, 3))
        turn = (turn + turn.T) * 1e-4 * np.linalg.norm(p)
        assert value(p + turn) > value(p) and value(p - turn) > value(p)
    assert analytic_centre([(matrices, 100.0)], h, start[0]) is None
