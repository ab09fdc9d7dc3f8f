"""Permutation test by circular shifts: whether one of two models has less residual when the two differ.

Two models may differ in too few blocks for a test on blocks: a dead zone and a constant force are one motion except
while the input is below the dead zone's width.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codegen.base.arrays import Array

ROUNDING = 1e-9
"""Relative error of a sum by the Fourier transform."""
PARTS, LEAST_MOMENTS = 48, 3.0
"""Number of parts of the log, and least effective number of parts in which two models differ."""


def by_shifts(pairs: Sequence[tuple[Array, Array]]) -> float:
    """One-sided p value of a gain if the truth is half-way between two models, by circular shifts of the log.

        g_k = Σ_t d(t) m(t + k),   d = b − a,   m = (a + b)/2;   g_0 is half the gain Σ b² − Σ a²

    with b and a the residuals of the other model and of this one. If m does not depend on d, every g_k is as probable
    as g_0, whatever the correlation in time, and p is the share of shifts with g_k ≥ g_0. If both models are wrong, m
    depends on d. So p is 1 unless Σ d² a² ≤ Σ d² · mean a²: this model has no more residual when the two differ. It is
    also 1 if they differ in too few parts: (Σ q)²/Σ q² < ``LEAST_MOMENTS``, with q the sums of d² over ``PARTS`` parts.

    Args:
        pairs: (b, a), each (N,), of every coordinate, at the samples that some coordinate uses; zero where one does
            not.
    """
    count = max((len(this) for _, this in pairs), default=1)
    gains, there, everywhere, powers = np.zeros(count), 0.0, 0.0, np.zeros(PARTS)
    for other, this in pairs:
        whole = max(float(other @ other), float(this @ this), 1e-300)
        powers += [float(part @ part) / whole for part in np.array_split(other - this, PARTS)]
        used = (other != 0) | (this != 0)
        if not used.any():
            continue
        b, a = other[used], this[used]
        spectrum = np.fft.rfft((a + b) / 2) * np.conj(np.fft.rfft(b - a))
        gains += (np.fft.irfft(spectrum, len(a)) / whole)[np.arange(count) * len(a) // count]
        there += float((b - a) ** 2 @ a**2) / max(float(a @ a) / len(a), 1e-300) / whole
        everywhere += float((b - a) @ (b - a)) / whole
    moments = float(powers.sum() ** 2 / (powers @ powers)) if everywhere > 0 else 0.0
    if gains[0] <= 0 or there > everywhere or moments < LEAST_MOMENTS:
        return 1.0
    return float((gains >= (1 - ROUNDING) * gains[0]).mean())
