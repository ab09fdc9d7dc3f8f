"""Sensor models of a simulated machine: noise, encoder steps, low-passed velocity, and declared sensor errors."""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi
import numpy as np

from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import over_rows, symbol_values, to_casadi
from codegen.mechanics.system import System

VELOCITY_FILTER_SAMPLES = 4
"""Time constant of the low-pass of a differentiated position, in samples."""


@dataclass(frozen=True)
class Sensors:
    """Encoders and tachometers; an array has an entry for each coordinate, or one for all.

    Noise is discrete white noise with the given RMS, independent of the sample time. Its spectral density is RMS² times
    the sample time, up to half the sample rate. For noise of a fixed density S, RMS = √(S/sample time).

    Attributes:
        position_noise: RMS, in the position's unit, added before rounding.
        encoder_step: positions are rounded to its multiples; 0 for no rounding.
        velocity_noise: RMS of a measured velocity.
        tachometer: whether the controller has the measured velocity, not a low-passed difference of positions.
    """

    position_noise: Array = field(default_factory=lambda: np.zeros(1))
    encoder_step: Array = field(default_factory=lambda: np.zeros(1))
    velocity_noise: Array = field(default_factory=lambda: np.zeros(1))
    tachometer: bool = False

    def noise(self, count: int, n: int, seed: int) -> tuple[Array, Array]:
        """Noise of positions and velocities over ``count`` samples, each (count, n); the same for the same seed."""
        generator = np.random.default_rng(seed)
        positions = generator.standard_normal((count, n)) * self.position_noise
        return positions, generator.standard_normal((count, n)) * self.velocity_noise

    def encoded(self, position: Array, noise: Array) -> Array:
        """Measured positions (n,): noise added, then rounded to the encoder's steps."""
        value = position + noise
        if not self.encoder_step.any():
            return value
        whole = np.where(self.encoder_step > 0, self.encoder_step, 1.0)
        return np.where(self.encoder_step > 0, np.floor(value / whole + 0.5) * whole, value)


def low_passed_velocity(measured: Array, before: Array, velocity: Array, period: float) -> Array:
    """Velocity estimate: backward difference of the measured position through a first-order low-pass filter."""
    share = 1 / (1 + VELOCITY_FILTER_SAMPLES)
    result: Array = velocity + share * ((measured - before) / period - velocity)
    return result


ITERATIONS = 12
"""Newton steps for the true position of a reading; each about squares the relative error."""


class SensorError:
    """Sensor error x_measured = x + η(x) of each coordinate that has a declared one.

    The reading is invertible since |η'| < 1, which the catalogue of effects requires.
    """

    def __init__(self, system: System) -> None:
        x = casadi.SX.sym("x", system.degrees_of_freedom)
        names = symbol_values(system.values, (system.positions, x))
        error = casadi.vertcat(*[to_casadi(system.sensor_errors.get(s, s * 0), names) for s in system.positions])
        self._any = bool(system.sensor_errors)
        self._error = casadi.Function("error", [x], [casadi.densify(error)])
        slope = casadi.vertcat(*[casadi.jacobian(error[k], x[k]) for k in range(x.shape[0])])
        self._slope = casadi.Function("slope", [x], [casadi.densify(slope)])

    def measured(self, positions: Array) -> Array:
        """Readings at true positions, both (N, n) or (n,)."""
        return positions + _over(self._error, positions) if self._any else positions

    def true(self, readings: Array) -> Array:
        """True positions of readings, by Newton's method; both (N, n) or (n,)."""
        if not self._any:
            return readings
        x = readings - _over(self._error, readings)
        for _ in range(ITERATIONS):
            x = x - (self.measured(x) - readings) / (1 + _over(self._slope, x))
        return np.asarray(x, dtype=float)

    def true_velocities(self, positions: Array, velocities: Array) -> Array:
        """True velocities from the rate of the readings, at true positions; all (N, n) or (n,)."""
        return velocities / (1 + _over(self._slope, positions)) if self._any else velocities


def _over(function: casadi.Function, at: Array) -> Array:
    return over_rows(function, np.atleast_2d(at)).reshape(at.shape)
