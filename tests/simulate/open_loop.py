"""Recorded commands through the simulator's time stepper, without a loop around it, and a free run of diagnosis."""

from __future__ import annotations

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.trial import Trial, runner_of
from codegen.mechanics.system import System
from codegen.simulate.drive import Chains
from codegen.simulate.plant import Plant

UNEVEN = 1e-6
"""Largest deviation of a step from the mean one, as a share of it, in evenly spaced times."""


def simulate_open_loop(
    system: System, time: Array, inputs: Array, x0: Array, v0: Array, substeps: int = 10
) -> tuple[Array, Array]:
    """The motion under recorded commands, held from t_k to t_(k+1), which pass through the system's actuators.

    Args:
        system: with its effects.
        time: (N,) seconds, evenly spaced.
        inputs: (N, m) commands in SI.
        x0, v0: (n,) state at time[0].
        substeps: steps in one sample.

    Returns:
        positions (N, n) and velocities (N, n) at ``time``; inf from the sample on at which the motion is not finite.
    """
    plant, n = Plant(system, substeps), system.degrees_of_freedom
    start = plant.start(np.asarray(x0, dtype=float), np.asarray(v0, dtype=float))
    drives = drive_columns(system, np.asarray(time, dtype=float), np.asarray(inputs, dtype=float), substeps)
    states = start[None, :]
    if len(time) > 1:
        later = plant.sample.mapaccum("run", len(time) - 1, 1)(start, drives[:-1].T)[0]
        states = np.vstack([states, later.full().T])
    states = np.where(np.isfinite(states), states, np.inf)
    return states[:, :n], states[:, n : 2 * n]


def free_run_from_rest(system: System, time: Array, inputs: Array, substeps: int) -> Array:
    """Positions (N, n) of the diagnosis' free run from rest at zero under commands (N, m), held from t_k to t_(k+1)."""
    n = system.degrees_of_freedom
    still = np.zeros((len(time), n))
    commands, start = np.asarray(inputs, dtype=float), np.zeros(1, dtype=np.int32)
    record = Record(still, still, still, commands, time[1] - time[0], np.ones(n), start, len(time))
    runner = runner_of(Trial(system, (), ()), record, substeps)
    return np.asarray(runner.run(np.zeros(0), record.at_rest)[0])


def drive_columns(system: System, time: Array, inputs: Array, substeps: int) -> Array:
    """One row per sample: (t from the start, h, w of substep 1, …, w of the last substep).

    Args:
        system: for its ``actuators``.
        time: (N,) seconds, evenly spaced.
        inputs: (N, m) commands in SI, held from t_k to t_(k+1).
        substeps: steps in one sample.

    Returns:
        (N, 2 + m substeps).

    Raises:
        ValueError: if the shapes do not fit or time does not increase evenly.
    """
    m = len(system.inputs)
    if inputs.shape != (len(time), m):
        raise ValueError(f"inputs of shape {inputs.shape}; expected {(len(time), m)}")
    period = (time[-1] - time[0]) / (len(time) - 1) if len(time) > 1 else 1.0
    if not period > 0 or np.any(np.abs(np.diff(time) - period) > UNEVEN * period):
        raise ValueError("time does not increase evenly")
    effective = Chains(system, ()).act(inputs, np.zeros(0), period, substeps).reshape(len(time), -1)
    return np.hstack([(time - time[0])[:, None], np.full((len(time), 1), period / substeps), effective])
