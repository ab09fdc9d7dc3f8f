"""The force residual of each coordinate, linearised in parameters: slopes, information, residual of a linear fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.drive import drive_gain, drive_symbols
from codegen.diagnosis.fit.linear import rms, solved
from codegen.diagnosis.fit.residual import Problem, effective_inputs, force_function, inverse_dynamics_residual, points
from codegen.diagnosis.fit.signals import Motion
from codegen.mechanics.casadi_form import over_rows
from codegen.mechanics.system import Matrix, System

GAIN_STEP = 1e-3
"""Relative step of a value for the slope of the drive force, which is usually linear in it."""
LEAST_GAIN = 0.3
"""Lower limit of a drive gain in a linearisation."""
REWEIGHED = 2
"""Iterations of reweighting each coordinate by its residual RMS (iteratively reweighted least squares)."""


@dataclass(frozen=True, eq=False)
class ForceRows:
    """The low-passed force residual of one coordinate at its usable samples, linearised in p parameters.

    Attributes:
        sample: (R,) indices of the samples.
        residual: (R,) in the unit of the coordinate's force.
        slopes: (R, p) derivatives of the residual by the parameters.
        gain: (p,) derivatives γ of the drive gain by the parameters; zeros if the residual is not divided by it.
    """

    sample: NDArray[np.int_]
    residual: Array
    slopes: Array
    gain: Array

    def about(self, change: Array) -> ForceRows:
        """The rows linearised about a change Δ of the values: r₀ + S Δ/(1 + γΔ), which is (r₀ + R Δ)/(1 + γΔ).

        The gain 1 + γΔ is limited to at least ``LEAST_GAIN``, for first steps that are too long.
        """
        if not self.gain.any():
            return replace(self, residual=self.residual + self.slopes @ change)
        step, gain = self.slopes @ change, max(1 + float(self.gain @ change), LEAST_GAIN)
        slopes = self.slopes / gain - np.outer(step, self.gain) / gain**2
        return replace(self, residual=self.residual + step / gain, slopes=slopes)


def force_rows(system: System, problem: Problem, symbols: Sequence[sympy.Symbol]) -> list[ForceRows]:
    """Linearised force residual of each coordinate that has usable samples."""
    motion = problem.motion
    residual = inverse_dynamics_residual(system, motion)
    slopes = residual_slopes(system, motion, symbols)
    rows = []
    for i in range(system.degrees_of_freedom):
        used = np.flatnonzero(problem.used[:, i])
        if len(used):
            rows.append(ForceRows(used, residual[used, i], slopes[used, i], np.zeros(len(symbols))))
    return rows


def relative_force_rows(
    system: System, problem: Problem, symbols: Sequence[sympy.Symbol], about: Mapping[sympy.Symbol, float]
) -> list[ForceRows]:
    """``force_rows`` of the residual over ``drive_gain``, which is 1 at the values: slopes ∂r/∂θ − r ∂gain/∂θ.

    ``about``: other values of the parameters, about which the residual is linearised.
    """
    there = {s: sympy.Float(value) for s, value in about.items()}
    rows = force_rows(system.with_parameters(there, {}), problem, symbols)
    change = np.array([float(system.values[s]) - about[s] for s in symbols])
    rows = [replace(r, residual=r.residual + r.slopes @ change) for r in rows]
    coordinates = np.flatnonzero(problem.used.any(axis=0))  # those that have rows
    return [
        replace(r, slopes=r.slopes - np.outer(r.residual, gain), gain=gain)
        for r, gain in zip(rows, _gain_slopes(system, problem.motion, symbols)[coordinates], strict=True)
    ]


def slopes_of_evidence(
    system: System, motion: Motion, symbols: Sequence[sympy.Symbol], limits: tuple[Array, Array]
) -> Array:
    """(N, n, p) slopes of the low-passed force residual r, for tests of an effect: ∂r/∂θ, or that of r/gain.

    The slopes of r/gain, ∂r/∂θ − r ∂gain/∂θ, are those of a coordinate whose ``drive_gain``, 1 + Σ γ Δ, may fall to
    ``LEAST_GAIN`` within the limits. There all parameters, a motor constant among them, have large tolerances. With all
    of them at zero r is zero too, so its own slopes would explain any residual, and any evidence for an effect.

    Args:
        limits: (p,) least and largest change Δ of the parameters.
    """
    slopes, gains = residual_slopes(system, motion, symbols), _gain_slopes(system, motion, symbols)
    # A limit may be infinite; of a parameter without effect on the gain it counts nothing.
    ends = [np.multiply(gains, limit, out=np.zeros_like(gains), where=gains != 0) for limit in limits]
    least = 1 + np.minimum(*ends).sum(axis=1)
    if not (least <= LEAST_GAIN).any():
        return slopes
    gains = np.where((least <= LEAST_GAIN)[:, None], gains, 0.0)
    return slopes - inverse_dynamics_residual(system, motion)[:, :, None] * gains


def _gain_slopes(system: System, motion: Motion, symbols: Sequence[sympy.Symbol]) -> Array:
    """(n, p) slopes of ``drive_gain`` by parameters."""
    acting, slopes = drive_symbols(system), np.zeros((system.degrees_of_freedom, len(symbols)))
    for k, s in enumerate(symbols):
        if s in acting and system.values[s] != 0:
            step = GAIN_STEP * abs(float(system.values[s]))
            other = system.with_parameters({s: system.values[s] + step}, {})
            slopes[:, k] = (drive_gain(other, system, motion) - 1) / step
    return slopes


def residual_slopes(system: System, motion: Motion, symbols: Sequence[sympy.Symbol]) -> Array:
    """(N, n, p) slopes of the low-passed residual g − M a − U λ by parameters."""
    at = points(system, motion, effective_inputs(system, motion))
    own = [float(system.values[s]) for s in symbols]
    function = force_function(system, [Matrix(system.equation_error)], symbols, slopes=True)
    flat = over_rows(function, at, own).reshape(len(at), len(symbols), system.degrees_of_freedom)
    return motion.low_pass(np.ascontiguousarray(flat.transpose(0, 2, 1)))


def information(rows: Sequence[ForceRows], sizes: Array, prior: Array) -> Array:
    """(p, p) information of independent samples with these RMS residuals, and of a prior, (p, p)."""
    matrix = prior
    for r, size in zip(rows, sizes, strict=True):
        share = independent_samples(r.residual) / len(r.residual)
        matrix = matrix + share * r.slopes.T @ r.slopes / size**2
    return matrix


def residual_sizes(rows: Sequence[ForceRows], prior: Array) -> Array:
    """Residual RMS of each coordinate after a linear fit of the parameters from the centre of their prior, (p, p)."""
    size = np.array([_rms(r.residual) for r in rows])
    for _ in range(REWEIGHED):
        vector = np.zeros(len(prior))
        for r, one in zip(rows, size, strict=True):
            share = independent_samples(r.residual) / len(r.residual)
            vector = vector - share * r.slopes.T @ r.residual / one**2
        change = solved(information(rows, size, prior), vector)
        size = np.array([_rms(r.residual + r.slopes @ change) for r in rows])
    return size


def independent_samples(residual: Array) -> float:
    """Effective number of independent samples: N over the two-sided sum of the autocorrelation up to its first zero."""
    count = len(residual)
    spectrum = np.abs(np.fft.rfft(residual, 2 * count)) ** 2
    correlation = np.fft.irfft(spectrum)[:count]
    if correlation[0] <= 0:
        return float(count)
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation <= 0)
    last = int(ends[0]) if len(ends) else count
    return float(max(1.0, count / (1 + 2 * correlation[1:last].sum())))


def _rms(values: Array) -> float:
    return max(rms(values), 1e-300)
