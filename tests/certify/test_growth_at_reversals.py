"""Of all P with one rate, that which a reversal makes grow least."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.certify.lyapunov import least_growth_at_reversals

GENERATED = Path(__file__).parents[2] / "generated"


def shipped(name: str) -> tuple[Any, Any]:
    content = json.loads((GENERATED / name / "certificate.json").read_text("utf-8"))
    return content, np.array([[float(Fraction(x)) for x in row] for row in content["matrix"]])


def largest(p: Any, q: Any) -> float:
    """The largest x'Px / x'Qx."""
    root = np.linalg.inv(np.linalg.cholesky(q))
    return float(np.linalg.eigvalsh(root @ p @ root.T)[-1])


def least_growth(step: Any, fall: float, scale: float) -> float:
    """Over a grid of all P of order 2, up to a factor, with step'P step <= fall P."""
    turn, best = np.diag([1.0, -1.0]), np.inf
    for angle in np.linspace(-0.999, 0.999, 400):
        for size in np.exp(np.linspace(-6, 6, 400)) * scale:
            p = np.array([[1.0, angle * size], [angle * size, size * size]])
            growth = (1 + abs(angle)) / (1 - abs(angle))  # of J'PJ against P: entries apart from the diagonal turn
            if growth < best and largest(step.T @ p @ step, p) <= fall:
                assert growth == pytest.approx(largest(turn @ p @ turn, p), rel=1e-6)
                best = growth
    return best


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one_mass", "rig", "belt_axis", "one_mass_cfo_semi_implicit"])
def test_no_other_p_of_the_rate_grows_notably_less(name: str) -> None:
    content, matrix = shipped(name)
    h, rate = float(Fraction(content["sample_time"])), float(Fraction(content["decay_rate"]))
    p = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
    least = least_growth(np.eye(2) + h * matrix, 1 - 2 * rate * h, np.sqrt(p[1, 1] / p[0, 0]))
    assert float(Fraction(content["reversals"][0]["growth"])) < 1.25 * least


@pytest.mark.parametrize("name", ["one_mass", "rig", "emps", "two_mass"])
def test_it_falls_at_the_best_rate_and_grows_as_is_stated(name: str) -> None:
    content, matrix = shipped(name)
    h, flips = float(Fraction(content["sample_time"])), [turn["flips"] for turn in content["reversals"]]
    p = least_growth_at_reversals(matrix, h, flips)
    step = np.eye(len(matrix)) + h * matrix
    assert p is not None
    assert largest(step.T @ p @ step, p) == pytest.approx(np.abs(np.linalg.eigvals(step)).max() ** 2, rel=1e-9)
    for turn in content["reversals"]:
        signs = np.diag([-1.0 if k in turn["flips"] else 1.0 for k in range(len(p))])
        assert float(Fraction(turn["growth"])) == pytest.approx(largest(signs @ p @ signs, p), rel=0.02)


def test_none_where_the_modes_are_no_basis_or_nothing_turns() -> None:
    assert least_growth_at_reversals(np.array([[-1.0, 1.0], [0.0, -1.0]]), 0.01, [[1]]) is None
    assert least_growth_at_reversals(np.diag([-1.0, -2.0]), 0.01, []) is None
    assert least_growth_at_reversals(np.diag(-np.arange(1.0, 10.0)), 0.01, [[8]]) is None
