"""Errors of a model on held-out data: RMS force residual, and RMS position error of a free-run simulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.acceptance import SIGN_BLOCKS
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.record import KEPT, Record
from codegen.diagnosis.fit.residual import (
    effective_inputs,
    evaluate_forces,
    inverse_dynamics_residual,
    level_parameters,
)
from codegen.diagnosis.fit.signals import TRIM_S, Motion, central_difference
from codegen.diagnosis.fit.trial import Runner, Trial, runner_of
from codegen.diagnosis.results import ErrorFigures
from codegen.mechanics.system import Matrix, System

RESTART_S = 0.5
WHOLE = slice(None)
LONGEST_STEP_S = 5e-4
SHORTEST_PERIODS = 5.0
"""Shortest free run between two restarts, in periods of the coarse cutoff."""


def measure(
    system: System, motion: Motion, used: NDArray[np.bool_], window: slice, restart_s: float = RESTART_S
) -> ErrorFigures:
    """Error figures of a system on one window of a motion; ``used`` are the same samples for every model compared."""
    per_row, force_rms, relative = force_errors(system, motion, used, window)
    positions, parts = free_run_errors(system, motion, window, restart_s)
    total = rms(np.array([p for p in positions if not np.isnan(p)]))
    return ErrorFigures(force_rms, per_row, relative, total, tuple(positions), parts)


def force_errors(
    system: System, motion: Motion, used: NDArray[np.bool_], window: slice = WHOLE
) -> tuple[tuple[float, ...], float, float]:
    """RMS low-passed residual by coordinate and over all, and its norm (``power``) over that of ``driving_force``."""
    residual = residual_at_drive(system, motion)
    inside = np.zeros(len(motion.time), dtype=bool)
    inside[window] = True
    rows = used & inside[:, None]
    squares = [residual[rows[:, i], i] ** 2 for i in range(residual.shape[1])]
    per_row = tuple(float(np.sqrt(s.mean())) if len(s) else float("nan") for s in squares)
    pooled = np.concatenate(squares)
    drive, inverse = driving_force(system, motion), inverse_mass(system, motion)
    left, driven = (float(power(inverse, np.where(rows, r, 0.0)).sum()) for r in (residual, drive))
    relative = float(np.sqrt(left / driven)) if driven > 0 else float("inf")
    return per_row, float(np.sqrt(pooled.mean())) if len(pooled) else float("nan"), relative


def restart_within_reach(system: System, motion: Motion, window: slice, longest: float = RESTART_S) -> float:
    """Seconds between restarts with which free runs stay near the motion: ``longest``, halved while necessary.

    A run whose error exceeds the distance moved since the restart, as of a rotor in another cogging minimum, does not
    discriminate between models.
    """
    restart, least = longest, SHORTEST_PERIODS / motion.cutoff_hz
    while restart / 2 >= least:
        error = free_run_errors(system, motion, window, restart)[0]
        since = motion.measured - motion.measured[_last_restart(motion, restart)]
        way = np.sqrt(np.mean(since[window] ** 2, axis=0))
        if not np.any(np.asarray(error) > way):
            break
        restart /= 2
    return restart


def _last_restart(motion: Motion, restart_s: float) -> NDArray[np.int_]:
    """(N,) sample of the last restart; before the first restart, at ``TRIM_S``, the sample itself."""
    h, places = motion.sample_time, np.arange(len(motion.time))
    cut, length = round(TRIM_S / h), max(2, round(restart_s / h))
    return np.where(places < cut, places, cut + (places - cut) // length * length)


def free_run_errors(
    system: System, motion: Motion, window: slice, restart_s: float = RESTART_S
) -> tuple[list[float], tuple[tuple[float, ...], ...]]:
    """RMS of predicted less raw position on each coordinate, and mean squares in ``SIGN_BLOCKS`` or fewer parts.

    NaN and zero where the reading never changes while another one does: a model that sticks there has no error at all,
    and a ratio to zero is meaningless for the joint that moves.
    """
    error = free_run_series(system, motion, restart_s)[window]
    usable = motion.usable[window] & ~np.isnan(error).any(axis=1)
    if motion.counted is not None:
        usable &= motion.counted[window]
    if not usable.any() or not np.isfinite(error[usable]).all():
        return [float("inf")] * error.shape[1], ()
    squares = error[usable] ** 2
    still = np.ptp(motion.measured[window][usable], axis=0) == 0
    still &= ~still.all()
    squares[:, still] = 0.0
    runs = max(1, round(len(squares) * motion.sample_time / restart_s))
    parts = tuple(tuple(map(float, part.mean(axis=0))) for part in np.array_split(squares, min(SIGN_BLOCKS, runs)))
    return [float(e) for e in np.where(still, np.nan, np.sqrt(np.mean(squares, axis=0)))], parts


@identity_cache(OF_MODELS)
def free_run_series(system: System, motion: Motion, restart_s: float = RESTART_S) -> Array:
    """Predicted less raw position in free-run simulation, (N, n); inf where the run diverges."""
    h = motion.sample_time
    start = motion.low_pass(motion.measured)
    substeps = int(min(20, max(2, np.ceil(h / LONGEST_STEP_S))))
    start_speed = central_difference(start, h)
    levels = level_parameters(system)  # the declared model and a refit of the levels are compiled once
    predicted = free_run(system, h, start, start_speed, motion.commands, restart_s, substeps, TRIM_S, levels)
    lost = np.concatenate([[0], np.cumsum(~motion.usable)])  # samples that are not usable before each
    predicted[lost[1:] > lost[_last_restart(motion, restart_s)]] = np.nan
    return np.asarray(predicted - motion.measured)


STEPS, STEP = 2, 1e-3
"""Gauss–Newton steps, and the step of their slopes over the standard deviation of each state."""


def free_run(
    system: System,
    sample_time: float,
    positions: Array,
    velocities: Array,
    commands: Array,
    restart_s: float = 0.5,
    substeps: int = 10,
    trim_s: float = 0.0,
    arguments: Sequence[sympy.Symbol] = (),
) -> Array:
    """(N, n) predicted readings of the positions, restarted from the measured state every ``restart_s`` seconds.

    Inf for predictions that are not finite, NaN in the ``trim_s`` seconds at each end, where filtered states are poor.
    The whole log is needed for delays, and for states that are not logged. The states of loads behind springs are
    fitted to the run after each restart. A law that cannot be simulated (``is_simulable``) is replaced by its level of
    steady sliding.

    Args:
        positions, velocities: (N, n) measured state, filtered.
        commands: (N, m), held from t_k to t_(k+1).
        restart_s: at least two samples.
        substeps: in one sample.
        arguments: parameters that the compiled code takes as arguments: models that differ in these alone share it.

    Raises:
        BadInput: where there is no C compiler.
    """
    count, n = positions.shape
    cut = round(trim_s / sample_time)
    kept = count - 2 * cut
    length = min(max(2, round(restart_s / sample_time)), kept)
    start = np.arange(cut, cut + kept, length, dtype=np.int32)
    # The last run extends past the end of the log; its prediction there is dropped.
    commands = np.vstack([commands, np.repeat(commands[-1:], length, axis=0)])
    record = Record(positions, positions, velocities, commands, sample_time, np.ones(n), start, length)
    values = np.array([float(system.values[s]) for s in arguments])
    runner = runner_of(Trial(system, (), tuple(arguments)), record, substeps)
    loads = None
    if system.transmissions:
        compared = np.vstack([positions[cut : cut + kept], np.full((len(start) * length - kept, n), np.nan)])
        loads = _estimated_loads(runner, values, compared.reshape(-1, length, n))
    rows = runner.at(values, smoothed=True)(record.at_rest, loads).reshape(-1, n)[:kept]
    predicted = np.full((count, n), np.nan)
    predicted[cut : cut + kept] = np.where(np.isfinite(rows), rows, np.inf)
    return predicted


def _estimated_loads(runner: Runner, theta: Array, compared: Array) -> Array:
    """(S, 2 loads) corrections of the positions and velocities of the loads at the start of each segment.

    Least squares with a Gaussian prior (maximum a posteriori): in each segment the corrections δ minimise

        K mean(e²)/σ² + Σ (δ_i/s_i)²

    with e the error of the predicted positions, σ its RMS without correction, K = ``KEPT`` independent values, and s_i
    the RMS deflection of the spring, and its rate, over all starts.

    The uncorrected state is simulated along the measured motion (``Shooter.hidden``). A lightly damped load keeps a
    phase error for many periods, from a slightly wrong frequency or an unknown state at the start of the log, and the
    free run would then show this error and not that of the model.

    Args:
        compared: (S, L, n) positions that the run should predict; NaN where unknown.
    """
    record, loads = runner.record, len(runner.trial.changed.transmissions)
    split = [t.coordinate for t in runner.trial.changed.transmissions]
    followed = runner.hidden(theta)[0, :, -2 * loads :]
    motor = np.hstack([record.positions[record.start][:, split], record.velocities[record.start][:, split]])
    scale = np.sqrt(np.mean((followed - motor) ** 2, axis=0))
    run = runner.at(theta, smoothed=True)

    def errors(offsets: Array) -> Array:
        found: Array = run(record.at_rest, offsets * scale) - compared
        found[np.isnan(compared)] = 0.0
        return found.reshape(len(found), -1)

    offsets = np.zeros_like(followed)  # in units of ``scale``
    with np.errstate(all="ignore"):  # a run that diverges has no finite cost, and is never better
        before = errors(offsets)
        weight = KEPT / np.maximum(np.sum(before**2, axis=1), 1e-300)
        cost = np.full(len(before), float(KEPT))
        for _ in range(STEPS):
            slopes = np.stack([(errors(offsets + move) - before) / STEP for move in STEP * np.eye(2 * loads)], axis=2)
            along = weight[:, None, None] * slopes.transpose(0, 2, 1)
            pull = (along @ before[:, :, None])[:, :, 0] + offsets
            step = np.linalg.solve(along @ slopes + np.eye(2 * loads), pull[:, :, None])[:, :, 0]
            after = errors(offsets - step)
            new = weight * np.sum(after**2, axis=1) + np.sum((offsets - step) ** 2, axis=1)
            better = new < cost
            offsets[better] -= step[better]
            before[better], cost[better] = after[better], new[better]
    return np.asarray(offsets * scale)


@identity_cache(OF_MODELS)
def drive_force(system: System, motion: Motion) -> Array:
    """(N, n) the part of g due to the inputs: g(x, v, w) − g(x, v, 0)."""
    return np.asarray(evaluate_forces(system, [system.drive_force], motion, effective_inputs(system, motion))[0])


@identity_cache(OF_MODELS)
def inertial_force(system: System, motion: Motion) -> Array:
    """(N, n) low-passed M a."""
    row = Matrix(system.mass_matrix * Matrix(list(system.accelerations)))
    return motion.low_pass(evaluate_forces(system, [row], motion)[0])


def inertia_along(system: System, motion: Motion, i: int) -> Array:
    """(N,) M_ii along the motion."""
    column = Matrix([system.mass_matrix[i, i], *[0] * (system.degrees_of_freedom - 1)])
    return np.asarray(evaluate_forces(system, [column], motion)[0][:, 0])


def driving_force(system: System, motion: Motion) -> Array:
    """(N, n) low-passed drive force; the inertial force of a machine that no input drives, such as a free pendulum."""
    drive = motion.low_pass(drive_force(system, motion))
    return drive if np.any(drive != 0) else inertial_force(system, motion)


def driving_force_name(system: System) -> str:
    """What ``driving_force`` is, in words: by the inputs that the machine has, even where a log holds them at zero."""
    return "drive force" if system.inputs else "inertial force M a"


@identity_cache(OF_MODELS)
def inverse_mass(system: System, motion: Motion) -> Array:
    """(N, n, n) M(x)⁻¹ along a motion."""
    columns = [Matrix(system.mass_matrix[:, j]) for j in range(system.degrees_of_freedom)]
    mass = evaluate_forces(system, columns, motion).transpose(1, 2, 0)
    if (mass == mass[:1]).all():  # one inverse serves all samples
        return np.broadcast_to(np.linalg.pinv(mass[:1], hermitian=True), mass.shape)
    return np.asarray(np.linalg.pinv(mass, hermitian=True))


def power(inverse: Array, forces: Array) -> Array:
    """(N,) r' M(x)⁻¹ r of forces r (N, n), by ``inverse_mass``: a norm by the acceleration that a force causes."""
    return np.asarray((forces * (inverse @ forces[:, :, None])[:, :, 0]).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Drive:
    """The force that drives a motion, ``driving_force``, as the reference for other forces."""

    system: System
    motion: Motion

    def share(self, forces: Array) -> float:
        """Forces, (N, n), over the driving force, in the norm of ``power`` over the usable samples."""
        return float(np.sqrt(self._acting(forces) / max(self._driven, 1e-300)))

    @cached_property
    def residual(self) -> Array:
        return inverse_dynamics_residual(self.system, self.motion)

    @cached_property
    def _inverse(self) -> Array:
        return inverse_mass(self.system, self.motion)[self.motion.usable]

    @cached_property
    def _driven(self) -> float:
        return self._acting(driving_force(self.system, self.motion))

    def _acting(self, forces: Array) -> float:
        return float(power(self._inverse, forces[self.motion.usable]).sum())
