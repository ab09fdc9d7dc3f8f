"""The likelihood of a residual that is slow noise in part, against exact likelihoods of its covariance matrix."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.force_gain import slow_noise_likelihood

COUNT = 300


@cache
def covariances() -> list[tuple[Array, float]]:
    """Inverse and logarithm of the determinant, of every share of slow noise and correlation time."""
    shares = [0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 0.97, 1.0]
    found = []
    for share, time in product(shares, np.geomspace(1, 25, 8)):
        covariance = share * toeplitz(np.exp(-np.arange(COUNT) / time)) + (1 - share) * np.eye(COUNT)
        found.append((np.linalg.inv(covariance), float(np.linalg.slogdet(covariance)[1])))
    return found


def exact(residual: Array) -> float:
    """Greatest Gaussian log-likelihood over the share of slow noise, its correlation time and the size of both."""
    sizes = ((float(residual @ inverse @ residual) / COUNT, logarithm) for inverse, logarithm in covariances())
    return max(-0.5 * COUNT * float(np.log(size)) - 0.5 * logarithm for size, logarithm in sizes)


def test_white_residuals_gain_as_in_a_white_likelihood() -> None:
    """N/2 ln of the ratio of squares, for the values that the band holds."""
    white = np.random.default_rng(1).normal(size=4000)
    for band in (1.0, 0.25):
        gain = slow_noise_likelihood(white, band) - slow_noise_likelihood(1.1 * white, band)
        assert gain == pytest.approx(0.5 * 4000 * band * np.log(1.21), rel=0.01)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("seed", range(3, 11))
def test_differences_are_those_of_exact_likelihoods(share: float, seed: int) -> None:
    """A wave of 11 turns, as slow as the slow noise, one of 40 turns, which is faster, and a drift: in the residual or
    not. Both ends of a drift differ, which a Fourier transform takes for a jump.

    Whittle's approximation and the steps of the two grids make less than a nat.
    """
    draw, phi = np.random.default_rng(seed), np.exp(-1 / 8)
    slow = lfilter([np.sqrt(1 - phi**2)], [1, -phi], draw.normal(size=COUNT + 200))[200:]
    noise = np.sqrt(share) * slow + np.sqrt(1 - share) * draw.normal(size=COUNT)
    turn = np.linspace(0.0, 2 * np.pi, COUNT, endpoint=False)
    gains = []
    for force in (np.sin(11 * turn + 0.3), np.sin(40 * turn + 0.3), 0.4 * (turn - np.pi)):
        found = slow_noise_likelihood(noise, 1.0) - slow_noise_likelihood(noise + 0.5 * force, 1.0)
        assert found == pytest.approx(exact(noise) - exact(noise + 0.5 * force), abs=1.0)
        gains.append(found)
    assert gains[0] < gains[1] or not share


def test_a_residual_of_nothing_is_as_likely_as_can_be() -> None:
    assert slow_noise_likelihood(np.zeros(COUNT), 1.0) > slow_noise_likelihood(1e-9 * np.ones(COUNT), 1.0)
    assert slow_noise_likelihood(np.ones(2), 1.0) == 0.0
