"""Free-run prediction of a log, restarted every so often from the measured state: how well a model explains it."""

from __future__ import annotations

import casadi
import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.system import System
from codegen.simulate.drive import drive_columns
from codegen.simulate.loads import load_states
from codegen.simulate.plant import Plant
from codegen.simulate.sensor_error import SensorError

Array = NDArray[np.float64]


def free_run(
    system: System,
    log_time: Array,
    positions: Array,
    velocities: Array,
    inputs: Array,
    restart_s: float = 0.5,
    substeps: int = 10,
    trim_s: float = 0.0,
) -> Array:
    """Predicted positions, restarted from the measured state every ``restart_s`` seconds.

    Pass the whole log and trim here, not before: a delayed input reaches back to commands before the first restart, and
    the states of friction laws, which no log has, are run along the measured slip from the log's beginning. A law that
    a plant cannot run (see ``is_simulable``) is replaced by its level of steady sliding. Positions are readings of
    sensors with their declared errors; loads behind springs are run along the measured motion too.

    Args:
        system: with its effects.
        log_time: (N,) seconds, evenly spaced.
        positions, velocities: (N, n) measured state, filtered.
        inputs: (N, m) commands, held from t_k to t_(k+1).
        restart_s: seconds between restarts, at least two samples.
        substeps: steps in one sample.
        trim_s: seconds at each end that are not predicted, where filtered states are poor.

    Returns:
        (N, n); at a restart the measured position itself; inf where the prediction is not finite; NaN in trimmed rows.

    Raises:
        ValueError: if the shapes do not fit, time does not increase or nothing is left after trimming.
    """
    count, n = positions.shape
    if velocities.shape != (count, n) or len(log_time) != count or n != system.degrees_of_freedom:
        raise ValueError(f"{len(log_time)} times, positions {positions.shape}, velocities {velocities.shape}")
    period = (log_time[-1] - log_time[0]) / max(count - 1, 1)
    cut = round(trim_s / period) if period > 0 else 0
    kept = count - 2 * cut
    if kept < 2:
        raise ValueError(f"{count} samples, {cut} of them trimmed at each end; expected 2 or more left")
    length = min(max(2, round(restart_s / period)), kept)
    runs = -(-kept // length)
    used = slice(cut, cut + kept)
    drives = drive_columns(system, log_time, inputs, substeps)[used]
    drives = np.vstack([drives, np.repeat(drives[-1:], runs * length - kept, axis=0)]).reshape(runs, length, -1)
    plant, scale = Plant(system, substeps), SensorError(system)
    readings, positions = positions, scale.true(positions)
    velocities = scale.true_velocities(positions, velocities)
    states = friction_states(plant, positions, velocities, period)[used][::length]
    loads = load_states(system, positions, velocities, period, substeps)[used][::length]
    start = plant.start(positions[used][::length], velocities[used][::length], states, loads)
    after = plant.run(start, drives[:, : length - 1])
    predicted = np.full((count, n), np.nan)
    rows = np.concatenate([start[:, None, :n], after[:, :, :n]], axis=1).reshape(runs * length, n)[:kept]
    predicted[used] = np.where(np.isfinite(rows), scale.measured(rows), np.inf)
    predicted[used][::length] = readings[used][::length]
    return predicted


def friction_states(plant: Plant, positions: Array, velocities: Array, period: float) -> Array:
    """The states (N, states) that a plant's friction laws reach along a measured motion, from rest without load."""
    system, dynamic = plant.system, plant.contacts.dynamic
    if not dynamic.contacts:
        return np.zeros((len(positions), 0))
    x, v = casadi.SX.sym("x", positions.shape[1]), casadi.SX.sym("v", positions.shape[1])
    distribution = to_casadi(system.distribution, symbol_values(system.values, (system.positions, x)))
    slip = casadi.mtimes(distribution.T, v)[list(dynamic.contacts)]
    slips = casadi.Function("slip", [x, v], [slip])(positions.T, velocities.T).full().T
    return dynamic.follow(slips, period, plant.substeps)
