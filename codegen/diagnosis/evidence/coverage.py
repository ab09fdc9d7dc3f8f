"""Coverage of a log: ranges of the variables at the place of a candidate, and main periods of the force residual."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.measure import drive_force
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.signals import Motion, is_resolved
from codegen.diagnosis.fit.starting_values import resonances
from codegen.diagnosis.fit.trial import Part
from codegen.effects.start import Covered
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.system import Matrix, System

BINS = 16384
"""Bins of the histogram of positions over the span."""
PADDING = 16
"""Zero padding: the frequencies of the periodogram differ by 1/16 of a period over the whole span."""
LEAST_TURNS, MOST_TURNS = 1.0, 2000.0
"""Least and largest number of periods in the span."""
KEPT_PERIODS = 3
"""Largest number of periods of one residual."""
RIDGE = 1e-9
"""Ridge on the scaled normal equations, which are singular where the direction of motion never changes."""
KEPT_RESONANCES = 2
"""Largest number of resonances of one coordinate."""
SMALL_INPUTS = (0.005, 0.01, 0.02, 0.035, 0.05, 0.08, 0.12, 0.18, 0.25, 0.35, 0.5)
"""Quantiles of the magnitude of an input that are ``Covered.small_inputs``."""


@dataclass(frozen=True, eq=False)
class Survey:
    """The data from which the ranges of all candidates are computed.

    Attributes:
        residual: (N, n) force residual of the refitted model, with the effects that were found.
        drive: (N, n) low-passed drive force.
        used: (N, n) samples at which the force balance can be used; at standstill friction takes any value.
        mass, distribution: M and U at the mean position.
        carried: whether a declared force that depends on neither velocity nor input acts on a coordinate.
    """

    system: System
    motion: Motion
    residual: Array
    drive: Array
    used: NDArray[np.bool_]
    mass: Array
    distribution: Array
    carried: Sequence[bool]
    _found: dict[Hashable, Any] = field(default_factory=dict)

    def covered(
        self, part: Part, levels: Sequence[float], noise: Array, coupling: Mapping[str, float] | None = None
    ) -> Covered:
        """The ranges that the log covers at the place of a candidate.

        Args:
            levels: refitted friction levels of the contacts.
            noise: (n,) standard deviation of the noise of each position.
            coupling: k, c and load_fraction of a compliance that was found there, if any.
        """
        m, sits_on = self.motion, part.effect.sits_on
        contact = part.place if sits_on == "contact" else None
        i = part.effect.coordinate(self.system, part.place)
        if contact is None:
            x, v, used, across = m.positions[:, i], m.velocities[:, i], self.used[:, i], np.eye(len(self.mass))[i]
        else:
            column = self.distribution[:, contact]
            x, v = m.positions @ column, m.velocities @ column
            across = column / (column @ column)
            used = np.logical_and.reduce(self.used[:, column != 0], axis=1)
        span = max(float(np.ptp(x)), 1e-12)
        command = m.commands[:, part.place] if sits_on == "input" else np.zeros(len(m.time))
        return Covered(
            force=max(float(self.drive[:, i].std()), self.mass[i, i] * float(m.accelerations[:, i].std()), 1e-12),
            span=span,
            top_speed=max(float(np.quantile(np.abs(v), 0.95)), 1e-12),
            top_input=max(float(np.quantile(np.abs(command), 0.98)), 1e-12),
            peak_input=float(np.max(np.abs(command[m.usable]), initial=1e-12)),
            small_inputs=tuple(map(float, np.quantile(np.abs(command), SMALL_INPUTS))),
            inertia=float(self.mass[i, i]),
            level=max(levels[contact], 1e-9) if contact is not None and contact < len(levels) else 1.0,
            noise=float(noise[i]),
            sample_time=m.sample_time,
            duration=float(m.time[-1] - m.time[0]),
            cutoff_hz=m.cutoff_hz,
            periods=self._once(
                (sits_on, i, contact),
                lambda: _periods(_Path(sits_on, x, v, used, m.usable, span), self.residual @ across, m.cutoff_hz),
            ),
            carried=self.carried[i],
            coupling=coupling,
            resonances=self._once(i, lambda: self._resonances(i)),
        )

    def _once(self, key: Hashable, compute: Callable[[], Any]) -> Callable[[], Any]:
        """A function that computes a result at its first call."""

        def found() -> Any:
            if key not in self._found:
                self._found[key] = compute()
            return self._found[key]

        return found

    def _resonances(self, i: int) -> tuple[dict[str, float], ...]:
        """Stiffness, damping and load fraction of the main resonances of coordinate ``i``."""
        m, inertia = self.motion, float(self.mass[i, i])
        found = resonances(self.residual[:, i], m.accelerations[:, i], self.used[:, i], inertia, m, KEPT_RESONANCES)
        loads = [(r, r.share * inertia) for r in found]
        return tuple(
            {"k": load * r.frequency**2, "c": 2 * r.damping_ratio * r.frequency * load, "load_fraction": r.share}
            for r, load in loads
        )


def survey(system: System, motion: Motion, model: System | None = None) -> Survey:
    """The survey of a log; ``system``: with refitted values; ``model``: the same with the effects that were found."""
    middle = motion.positions[motion.usable].mean(axis=0)

    def numbers(matrix: Matrix) -> Array:
        return np.asarray(at_points(function_of(matrix, system.positions, system.values), middle[None])[0])

    complete = model or system
    still = system.declared_force.subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
    return Survey(
        system,
        motion,
        inverse_dynamics_residual(complete, motion),
        motion.low_pass(drive_force(system, motion)),
        Problem(system, motion, {}).used,
        numbers(system.mass_matrix),
        numbers(system.distribution),
        [f != 0 for f in still],
    )


@dataclass(frozen=True, eq=False)
class _Path:
    """The motion at the place of an effect, along which its force may be periodic.

    Attributes:
        x, v: (N,) position and velocity.
        used: (N,) samples in motion, at which a residual is compared.
        logged: (N,) samples away from ends and gaps. The machine may rest within a period, as it does in moves that are
            shorter than one.
    """

    sits_on: str
    x: Array
    v: Array
    used: NDArray[np.bool_]
    logged: NDArray[np.bool_]
    span: float

    @cached_property
    def modulation(self) -> Array:
        """q at the used samples, which modulates the force: sgn v on a contact, v² of a sensor, else 1."""
        q = {"contact": np.sign(self.v), "sensor": self.v**2}.get(self.sits_on, np.ones_like(self.v))[self.used]
        return np.asarray(q / max(float(np.abs(q).max(initial=0.0)), 1e-300))


def _periods(path: _Path, y: Array, cutoff_hz: float) -> tuple[float, ...]:
    """Periods of the waves that explain most of a residual (N,), by a least-squares (Lomb–Scargle) periodogram.

    A period is left out if the motion passes it only at frequencies |v|/p above the cutoff.
    """
    if not path.modulation.any():
        return ()
    turns, power = _periodogram(path, y[path.used])
    power[turns < LEAST_TURNS] = 0.0
    peaks = [
        k
        for k in np.argsort(-power)[:200]
        if power[k] > 0 and power[k] >= power[max(0, k - PADDING // 2) : k + PADDING // 2 + 1].max()
    ]
    periods = (float(path.span / turns[k]) for k in peaks)
    resolved = (p for p in periods if is_resolved(p, path.x, path.v, path.logged, cutoff_hz))
    return tuple(islice(resolved, KEPT_PERIODS))


def _periodogram(path: _Path, y: Array) -> tuple[Array, Array]:
    """Frequencies f, in periods over the span, and the squares that a sine of each and two more terms explain.

    Least squares of y = a + b q + q (c cos 2πfx + d sin 2πfx), with q the ``modulation``. The sums of the normal
    equations over samples are Fourier transforms of histograms over the position.
    """
    x, q = path.x, path.modulation
    place = np.clip(((x[path.used] - x.min()) / path.span * BINS).astype(int), 0, BINS - 1)
    count = round(PADDING * min(MOST_TURNS, path.used.sum() / 8)) + 1

    def waves(weights: Array) -> Array:
        """Σ weight exp(2πi f x) at every frequency, up to twice the last."""
        density = np.bincount(place, weights=weights, minlength=BINS)
        return np.asarray(np.conj(np.fft.rfft(density, PADDING * BINS)))

    once, square, data = (waves(w) for w in (q, q**2, q * y))
    twice, once, wave, data = square[: 2 * count - 1 : 2], once[:count], square[:count], data[:count]
    total = square[0].real
    matrix = np.empty((count, 4, 4))
    matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1] = len(q), q.sum(), total
    matrix[:, 0, 2], matrix[:, 0, 3], matrix[:, 1, 2], matrix[:, 1, 3] = once.real, once.imag, wave.real, wave.imag
    matrix[:, 2, 2], matrix[:, 3, 3] = (total + twice.real) / 2, (total - twice.real) / 2
    matrix[:, 2, 3] = twice.imag / 2
    rows, columns = np.tril_indices(4, -1)
    matrix[:, rows, columns] = matrix[:, columns, rows]
    size = np.sqrt(np.maximum(np.einsum("kii->ki", matrix), 1e-12 * total))
    matrix /= size[:, :, None] * size[:, None, :]
    matrix += RIDGE * np.eye(4)
    right = np.column_stack([np.full(count, y.sum()), np.full(count, data[0].real), data.real, data.imag]) / size

    weights = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    return np.arange(count) / PADDING, np.asarray(np.einsum("ki,ki->k", right, weights))
