"""What drives a plant over a log: time, step length and the effective input of every substep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from codegen.mechanics.system import System

Array = NDArray[np.float64]


def drive_columns(system: System, time: Array, inputs: Array, substeps: int) -> Array:
    """One row per sample: (t from the start, h, w of substep 1, …, w of the last substep).

    Commands are held from t_k to t_(k+1) and reach the plant after the input's delay; a substep in which a delayed
    command changes gets the exact mean. Before the log the first command is taken to have been held.

    Args:
        system: for its ``input_delay``, seconds.
        time: (N,) seconds, increasing.
        inputs: (N, m) commands in SI.
        substeps: steps in one sample.

    Returns:
        (N, 2 + m substeps); the last row is as long as the one before it.

    Raises:
        ValueError: if the shapes do not fit or time does not increase.
    """
    m = len(system.inputs)
    if inputs.shape != (len(time), m):
        raise ValueError(f"inputs of shape {inputs.shape}; expected {(len(time), m)}")
    lengths = np.diff(time, append=2 * time[-1] - time[-2]) if len(time) > 1 else np.ones(1)
    if not np.all(lengths > 0):
        raise ValueError("time does not increase everywhere")
    steps = lengths / substeps
    effective = np.repeat(inputs[:, None, :], substeps, axis=1)
    starts = (time[:, None] + steps[:, None] * np.arange(substeps)).ravel()
    for index, w in enumerate(system.inputs):
        delay = float(system.values[system.input_delay[w]]) if w in system.input_delay else 0.0
        if delay != 0:
            late = starts - delay
            mean = _integral(time, inputs[:, index], late + np.repeat(steps, substeps)) - _integral(
                time, inputs[:, index], late
            )
            effective[:, :, index] = mean.reshape(-1, substeps) / steps[:, None]
    return np.hstack([(time - time[0])[:, None], steps[:, None], effective.reshape(len(time), -1)])


def _integral(time: Array, values: Array, at: Array) -> Array:
    """∫ of the held values from time[0] to ``at``, exact; the first value before and the last one after the log."""
    area = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(time))])
    outside = values[0] * np.minimum(at - time[0], 0) + values[-1] * np.maximum(at - time[-1], 0)
    return np.asarray(np.interp(at, time, area) + outside, dtype=float)
