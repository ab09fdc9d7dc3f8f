"""Starting values for a compliance: resonance of a load behind a spring in the force residual of a rigid model.

Let a share ρ of the inertia M hang behind a spring k and a damper c. The load follows the motor's acceleration a by
a_load = (c s + k)/(ρM s² + c s + k) a, and the residual of the rigid model is

    r = ρM (a_load − a) = −ρM · s²/(s² + 2ζω s + ω²) a,   ω² = k/(ρM), 2ζω = c/(ρM),

so for each ω and ζ one regression of r on the filtered acceleration gives ρ. A lightly damped resonance is so narrow
that a free run with a frequency 10 % off gives no information; here a fine grid is cheap.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from codegen.diagnosis.signals import Motion

Array = NDArray[np.float64]

FREQUENCIES = np.geomspace(0.03, 1.5, 40)
"""Frequencies of the load with the motor held, in cutoffs of the log."""
DAMPING_RATIOS = (0.03, 0.12, 0.4)
LEAST, MOST = 0.03, 0.97
"""Range of the load's share of the inertia."""
APART = 1.3
"""Least ratio between the frequencies of two starting values."""


@dataclass(frozen=True)
class Resonance:
    """A load behind a spring: ω in rad/s with the motor held, damping ratio ζ and share ρ of the inertia."""

    frequency: float
    damping_ratio: float
    share: float


def resonances(
    residual: Array, acceleration: Array, inertia: float, motion: Motion, most: int
) -> tuple[Resonance, ...]:
    """The resonances that explain most of a residual (N,), best first, with distinct frequencies.

    Args:
        acceleration: (N,) of the coordinate. inertia: M.
    """
    used, rate = motion.usable, 1 / motion.sample_time
    y = residual[used] - residual[used].mean()
    found: list[tuple[float, Resonance]] = []
    for frequency, ratio in product(2 * np.pi * motion.cutoff_hz * FREQUENCIES, DAMPING_RATIOS):
        b, a = bilinear([1.0, 0.0, 0.0], [1.0, 2 * ratio * frequency, frequency**2], rate)
        column = motion.low_pass(lfilter(b, a, acceleration)[:, None])[used, 0]
        power = float(column @ column)
        share = -float(column @ y) / (power * inertia) if power > 0 else 0.0
        if share > 0:
            left = y + min(share, MOST) * inertia * column
            kept = min(max(share, LEAST), MOST)
            found.append((float(left @ left), Resonance(float(frequency), ratio, kept)))
    chosen: list[Resonance] = []
    for _, one in sorted(found, key=lambda pair: pair[0]):
        if all(max(one.frequency, r.frequency) > APART * min(one.frequency, r.frequency) for r in chosen):
            chosen.append(one)
        if len(chosen) == most:
            break
    return tuple(chosen)
