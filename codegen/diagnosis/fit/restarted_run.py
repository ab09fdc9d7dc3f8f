"""Free-run simulation of a whole log, restarted at regular intervals from the measured state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.diagnosis.fit.record import KEPT, Record
from codegen.diagnosis.fit.trial import Runner, Trial, runner_of
from codegen.mechanics.system import System

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
