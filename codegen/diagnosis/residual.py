"""The force residual of a model on a log: inverse dynamics with zero-phase filters, and its slopes by parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.recent import OF_MODELS, recent
from codegen.diagnosis.record import STEPS_PER_PERIOD, Record
from codegen.diagnosis.shooting import Shooter, all_law_terms, owners
from codegen.diagnosis.signals import Motion, central_difference
from codegen.diagnosis.trial import Runner, Trial
from codegen.mechanics.casadi_form import over_rows, to_casadi
from codegen.mechanics.loads import with_loads
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import TIME, Matrix, System
from codegen.simulate.drive import mean_about_samples
from codegen.simulate.dynamic_contact import DIRECTION, STANDSTILL, LawTerms
from codegen.simulate.sensors import SensorError
from codegen.spec.functions import Sgn

Array = NDArray[np.float64]


def evaluate_forces(
    system: System,
    columns: Sequence[Matrix],
    motion: Motion,
    inputs: Array | None = None,
    values: Mapping[Any, float] | None = None,
) -> Array:
    """Generalised forces at every sample, unfiltered, along the motion without the declared sensor errors.

    Args:
        columns: n by 1 matrices over x, v, w, accelerations and parameters.
        inputs: (N, m) in place of the motion's inputs.
        values: numbers for symbols that the system does not know (shape parameters).

    Returns:
        (len(columns), N, n).
    """
    n, m = system.degrees_of_freedom, len(system.inputs)
    point = casadi.SX.sym("point", 3 * n + m + 1)
    symbols = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME]
    names: dict[sympy.Symbol, Any] = {s: point[k] for k, s in enumerate(symbols)}
    names |= {s: casadi.SX(float(v)) for s, v in {**system.values, **(values or {})}.items()}
    stacked = casadi.vertcat(*[casadi.densify(to_casadi(column, names)) for column in columns])
    function = casadi.Function("forces", [point], [stacked])
    w = motion.inputs if inputs is None else inputs
    since = (motion.time - motion.time[0])[:, None]
    at = np.hstack([*true_motion(system, motion), w, since])
    return np.ascontiguousarray(over_rows(function, at).reshape(len(at), len(columns), n).transpose(1, 0, 2))


@recent(OF_MODELS)
def true_motion(system: System, motion: Motion) -> tuple[Array, Array, Array]:
    """True positions, velocities and accelerations, from the readings."""
    if not system.sensor_errors:
        return motion.positions, motion.velocities, motion.accelerations
    sensor = SensorError(system)
    positions = sensor.true(motion.positions)
    velocities = sensor.true_velocities(positions, motion.velocities)
    return positions, velocities, central_difference(velocities, motion.sample_time)


def level_parameters(system: System) -> list[sympy.Symbol]:
    """The friction parameters in which the laws are linear; a refit estimates them."""
    found: list[sympy.Symbol] = []
    for contact in system.contacts:
        for s in contact.law_parameters.values():
            slope = contact.law_level.diff(s)
            if slope != 0 and not slope.has(s) and not any(slope.has(q) for q in found):
                found.append(s)
    return found


@recent(OF_MODELS)
def slip_velocities(system: System, motion: Motion) -> Array:
    """(N, contacts)."""
    contacts = len(system.contacts)
    rows = []
    for c in range(contacts):
        column = sympy.zeros(system.degrees_of_freedom, 1)
        column[0] = system.slip_velocity[c]
        rows.append(Matrix(column))
    return np.ascontiguousarray(evaluate_forces(system, rows, motion)[:, :, 0].T)


@dataclass(frozen=True, eq=False)
class Problem:
    """A System and the Motion on which it is judged.

    Attributes:
        system: as declared.
        motion: smoothed.
        deviation: standard deviation, in SI, of each declared parameter that is uncertain.
    """

    system: System
    motion: Motion
    deviation: Mapping[sympy.Symbol, float]

    @cached_property
    def masks(self) -> Masks:
        return masks(self.system, self.motion, self.noise_speed)

    @cached_property
    def noise_speed(self) -> float:
        """Three standard deviations of the velocity noise after the fine filter, from the noise of the positions."""
        motion = self.motion
        noise = float(np.max(np.std(motion.measured - motion.positions, axis=0)))
        band = motion.fine_hz
        return float(3 * noise * 2 * np.pi * band / np.sqrt(3) * np.sqrt(2 * band * motion.sample_time))

    @cached_property
    def levels(self) -> list[sympy.Symbol]:
        """The friction levels that every fit re-estimates."""
        return level_parameters(self.system)

    @cached_property
    def uncertain(self) -> list[sympy.Symbol]:
        """Parameters that may move within their tolerance."""
        error = self.system.equation_error
        return [s for s, size in self.deviation.items() if size > 0 and error.has(s) and s not in self.levels]


STICK_SHARE = 0.004
"""A slip slower than this share of its own 95 % speed counts as standstill."""
LEAST_LEFT = 1e-6
"""Least share of the drive force, to avoid a division by zero."""
LONGEST_CROSSING_S = 0.03
"""A reversal passes through standstill faster than this; a longer standstill is stick."""


@dataclass(frozen=True, eq=False)
class Masks:
    """Samples that show sliding friction.

    Attributes:
        rows: (N, n) usable for each coordinate's force balance.
    """

    rows: NDArray[np.bool_]


@recent(OF_MODELS)
def effective_inputs(system: System, motion: Motion) -> Array:
    """The motion's inputs after the declared actuators, as ``System.equation_error`` takes them."""
    inputs = motion.inputs.copy()
    for k, w in enumerate(system.inputs):
        if w in system.actuators:
            inputs[:, k] = mean_about_samples(system, k, motion.sample_time, motion.commands[:, k])
    return inputs


