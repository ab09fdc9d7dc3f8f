"""The force residual of a model on a log, by inverse dynamics with zero-phase filters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.balance import evaluate_forces, slip_velocities
from codegen.diagnosis.law_states import all_law_terms, owners
from codegen.diagnosis.recent import OF_MODELS, recent
from codegen.diagnosis.shooting import STEPS_PER_PERIOD, Record, Shooter
from codegen.diagnosis.signals import Motion
from codegen.diagnosis.trial import Runner, Trial
from codegen.mechanics.loads import with_loads
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import Matrix, System
from codegen.simulate.drive import mean_about_samples
from codegen.simulate.dynamic_contact import DIRECTION, STANDSTILL, LawTerms
from codegen.spec.functions import Sgn

Array = NDArray[np.float64]

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
