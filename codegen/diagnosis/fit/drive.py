"""Drive force of a model along a motion, what actuators and friction leave of it, and the residual over that share."""

from dataclasses import replace

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from codegen.base.arrays import Array
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.residual import (
    Problem,
    arguments_of,
    by_bodies,
    effective_inputs,
    evaluate_forces,
    force_function,
    inputs_at,
    inverse_dynamics_residual,
    level_columns,
    points,
    unfiltered_residual,
    without_levels,
)
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import Trial
from codegen.mechanics.casadi_form import over_rows
from codegen.mechanics.system import Matrix, System

LEAST_LEFT = 1e-6
"""Lower limit of ``drive_left``, to avoid a division by zero."""


class DriveLeft:
    """Fraction of the logged drive force that remains after actuators and load-dependent friction, of a trial.

    The median over samples of |Σ w ∂f/∂w| for f = g − U λ with the actuators' outputs, over that for f = g with the
    logged inputs. Derivatives are used since a dead zone passes an error of the drive unchanged; samples in saturation
    are left out. The median is used since at very low speed the sign of the speed is noise.
    """

    def __init__(self, trial: Trial, motion: Motion) -> None:
        self._trial, self._motion, system = trial, motion, trial.changed
        self._function: casadi.Function | None = None
        self._known: dict[bytes, Array] = {}
        self._acting: list[int] = []  # indices of the symbols on which it depends
        if _changes_drive(system):
            inputs = Matrix(system.inputs)  # Σ w ∂f/∂w of f = g and f = g − M a − U λ
            columns = [Matrix(f.jacobian(inputs) * inputs) for f in (system.force, Matrix(system.equation_error))]
            self._arguments = arguments_of(trial, columns)
            self._function = force_function(system, columns, [trial.symbols[k] for k in self._arguments])
            of_chains = [k for k, s in enumerate(trial.symbols) if s in trial.symbols_of_chains]
            self._acting = [*self._arguments, *of_chains]

    def at(self, theta: Array) -> Array:
        """(n,) at a vector of the trial, which changes no sensor error; once for all values that do not act on it."""
        key = self._trial.numbers(theta)[self._acting].tobytes()
        if key not in self._known:
            shares, passed = self._along(theta)
            left = [np.median(one[some]) if some.any() else 1.0 for one, some in zip(shares.T, passed.T, strict=True)]
            self._known[key] = np.clip(left, LEAST_LEFT, 1 / LEAST_LEFT)
        return self._known[key]

    @property
    def follows_load(self) -> bool:
        """Whether the fraction is known at each sample, of one coordinate with friction that depends on the inputs."""
        return rubs_by_load(self._trial.changed) and self._trial.changed.degrees_of_freedom == 1

    def relative(self, theta: Array) -> Array | None:
        """(N, n) fraction at each sample over the median of ``at``; None if friction does not follow the inputs.

        None, too, of several coordinates: the slopes of an arm's residual by its links are computed once for all fits,
        without these factors.

        Friction in proportion to the load takes from the drive force while it drives, and adds to it while it brakes.
        Over the median alone, an error of the drive counts (1 + mu)/(1 - mu) times as much in braking as in driving.
        """
        if not self.follows_load:
            return None
        (shares, passed), left = self._along(theta), self.at(theta)
        return np.where(passed, np.clip(shares, LEAST_LEFT, 1 / LEAST_LEFT), left) / left

    def _along(self, theta: Array) -> tuple[Array, NDArray[np.bool_]]:
        """(N, n) fraction at each sample, and where it is known."""
        motion, system = self._motion, self._trial.changed
        shape = len(motion.time), system.degrees_of_freedom
        if self._function is None:
            return np.ones(shape), np.zeros(shape, dtype=bool)
        numbers = self._trial.numbers(theta)
        at = points(system, motion, inputs_at(self._trial, motion, numbers))
        both = over_rows(self._function, at, numbers[self._arguments])
        drive, net = np.split(both, 2, axis=1)
        used = motion.usable if motion.counted is None else motion.usable & motion.counted
        passed = used[:, None] & (drive != 0) & (net != 0)
        return np.abs(np.divide(net, drive, out=np.ones(shape), where=passed)), passed


def drive_left(system: System, motion: Motion) -> Array:
    """``DriveLeft`` of a system with its own values."""
    return DriveLeft(Trial(system, (), ()), motion).at(np.zeros(0))


def drive_symbols(system: System) -> set[sympy.Symbol]:
    """Symbols of the drive force: of ∂g/∂w."""
    if not system.inputs:
        return set()
    found: set[sympy.Symbol] = Matrix(system.force).jacobian(Matrix(system.inputs)).free_symbols
    return found


def drive_gain(system: System, other: System, motion: Motion) -> Array:
    """RMS drive force Σ w ∂g/∂w by the logged inputs over that of another system, (n,).

    A coordinate without drive has the geometric mean of the others, which move it; 1 without any drive.
    """
    if not system.inputs:
        return np.ones(system.degrees_of_freedom)
    own, its = (_drive_rms(s, motion) for s in (system, other))
    driven = (own > 0) & (its > 0)
    gains = own[driven] / its[driven]
    found = np.full(len(its), float(np.exp(np.log(gains).mean())) if len(gains) else 1.0)
    found[driven] = gains
    return found


@identity_cache(OF_MODELS)
def _drive_rms(system: System, motion: Motion) -> Array:
    """(n,) RMS of Σ w ∂g/∂w by the logged inputs."""
    inputs = Matrix(system.inputs)
    column = Matrix(system.force.jacobian(inputs) * inputs)
    drive = evaluate_forces(system, [column], motion, motion.inputs)[0]
    return np.asarray(np.sqrt(np.mean(drive[motion.usable] ** 2, axis=0)))


