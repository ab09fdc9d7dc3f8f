"""Sensor models of a simulated machine: noise, encoder steps, low-passed velocity, and declared sensor errors."""

from dataclasses import dataclass, field
from functools import cached_property

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
        if self._whole is None:
            return value
        found: Array = np.floor(value / self._whole + 0.5) * self._whole
        return found if self._all_rounded else np.where(self.encoder_step > 0, found, value)

    @cached_property
    def _whole(self) -> Array | None:
        """The encoder's steps, 1 where there are none; None where no position has any. Asked for in every sample."""
        return np.where(self.encoder_step > 0, self.encoder_step, 1.0) if self.encoder_step.any() else None

    @cached_property
    def _all_rounded(self) -> bool:
        return bool((self.encoder_step > 0).all())


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


class Readings:
    """What is measured of a machine in a run, sample by sample.

    Args:
        samples: of the run.
        seed: of the noise.
        period: sample time, s.
    """

    def __init__(self, system: System, sensors: Sensors, samples: int, seed: int, period: float) -> None:
        self._sensors, self._period, self._error = sensors, period, SensorError(system)
        self._noise, self._velocity_noise = sensors.noise(samples, system.degrees_of_freedom, seed)
        self._before: Array | None = None
        self._filtered = np.zeros(system.degrees_of_freedom)

    def take(self, k: int, positions: Array, velocities: Array) -> tuple[Array, Array, Array]:
        """The measured positions and velocities of sample k, and the velocities that the controller has, each (n,).

        These are the measured ones, or without a tachometer the backward difference of the measured positions through a
        first-order low-pass filter, zero at the first sample.
        """
        measured = self._sensors.encoded(self._error.measured(positions), self._noise[k])
        before = measured if self._before is None else self._before
        share = 1 / (1 + VELOCITY_FILTER_SAMPLES)
        self._filtered = self._filtered + share * ((measured - before) / self._period - self._filtered)
        self._before = measured
        measured_velocities = velocities + self._velocity_noise[k]
        return measured, measured_velocities, measured_velocities if self._sensors.tachometer else self._filtered


def _over(function: casadi.Function, at: Array) -> Array:
    return over_rows(function, np.atleast_2d(at)).reshape(at.shape)
