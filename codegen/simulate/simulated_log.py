"""What a simulation yields, and its log file."""

from __future__ import annotations

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.files import write_atomically
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
    """Write t, coordinates and inputs as CSV, whole or not at all: the same log gives the same bytes.

    Columns are called and scaled as the spec's ``log:`` section says, so that the spec reads its own log back.

    Raises:
        BadInput: if the folder cannot be written to.
    """
    names = ["t", *spec.positions, *(i.name for i in spec.inputs)]
    scale = np.array([spec.log.scale.get(name, 1.0) for name in names])
    rows = np.column_stack([simulated.time, simulated.positions, simulated.inputs]) / scale + 0.0
    text = StringIO()
    text.write(",".join(spec.log.columns.get(name, name) for name in names) + "\n")
    np.savetxt(text, rows, fmt="%.9g", delimiter=",")
    write_atomically(path, text.getvalue())