def masks(system: System, motion: Motion, noise_speed: float = 0.0) -> Masks:
    """Samples to use: away from ends, gaps and standstill.

    At standstill friction takes any value within its level, so these samples are left out, with the filter's reach
    around them. Quick zero crossings stay. Of a log resampled on a finer grid, only as many samples are used as it had.
    """
    slip = slip_velocities(system, motion)
    reach = max(1, round(0.35 / (motion.cutoff_hz * motion.sample_time)))
    longest = max(2, round(LONGEST_CROSSING_S / motion.sample_time))
    rows = np.repeat(motion.usable[:, None], system.degrees_of_freedom, axis=1)
    for c in range(slip.shape[1]):
        threshold = max(STICK_SHARE * float(np.quantile(np.abs(slip[:, c]), 0.95)), noise_speed)
        widened = _widen(_long_runs(np.abs(slip[:, c]) <= threshold, longest), reach)
        for i in range(system.degrees_of_freedom):
            if system.distribution[i, c] != 0:
                rows[:, i] &= ~widened
    if motion.counted is not None:
        rows &= motion.counted[:, None]
    return Masks(rows)


@recent(OF_MODELS)
def inverse_dynamics_residual(system: System, motion: Motion, filtered: bool = True) -> Array:
    """Force residual g − M a − U λ at every sample, (N, n), with the system's friction levels.

    Args:
        filtered: whether it is low-passed.
    """
    raw = _balance(system, motion)
    return motion.low_pass(raw) if filtered else raw


@recent(OF_MODELS)
def residual_at_drive(system: System, motion: Motion) -> Array:
    """The low-passed residual, (N, n), over the share of the logged drive force that is left to the motion.

    Friction that follows the measured drive force, or the gain of an actuator, scales residual and drive in the same
    proportion; in this ratio that is neither an advantage nor a disadvantage. It is the plain residual where nothing
    scales the drive.
    """
    return np.asarray(inverse_dynamics_residual(system, motion) / drive_left(system, motion))


def residual_without_levels(problem: Problem, system: System) -> Array:
    """(N, n) low-passed force residual of a system, less the least-squares contribution of its friction levels."""
    residual = residual_at_drive(system, problem.motion)
    columns = [
        without_levels(system, problem.motion, problem.masks.rows[:, i], residual[:, i], i)
        for i in range(residual.shape[1])
    ]
    return np.stack(columns, axis=1)


def without_levels(system: System, motion: Motion, used: NDArray[np.bool_], residual: Array, i: int) -> Array:
    """The residual of one coordinate, (N,), less the least-squares contribution of its friction levels.

    Free runs weigh the log differently and may give other levels; what a level explains is not evidence for an effect.
    """
    touching = [c for c in range(system.distribution.shape[1]) if system.distribution[i, c] != 0]
    if not touching or not used.any():
        return residual
    columns = motion.low_pass(np.sign(slip_velocities(system, motion)[:, touching]))
    weights = np.linalg.lstsq(columns[used], residual[used], rcond=None)[0]
    return np.asarray(residual - columns @ weights)


def drive_left(system: System, motion: Motion) -> Array:
    """(n,) median over samples of Σ w ∂/∂w of g − U λ after the actuators over that of g as logged.

    Slopes, because a dead zone subtracts a constant and passes errors of the drive unchanged; samples at which a
    saturation passes nothing are not counted. The median, because at very low speed the sign of the speed is noise and
    friction may then add to the drive.
    """
    n = system.degrees_of_freedom
    if not _changes_drive(system):
        return np.ones(n)
    columns = [_by_inputs(system, f) for f in (system.force, system.equation_error)]
    drive, net = evaluate_forces(system, columns, motion, effective_inputs(system, motion))
    used = motion.usable if motion.counted is None else motion.usable & motion.counted
    left = np.ones(n)
    for i in range(n):
        passed = used & (drive[:, i] != 0) & (net[:, i] != 0)
        if passed.any():
            left[i] = np.median(np.abs(net[passed, i] / drive[passed, i]))
    return np.clip(left, LEAST_LEFT, 1 / LEAST_LEFT)


