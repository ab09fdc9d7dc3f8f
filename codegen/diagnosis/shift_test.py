"""Shift test: whether one of two models leaves less residual where they differ, however short the time they differ.

Tests on blocks of the log ask for several blocks with a gain. Two models may differ in one: a dead zone and a constant
force are one motion except while the input is below the dead zone's width.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codegen.base.arrays import Array

ROUNDING = 1e-9
"""Relative error of a sum by the Fourier transform."""


def by_shifts(pairs: Sequence[tuple[Array, Array]]) -> float:
    """Probability of such a gain where the truth is half-way between two models, by circular shifts of the log.

        g_k = Σ_t d(t) m(t + k),   d = b − a,   m = (a + b)/2;   g_0 is half the gain Σ b² − Σ a²

    with b and a the residuals of the other model and of this one, so that d is what the two predict differently. If m
    does not depend on d, every g_k is as probable as g_0, whatever the correlation in time. So p is the share of shifts
    with g_k ≥ g_0: an event elsewhere in the log that is as large makes it large. With several coordinates p is too
    small where the models differ on one that is used at few of the samples: shifts find zeros there.

    Of two models that are wrong each at times of its own, m depends on d. So this one must not leave more where they
    differ than elsewhere: p is 1 unless Σ d² a² ≤ Σ d² · mean a². That does not help where each is wrong at random in
    about one moment of a log: a log then often holds a moment of one of them only.

    Args:
        pairs: (b, a), each (N,), of every coordinate, at the samples that some coordinate uses: at rest a shift finds
            nothing. Zero where a coordinate is not used.
    """
    gains, there, everywhere = np.zeros(1), 0.0, 0.0  # one gain of each shift
    for other, this in pairs:
        apart, used = other - this, (other != 0) | (this != 0)
        whole, count = max(float(other @ other), float(this @ this), 1e-300), len(this)
        spectrum = np.fft.rfft((this + other) / 2) * np.conj(np.fft.rfft(apart))
        gains = gains + np.fft.irfft(spectrum, count) / whole
        mean = float(this @ this) / max(int(used.sum()), 1)
        there += float(apart**2 @ this**2) / max(mean, 1e-300) / whole
        everywhere += float(apart @ apart) / whole
    if gains[0] <= 0 or there > everywhere:
        return 1.0
    return float((gains >= (1 - ROUNDING) * gains[0]).mean())
