"""What a machine's sensors tell of its state at a sample."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
VELOCITY_FILTER_SAMPLES = 4


def _none() -> Array:
    return np.zeros(1)


@dataclass(frozen=True)
class Sensors:
    """Encoders and, where there are any, tachometers; an entry a coordinate, or one for all.

    Noise is white and discrete: each sample draws its own, independent of all others and of the sample time, with the
    RMS given. Its spectral density, RMS² times the sample time up to half the sample rate, so falls as sampling gets
    faster; who means a noise of fixed density S gives each sample time its own RMS, √(S/sample time).

    Attributes:
        position_noise: RMS, in the position's unit, added before rounding.
        encoder_step: positions are rounded to its multiples; 0 rounds nothing.
        velocity_noise: RMS of a measured velocity.
        tachometer: whether the controller gets the measured velocity, and not a low-passed difference of positions.
    """

    position_noise: Array = field(default_factory=_none)
    encoder_step: Array = field(default_factory=_none)
    velocity_noise: Array = field(default_factory=_none)
    tachometer: bool = False

    def noise(self, count: int, n: int, seed: int) -> tuple[Array, Array]:
        """Noise of positions and velocities over ``count`` samples, each (count, n); the same for the same seed."""
        generator = np.random.default_rng(seed)
        positions = generator.standard_normal((count, n)) * self.position_noise
        return positions, generator.standard_normal((count, n)) * self.velocity_noise

    def encoded(self, position: Array, noise: Array) -> Array:
        """Measured positions (n,): noise added, then rounded to the encoder's steps."""
        value = position + noise
        if not np.any(self.encoder_step):
            return value
        step = np.broadcast_to(self.encoder_step, value.shape)
        whole = np.where(step > 0, step, 1.0)
        return np.where(step > 0, np.floor(value / whole + 0.5) * whole, value)


def low_passed_velocity(measured: Array, before: Array, velocity: Array, period: float) -> Array:
    """Backward difference of the measured position through a first-order low-pass of a few samples."""
    share = 1 / (1 + VELOCITY_FILTER_SAMPLES)
    return np.asarray(velocity + share * ((measured - before) / period - velocity), dtype=float)