def drive_shares(system: System, other: System, motion: Motion, rows: NDArray[np.bool_]) -> Array:
    """RMS of the effect of the inputs on g − U λ over that of another system, (n,); 1 where the inputs have none.

    Or the same on the samples ``rows`` (N, n) in motion after regression on the friction levels, if that is smaller.
    """
    if not _changes_drive(system):
        return np.ones(system.degrees_of_freedom)
    drives = [_drive(s, motion) for s in (system, other)]
    shares = _ratio_of_rms(*(d[motion.usable] for d in drives))
    for i, used in enumerate(rows.T):
        if used.any():
            rest = (without_levels(other, motion, used, motion.low_pass(d)[:, i], i)[used, None] for d in drives)
            shares[i] = min(shares[i], *_ratio_of_rms(*rest))
    return shares


def drive_in_motion(system: System, motion: Motion, used: NDArray[np.bool_], i: int) -> Array:
    """(M,) effect of the inputs on row i of g − U λ at the samples ``used``, after regression on friction levels."""
    return without_levels(system, motion, used, motion.low_pass(_drive(system, motion))[:, i], i)[used]


def _ratio_of_rms(values: Array, others: Array) -> Array:
    """RMS of each column over that of another array's; 1 where that is zero."""
    one, other = (np.sqrt(np.mean(v**2, axis=0)) for v in (values, others))
    return np.asarray(np.divide(one, other, out=np.ones(len(one)), where=other > 0))


def _changes_drive(system: System) -> bool:
    """Whether actuators or friction change the drive force."""
    return bool(system.actuators) or rubs_by_load(system)


def rubs_by_load(system: System) -> bool:
    """Whether friction depends on the inputs."""
    return any(c.force.has(w) for c in system.contacts for w in system.inputs)


@identity_cache(OF_MODELS)
def _drive(system: System, motion: Motion) -> Array:
    """(N, n) change of g − U λ by the inputs, unfiltered."""
    inputs, (_, others) = effective_inputs(system, motion), by_bodies(system)
    forces = [evaluate_forces(system, [others], motion, w) for w in (inputs, 0 * inputs)]
    return np.asarray((forces[0] - forces[1])[0])


@identity_cache(OF_MODELS)
def residual_at_drive(system: System, motion: Motion) -> Array:
    """The residual over ``drive_left`` at each sample, low-passed, (N, n): comparable between models that scale the
    drive force.
    """
    left = DriveLeft(Trial(system, (), ()), motion)
    relative = left.relative(np.zeros(0))
    if relative is None:
        return np.asarray(inverse_dynamics_residual(system, motion) / left.at(np.zeros(0)))
    return np.asarray(motion.low_pass(unfiltered_residual(system, motion) / relative) / left.at(np.zeros(0)))


@identity_cache(OF_MODELS)
def residual_over_friction(system: System, motion: Motion) -> Array:
    """The residual over the fraction of the drive force that friction leaves, at each sample, low-passed, (N, n)."""
    left = DriveLeft(Trial(replace(system, actuators={}), (), ()), motion)
    relative = left.relative(np.zeros(0))
    if relative is None:
        return inverse_dynamics_residual(system, motion)
    return motion.low_pass(unfiltered_residual(system, motion) / (relative * left.at(np.zeros(0))))


def residual_without_levels(problem: Problem, system: System) -> Array:
    """(N, n) low-passed force residual of a system, less the least-squares contribution of its friction levels."""
    motion, used = problem.motion, problem.used.T
    by_coordinate = enumerate(zip(residual_at_drive(system, motion).T, used, strict=True))
    return np.stack([without_levels(system, motion, rows, one, i) for i, (one, rows) in by_coordinate], axis=1)


def without_values(
    problem: Problem,
    system: System,
    forces: Array,
    slopes: Array,
    limits: tuple[Array, Array],
    joint: int | None = None,
    constant: bool = False,
) -> Array:
    """(N, n) forces, such as ``residual_at_drive``, less what levels and changes of values within limits explain.

    Each coordinate has its own fit, so that values that act on several may differ between them.

    Args:
        forces: over ``drive_left``.
        slopes: (N, n, p) of the residual by the values.
        limits: (p,) least and largest change.
        joint: the only coordinate that is fitted; all if not given.
        constant: whether a constant force is regressed on too.
    """
    motion, found = problem.motion, forces.copy()
    left = drive_left(system, motion)
    for i in range(found.shape[1]) if joint is None else [joint]:
        used = problem.used[:, i]
        levels = level_columns(system, motion, i)
        levels = np.hstack([levels, np.ones((len(levels), 1))]) if constant else levels
        columns = np.hstack([levels, -slopes[:, i] / left[i]])
        free = np.full(levels.shape[1], np.inf)
        bounds = np.append(-free, limits[0]), np.append(free, limits[1])
        found[:, i] -= columns @ bounded_least_squares(columns[used], found[used, i], bounds)
    return found


def bounded_least_squares(columns: Array, values: Array, bounds: tuple[Array, Array]) -> Array:
    """(p,) weights of columns (N, p) within bounds; zero for a column without influence."""
    weights, size = np.zeros(columns.shape[1]), np.sqrt((columns**2).sum(axis=0))
    some = size > 0
    if some.any():
        q, r = np.linalg.qr(columns[:, some] / size[some])
        low, high = (bound[some] * size[some] for bound in bounds)
        weights[some] = lsq_linear(r, q.T @ values, (np.minimum(low, 0.0), np.maximum(high, 0.0))).x / size[some]
    return weights
