"""Acceleration error of free runs in weak form, a test of models with a load behind a spring.

The motion of such a load is not measured, and its force residual is mostly differentiated noise. Free runs compute that
motion; a wrong one accelerates the coordinate when the measured one does not.
"""

from __future__ import annotations

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.credit import ALPHA, SIGN_BLOCKS, p_of_sign_flips
from codegen.diagnosis.fit.output_error import Fit

WINDOW = 1.5
"""Width of a window in periods of the cutoff; the window has the gain 1/2 at 0.8 times the cutoff."""
LARGER = 1.5
"""Least factor on the squared acceleration error, as geometric mean over segments, at which a model is refused."""
MOST = 20.0
"""Limit of the logarithm of a ratio, so that a single diverging run does not decide the test."""


def acceleration_errors(fit: Fit, coordinate: int, cutoff_hz: float) -> Array:
    """(S,) squared acceleration error of a coordinate in each segment, summed over windows, unit² of it.

    The error is e = measured − predicted. Its mean second derivative over a window of the width 2T about t₀ is

        T⁻¹ ∫ψ((t − t₀)/T) e'' dt = T⁻³ ∫ψ''((t − t₀)/T) e dt,   ψ(s) = (1 − s²)⁴ over its integral,

    so that no noise is differentiated (weak form). Windows overlap by half. A constant acceleration a gives a.
    """
    record = fit.runner.record
    error = record.targets - fit.runner.run(fit.theta, fit.offsets)
    error = error[..., coordinate] if record.joints is None else error[fit.rows_of(coordinate), :, 0]
    half = max(3, min(round(0.5 * WINDOW / (cutoff_hz * record.sample_time)), (error.shape[1] - 1) // 2))
    s = np.arange(-half, half + 1) / half
    kernel = (48 * s**2 - 8 * (1 - s**2)) * (1 - s**2) ** 2  # ψ''
    kernel -= kernel.mean()  # a constant error has no acceleration
    kernel *= 2 / (kernel @ s**2)  # and t²/2 that of 1
    kernel /= (half * record.sample_time) ** 2
    windows = np.lib.stride_tricks.sliding_window_view(error, len(s), axis=1)[:, ::half]
    return np.asarray(((windows @ kernel) ** 2).sum(axis=1))


def larger_acceleration_error(before: Fit, after: Fit, coordinate: int, cutoff_hz: float) -> str:
    """Reason to refuse a model that makes the acceleration error of free runs significantly larger; else empty.

    A sign-flip test on the logarithms of the ratio of squared errors, summed over blocks of neighbouring segments. Runs
    that diverge with both models are left out.
    """
    one, other = (acceleration_errors(fit, coordinate, cutoff_hz) for fit in (after, before))
    known = np.isfinite(one) | np.isfinite(other)
    squares = [np.where(np.isfinite(squares), squares, np.inf)[known] + 1e-300 for squares in (one, other)]
    more = np.clip(np.log(squares[0] / squares[1]), -MOST, MOST)
    blocks = np.array([block.sum() for block in np.array_split(more, min(SIGN_BLOCKS, max(1, len(more))))])
    times = float(np.exp(more.mean())) if len(more) else 1.0
    if not times > LARGER or p_of_sign_flips(blocks) > ALPHA:
        return ""
    return f"makes the squared acceleration error of the simulation {times:.2g} times as large"
