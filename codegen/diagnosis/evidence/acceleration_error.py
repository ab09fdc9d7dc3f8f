"""Acceleration error of free runs, in weak form: whether a load behind a spring moves as the log does.

The motion of such a load is not measured, so it has no force residual that is not differentiated noise. Free runs
compute that motion, and a wrong one shakes the coordinate where the log shows nothing.
"""

from __future__ import annotations

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.credit import ALPHA, SIGNED, random_signs
from codegen.diagnosis.fit.output_error import Fit

WINDOW = 1.5
"""Width of a window in periods of the cutoff: it keeps half of what lies at 0.8 times the cutoff."""
RINGS = 1.5
"""Least factor on the squared acceleration error, as geometric mean over blocks, at which a model is refused."""


def acceleration_errors(fit: Fit, cutoff_hz: float) -> Array:
    """(S,) squared acceleration error of each segment, summed over windows and coordinates, in squared units of these.

    The error is e = measured − predicted. Over a window of the width 2T about t₀ its mean second derivative is

        ∫ψ((t − t₀)/T) e'' dt = T⁻² ∫ψ''((t − t₀)/T) e dt,   ψ(s) = (1 − s²)⁴ over its integral,

    so that no noise is differentiated (weak form). Windows overlap by half. The noise-free error of a constant
    acceleration a is a.
    """
    record = fit.runner.record
    error = record.targets - fit.runner.run(fit.theta, fit.offsets)
    half = max(3, min(round(0.5 * WINDOW / (cutoff_hz * record.sample_time)), (error.shape[1] - 1) // 2))
    s = np.arange(-half, half + 1) / half
    kernel = (48 * s**2 - 8 * (1 - s**2)) * (1 - s**2) ** 2  # ψ''
    kernel -= kernel.mean()  # a constant error has no acceleration
    kernel *= 2 / (kernel @ s**2)  # and t²/2 that of 1
    kernel /= (half * record.sample_time) ** 2
    windows = np.lib.stride_tricks.sliding_window_view(error, len(s), axis=1)[:, ::half]
    return np.asarray(((windows @ kernel) ** 2).sum(axis=(1, 2)))


def rings(before: Fit, after: Fit, cutoff_hz: float) -> str:
    """Why not, where a model makes the acceleration error of free runs significantly larger; else empty.

    By the logarithms of its squares, summed over blocks of neighbouring segments, with random signs.
    """
    more = np.log(acceleration_errors(after, cutoff_hz) / acceleration_errors(before, cutoff_hz))
    blocks = np.array([block.sum() for block in np.array_split(more, min(SIGNED, len(more)))])
    times = float(np.exp(more.mean()))
    if not times > RINGS or random_signs(float(blocks.sum() / np.linalg.norm(blocks))) > ALPHA:
        return ""
    return f"makes the squared acceleration error of free runs {times:.2g} times as large"
