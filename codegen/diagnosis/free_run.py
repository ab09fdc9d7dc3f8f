"""Free-run prediction of a log, restarted every so often from the measured state: how well a model explains it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.shooting import Record, Shooter
from codegen.diagnosis.trial import Runner, Trial
from codegen.mechanics.system import System

Array = NDArray[np.float64]


def free_run(
    system: System,
    sample_time: float,
    positions: Array,
    velocities: Array,
    commands: Array,
    restart_s: float = 0.5,
    substeps: int = 10,
    trim_s: float = 0.0,
) -> Array:
    """Predicted positions, restarted from the measured state every ``restart_s`` seconds.

    Pass the whole log and trim here, not before: a delayed input reaches back to commands before the first restart, and
    the states of friction laws and the loads behind springs, which no log has, are run along the measured motion from
    the log's beginning. A law that cannot be run (see ``is_simulable``) is replaced by its level of steady sliding.
    Positions are readings of sensors with their declared errors.

    Args:
        system: with its effects.
        sample_time: s.
        positions, velocities: (N, n) measured state, filtered.
        commands: (N, m), held from t_k to t_(k+1).
        restart_s: seconds between restarts, at least two samples.
        substeps: steps in one sample.
        trim_s: seconds at each end that are not predicted, where filtered states are poor.

    Returns:
        (N, n); inf where the prediction is not finite; NaN in trimmed rows.

    Raises:
        BadInput: where there is no C compiler.
        ValueError: if the shapes do not fit or nothing is left after trimming.
    """
    count, n = positions.shape
    if velocities.shape != (count, n) or len(commands) != count or n != system.degrees_of_freedom:
        raise ValueError(f"positions {positions.shape}, velocities {velocities.shape}, {len(commands)} commands")
    cut = round(trim_s / sample_time)
    kept = count - 2 * cut
    if kept < 2:
        raise ValueError(f"{count} samples, {cut} of them trimmed at each end; expected 2 or more left")
    length = min(max(2, round(restart_s / sample_time)), kept)
    start = np.arange(cut, cut + kept, length, dtype=np.int32)
    # The last run goes on behind the log; what it predicts there is dropped.
    commands = np.vstack([commands, np.repeat(commands[-1:], length, axis=0)])
    record = Record(positions, positions, velocities, commands, sample_time, 0.0, np.ones(n), start, length)
    runner = Runner(Trial(system, (), ()), Shooter([system], [()]), 0, record, substeps)
    rows = runner.run(np.zeros(0), record.at_rest).reshape(-1, n)[:kept]
    predicted = np.full((count, n), np.nan)
    predicted[cut : cut + kept] = np.where(np.isfinite(rows), rows, np.inf)
    return predicted
