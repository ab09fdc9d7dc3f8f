"""Detection of inputs that are measurements at the rows of a log, not commands that are held until the next row.

Between two rows, a measured input is about the mean of both values. This leads a held command by half a sample, which
the force residual shows.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import LEAST_ROWS
from codegen.diagnosis.fit.credit import LEAST_SIZE
from codegen.diagnosis.fit.linear import correlation, independent
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.logs import Finding, Log

NEAR = 0.5, 1.5
"""Range of the estimated lead, in half samples, in which an input is treated as measured."""
ONE_WAY = 0.98
"""Least |low-passed sign of the speed| of a used sample, since sticking at a reversal looks like a delay."""
SURE = 3.5
"""Least lead in standard deviations."""


def acting_between_rows(log: Log, inputs: Collection[int]) -> Log:
    """The log with the mean of successive rows in place of the held value, for these inputs."""
    chosen = [k for k in range(log.inputs.shape[1]) if k in inputs]
    values = log.inputs.copy()
    values[:-1, chosen] = 0.5 * (log.inputs[:-1, chosen] + log.inputs[1:, chosen])
    return replace(log, inputs=values)


def measured_inputs(problem: Problem, log: Log) -> dict[int, Finding]:
    """Index → finding, for the inputs that lead a held command by half a sample.

    So do commands in a log that keeps one of several rows of a faster loop. The force residual is regressed on the
    change by that lead, with acceleration, speed, its sign and a constant for errors of declared parameters.
    """
    system, motion = problem.system, problem.motion
    if system.actuators or log.description.measured_inputs or log.description.input_hold:
        return {}
    residual, found = inverse_dynamics_residual(system, motion), {}
    for k, w in enumerate(system.inputs):
        values = motion.inputs.copy()
        values[1:-1, k] += (motion.commands[2:, k] - motion.commands[:-2, k]) / 4
        change = inverse_dynamics_residual(system, replace(motion, inputs=values)) - residual
        leads = [_lead(problem, i, residual[:, i], change[:, i]) for i in range(residual.shape[1])]
        lead, deviation = max(leads, key=lambda one: one[0] / one[1])
        if not (NEAR[0] <= lead <= NEAR[1] and lead > SURE * deviation) or _share(problem, change) < LEAST_SIZE:
            continue
        words = (
            f"{w} acts {1e3 * lead * motion.sample_time / 2:.2g} ms earlier than a command that is held from row to "
            f"row, about half a row ({1e3 * motion.sample_time / 2:.2g} ms). So it is treated as a measurement: the "
            "mean of successive rows is used. If it is a held command, set `input_hold: zero-order` in the log "
            "description."
        )
        found[k] = Finding("warning", f"timing of {w}", words, {"lead": lead, "deviation": deviation})
    return found


def _share(problem: Problem, change: Array) -> float:
    """RMS of a change of the force over that of the drive force, the largest over the coordinates."""
    motion, system = problem.motion, problem.system
    rest = replace(motion, inputs=0 * motion.inputs)
    drive = inverse_dynamics_residual(system, motion) - inverse_dynamics_residual(system, rest)
    power = [(forces**2 * problem.used).sum(axis=0) for forces in (change, drive)]
    return float(np.sqrt(np.max(power[0][power[1] > 0] / power[1][power[1] > 0], initial=0.0)))


def _lead(problem: Problem, i: int, residual: Array, change: Array) -> tuple[float, float]:
    """(lead in half samples, standard deviation) from the force residual of one coordinate, both (N,)."""
    motion = problem.motion
    used = problem.used[:, i] & (np.abs(motion.low_pass(np.sign(motion.velocities[:, i]))) > ONE_WAY)
    if used.sum() < LEAST_ROWS or not np.any(change[used]):
        return 0.0, 1.0
    v = motion.velocities[:, i]
    others = np.column_stack([motion.accelerations[:, i], v, np.sign(v), np.ones(len(v))])
    columns = np.column_stack([-change, motion.low_pass(others)])[used]
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    columns = columns / scale
    weights = np.linalg.lstsq(columns, residual[used], rcond=1e-10)[0]
    left = residual[used] - columns @ weights
    rate = min(2 * motion.cutoff_hz * motion.sample_time, 1.0)
    count = max(1.0, independent(correlation(left[:: max(1, round(1 / rate))])) * rate * len(left))
    spread = np.linalg.pinv(columns.T @ columns)[0, 0] * float(left @ left) / count
    return float(weights[0] / scale[0]), float(max(np.sqrt(spread) / scale[0], 1e-300))