def drive_share(system: System, other: System, motion: Motion) -> float:
    """RMS of the force by which the inputs change g − U λ, over that of another system: least over the coordinates."""
    if not _changes_drive(system):
        return 1.0
    rms = [_drive_rms(s, motion) for s in (system, other)]
    return float(np.min(rms[0][rms[1] > 0] / rms[1][rms[1] > 0], initial=1.0))


def _changes_drive(system: System) -> bool:
    return bool(system.actuators) or any(c.force.has(w) for c in system.contacts for w in system.inputs)


def _drive_rms(system: System, motion: Motion) -> Array:
    inputs = effective_inputs(system, motion)
    forces = [evaluate_forces(system, [Matrix(system.equation_error)], motion, w) for w in (inputs, 0 * inputs)]
    change = (forces[0] - forces[1])[0, motion.usable]
    return np.asarray(np.sqrt(np.mean(change**2, axis=0)))


def _by_inputs(system: System, force: Matrix) -> Matrix:
    """Σ w ∂f/∂w over the inputs."""
    return Matrix(force.jacobian(Matrix(system.inputs)) * Matrix(system.inputs))


def _balance(system: System, motion: Motion) -> Array:
    """g − M a − U λ, (N, n); states that are not logged are simulated along the measured motion."""
    inputs = effective_inputs(system, motion)
    laws = dict(all_law_terms(system))
    bristles = [k for k, c in enumerate(system.contacts) if c.law.bristle_stiffness(c.law_parameters) != 0]
    if not bristles and not laws and not system.transmissions:
        return np.asarray(evaluate_forces(system, [system.equation_error], motion, inputs)[0])
    n, whole, hidden = system.degrees_of_freedom, with_loads(system), _hidden_states(system, motion)
    loads, states = len(system.transmissions), len(owners(system))
    behind = hidden[:, hidden.shape[1] - 2 * loads :]
    followed = replace(
        motion,
        positions=np.hstack([motion.positions, behind[:, :loads]]),
        velocities=np.hstack([motion.velocities, behind[:, loads:]]),
        accelerations=np.hstack([motion.accelerations, np.zeros((len(behind), loads))]),
    )
    dynamic = [*bristles, *laws]
    columns = [whole.equation_error]
    for k in dynamic:
        c, slip = system.contacts[k], system.slip_velocity[k]
        by_level = c.force - c.extra_force if k in bristles else Sgn(c.slip) * c.law_level
        columns += [Matrix(whole.distribution[:, k] * by_level.subs(c.slip, slip)), Matrix(whole.distribution[:, k])]
    raw, *rest = evaluate_forces(whole, columns, followed, inputs)
    slips, deflected = slip_velocities(system, motion), hidden[:, len(system.contacts) :][:, :states]
    taken = 0
    for k, by_level, direction in zip(dynamic, rest[::2], rest[1::2], strict=True):
        if k in bristles:
            stiffness = system.contacts[k].law.bristle_stiffness(system.contacts[k].law_parameters)
            force = float(stiffness.subs(system.values)) * hidden[:, k]
        else:
            count = len(laws[k].states)
            force = _law_force(system, k, laws[k], slips[:, k], deflected[:, taken : taken + count])
            taken += count
        raw = raw + by_level - direction * force[:, None]
    return np.asarray(raw[:, :n])


def _law_force(system: System, contact: int, terms: LawTerms, slip: Array, states: Array) -> Array:
    """(N,) λ of a law at slips (N,) and states (N, states)."""
    arguments = (system.contacts[contact].slip, DIRECTION, *terms.states)
    direction = np.clip(slip / STANDSTILL, -1.0, 1.0)
    (force,) = numpy_function([terms.force], arguments, system.values)(slip, direction, *states.T)
    return np.broadcast_to(np.asarray(force, dtype=float), slip.shape)


def _hidden_states(system: System, motion: Motion) -> Array:
    """(N, contacts + states + 2 loads) bristle deflections, states of laws, positions and velocities of loads."""
    h, count = motion.sample_time, len(motion.time)
    record = Record(
        motion.measured,
        motion.positions,
        motion.velocities,
        motion.commands,
        h,
        0.0,
        np.ones(system.degrees_of_freedom),
        np.arange(count, dtype=np.int32),
        1,
    )
    steps = max(1, int(np.ceil(h * STEPS_PER_PERIOD * motion.cutoff_hz)))
    return Runner(Trial(system, (), ()), Shooter([system], [()]), 0, record, steps).hidden()


