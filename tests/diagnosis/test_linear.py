"""Least squares in scaled unknowns, against rational arithmetic, and the correlation of a residual."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from codegen.diagnosis.fit.linear import correlation, fitted, independent, inverse, rms, solved

UNITS = (1e-9, 1.0, 1e7)
"""Sizes of three unknowns, as of a stiffness beside a play."""


def problem() -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Columns, values that they give exactly, and the weights of which they do."""
    columns = np.vander([1.0, 2.0, 3.0, 5.0], 3) / np.array(UNITS)
    weights = sympy.Matrix([1, -2, 3])
    values = sympy.Matrix(np.vander([1, 2, 3, 5], 3).tolist()) * weights
    return columns, np.array(values, dtype=float).ravel(), [float(w) * u for w, u in zip(weights, UNITS, strict=True)]


def test_unknowns_of_very_different_size_are_solved_for() -> None:
    columns, values, weights = problem()
    assert fitted(columns, values) == pytest.approx(weights, rel=1e-9)
    assert solved(columns.T @ columns, columns.T @ values) == pytest.approx(weights, rel=1e-9)
    assert inverse(columns.T @ columns) @ (columns.T @ values) == pytest.approx(weights, rel=1e-9)


def test_an_unknown_without_influence_does_not_move() -> None:
    columns, values, weights = problem()
    columns = np.insert(columns, 1, 0.0, axis=1)
    expected = [weights[0], 0.0, *weights[1:]]
    assert fitted(columns, values) == pytest.approx(expected, rel=1e-9)
    assert solved(columns.T @ columns, columns.T @ values) == pytest.approx(expected, rel=1e-9)


def test_independent_values_of_a_first_order_noise() -> None:
    """With x_k = φ x_(k−1) + white noise, the mean of N values varies as that of N (1 − φ)/(1 + φ) white ones."""
    noise = np.random.default_rng(3).normal(size=200_000)
    x = np.array(noise)
    for k in range(1, len(x)):
        x[k] += 0.8 * x[k - 1]
    assert correlation(x) == pytest.approx(0.8, abs=0.01)
    means = x.reshape(-1, 1000).mean(axis=1)
    assert independent(correlation(x)) == pytest.approx(rms(x) ** 2 / 1000 / means.var(), rel=0.3)
    assert correlation(np.array([1.0, -1.0] * 50)) == 0.0
    assert correlation(np.zeros(10)) == 0.0
