"""What a simulation yields, and its log file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.spec.model import Spec

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SimulatedLog:
    """A simulated log and the truth behind it; SI, one row per sample.

    Attributes:
        time: (N,) seconds from 0.
        positions: (N, n) as the encoders see them: with noise, in steps.
        inputs: (N, m) commands, held from t_k to t_(k+1).
        true_positions, true_velocities: (N, n).
        contact_forces: (N, contacts), λ just after t_k; positive opposes u > 0.
    """

    time: Array
    positions: Array
    inputs: Array
    true_positions: Array
    true_velocities: Array
    contact_forces: Array


def write_log(path: Path, spec: Spec, simulated: SimulatedLog) -> None:
    """Write t, coordinates and inputs as CSV: the same log gives the same bytes.

    The file appears whole or not at all: it is written beside ``path`` and moved there.

    Raises:
        OSError: if the folder cannot be written to.
    """
    header = ",".join(["t", *spec.positions, *(i.name for i in spec.inputs)])
    rows = np.column_stack([simulated.time, simulated.positions, simulated.inputs]) + 0.0
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.unfinished")
    try:
        with unfinished.open("w", encoding="utf-8", newline="\n") as file:
            file.write(header + "\n")
            np.savetxt(file, rows, fmt="%.9g", delimiter=",")
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