def friction_estimate(system: System, motion: Motion) -> Array:
    """g − M a, (N, n): total generalised friction by inverse dynamics, unfiltered."""
    bare = replace(
        system,
        contacts=tuple(replace(c, extra_level=sympy.Integer(0), extra_force=sympy.Integer(0)) for c in system.contacts),
    )
    force = Matrix(bare.commanded(bare.force - bare.mass_matrix * Matrix(list(bare.accelerations))))
    return np.asarray(evaluate_forces(bare, [force], motion, effective_inputs(system, motion))[0])


def _long_runs(flags: NDArray[np.bool_], longest: int) -> NDArray[np.bool_]:
    """Runs of True that are longer than ``longest``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    kept = np.zeros_like(flags)
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if stop - start > longest:
            kept[start:stop] = True
    return kept


def _widen(flags: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    counts = np.concatenate([[0], np.cumsum(flags)])
    n = len(flags)
    low, high = np.maximum(np.arange(n) - reach, 0), np.minimum(np.arange(n) + reach + 1, n)
    return np.asarray(counts[high] - counts[low] > 0, dtype=bool)


REWEIGHED = 2
"""Iterations of reweighting each coordinate by its residual RMS (iteratively reweighted least squares)."""


@dataclass(frozen=True, eq=False)
class ForceRows:
    """Linearised low-passed force residual of one coordinate, away from standstill.

    Attributes:
        sample: (R,) index of each row in the motion. residual: (R,) at the system's own values. slopes: (R, p).
    """

    sample: NDArray[np.int_]
    residual: Array
    slopes: Array

    def left(self, change: Array) -> Array:
        """(R,) residual after a parameter change (p,)."""
        return np.asarray(self.residual + self.slopes @ change)


def force_rows(system: System, problem: Problem, symbols: Sequence[sympy.Symbol]) -> list[ForceRows]:
    """The rows of each coordinate that moves."""
    motion = problem.motion
    residual = inverse_dynamics_residual(system, motion)
    slopes = motion.low_pass(_slopes(system, motion, symbols))
    rows = []
    for i in range(system.degrees_of_freedom):
        used = np.flatnonzero(problem.masks.rows[:, i])
        if len(used):
            rows.append(ForceRows(used, residual[used, i], slopes[used, i]))
    return rows


def scales(rows: Sequence[ForceRows], prior_precision: Array, free: NDArray[np.bool_], pull: Array) -> Array:
    """Residual RMS on each coordinate after the fit of the free parameters.

    Args:
        prior_precision: (p,). pull: (p,) from the system's values to the centre of the prior.
    """
    size = np.array([_rms(r.residual) for r in rows])
    for _ in range(REWEIGHED):
        matrix, vector = np.diag(prior_precision), prior_precision * pull
        for r, one in zip(rows, size, strict=True):
            share = independent_samples(r.residual) / len(r.residual)
            matrix = matrix + share * r.slopes.T @ r.slopes / one**2
            vector = vector - share * r.slopes.T @ r.residual / one**2
        change = np.zeros(len(prior_precision))
        if free.any():
            change[free] = np.linalg.lstsq(matrix[np.ix_(free, free)], vector[free], rcond=1e-10)[0]
        size = np.array([_rms(r.left(change)) for r in rows])
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
    return max(float(np.sqrt(np.mean(values**2))), 1e-300)


def _slopes(system: System, motion: Motion, symbols: Sequence[sympy.Symbol]) -> Array:
    """(N, n, p) slopes of g − M a − U λ by parameters, unfiltered."""
    n, m = system.degrees_of_freedom, len(system.inputs)
    point, moved = casadi.SX.sym("point", 3 * n + m + 1), casadi.SX.sym("moved", len(symbols))
    variables = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME]
    names = {s: casadi.SX(float(v)) for s, v in system.values.items()}
    names |= {s: point[k] for k, s in enumerate(variables)} | {s: moved[k] for k, s in enumerate(symbols)}
    error = casadi.densify(to_casadi(system.equation_error, names))
    slope = casadi.densify(casadi.jacobian(error, moved))
    function = casadi.Function("slopes", [point, moved], [slope])
    since = (motion.time - motion.time[0])[:, None]
    at = np.hstack([*true_motion(system, motion), effective_inputs(system, motion), since])
    own = np.array([float(system.values[s]) for s in symbols])
    flat = np.asarray(function.map(len(at))(at.T, np.repeat(own[:, None], len(at), axis=1)))
    return np.ascontiguousarray(flat.reshape(n, len(at), len(symbols)).transpose(1, 0, 2))
