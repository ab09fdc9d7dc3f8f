"""Log-likelihood of a force residual, modelled as white noise plus first-order autoregressive noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.fft import dct

from codegen.base.arrays import Array

LONGEST = 1 / 12
"""Longest correlation time over the length of the log; slower noise is like an offset or a drift."""
TIMES = 8
SHARES = (0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.8, 0.9, 0.95, 1.0)
"""Shares of the power in the slow noise."""


def slow_noise_likelihood(residual: Array, band: float) -> float:
    """Log-likelihood of a residual (N,) by Whittle's approximation, as the best of a grid of noise models; nats.

        max over a, s, τ of −½ Σ_j (ln a S_j + c_j²/(a S_j)),   S = 1 − s + s (1 − φ²)/|1 − φ exp(−iω)|²,  φ = exp(−1/τ)

    with c_j the cosine transform at ω_j = πj/(N·band), which has no jump at the ends, S the spectrum of white noise and
    a share s of first-order autoregressive noise of the correlation time τ, and a its size. Constants are left out.

    Args:
        band: width of the band over the Nyquist frequency: N values hold N·band independent ones.
    """
    lines = round(len(residual) * min(band, 1.0))
    if lines < 4:
        return 0.0
    power = dct(residual, norm="ortho")[:lines] ** 2
    inverse, logarithms = _spectra(lines)
    sizes = np.maximum(inverse @ power, 1e-300) / lines
    return float(np.max(-0.5 * lines * np.log(sizes) - 0.5 * logarithms))


@lru_cache(maxsize=8)
def _spectra(lines: int) -> tuple[Array, Array]:
    """(models, lines) 1/S of each noise model at each spectral line, and (models,) Σ ln S; S: power spectrum."""
    turn = np.exp(-1j * np.pi * np.arange(lines) / lines)
    models = [np.ones(lines)]
    for time in np.geomspace(1.0, max(1.0, lines * LONGEST), TIMES):
        phi = np.exp(-1 / time)
        slow = (1 - phi**2) / np.abs(1 - phi * turn) ** 2
        models += [1 - share + share * slow for share in SHARES]
    spectra = np.array(models)
    return 1 / spectra, np.log(spectra).sum(axis=1)
