"""What a simulated loop yields, and its log file."""

from __future__ import annotations

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.base.files import write_atomically
from codegen.spec.column_unit import factor_in_name
from codegen.spec.model import Spec

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoopRun:
    """A simulated log, the estimates of the observer beside it, and the truth behind both; SI, one row per sample.

    Attributes:
        time: (N,) seconds from 0.
        positions: (N, n) as the encoders see them: with noise, in steps.
        velocities: (N, n) as tachometers see them: with noise.
        inputs: (N, m) commands sent, held from t_k to t_(k+1); cancelling: (N, m) the part ū of them, before the limit.
        true_positions, true_velocities: (N, n).
        contact_forces: (N, contacts), λ just after t_k; positive opposes u > 0. friction: (N, n), U λ.
        outputs: names of the observer's outputs; none without an observer.
        estimates: (N, outputs) of the sample, or of the observer's last one before it.
        faults: (N,) 1 where the observer held its estimates.
    """

    time: Array
    positions: Array
    velocities: Array
    inputs: Array
    cancelling: Array
    true_positions: Array
    true_velocities: Array
    contact_forces: Array
    friction: Array
    outputs: tuple[str, ...]
    estimates: Array
    faults: NDArray[np.intc]

    @property
    def friction_estimate(self) -> Array:
        """(N, n) the observer's friction force on each coordinate."""
        return self.estimates[:, [k for k, name in enumerate(self.outputs) if name.startswith("F_hat_on_")]]


def write_log(path: Path, spec: Spec, run: LoopRun) -> None:
    """Write t, coordinates, inputs and estimates as CSV, whole or not at all: the same run gives the same bytes.

    Measured velocities are written where the spec's observer takes them or its simulation gives them a noise. Columns
    are called and scaled as the spec's ``log:`` section says, and in the unit that such a name states, so that the spec
    reads its own log back.

    Raises:
        BadInput: if the folder cannot be written to.
    """
    names, columns = ["t", *spec.positions], [run.time[:, None], run.positions]
    if velocity_is_measured(spec):
        names, columns = [*names, *spec.velocities], [*columns, run.velocities]
    names += [i.name for i in spec.inputs] + list(run.outputs)
    scale = np.array([_factor(spec, name) for name in names])
    rows = np.hstack([*columns, run.inputs, run.estimates]) / scale + 0.0
    text = StringIO()
    text.write(",".join(spec.log.columns.get(name, name) for name in names) + "\n")
    np.savetxt(text, rows, fmt="%.9g", delimiter=",")
    write_atomically(path, text.getvalue())


def _factor(spec: Spec, name: str) -> float:
    """From the column of a quantity to SI."""
    if name in spec.log.scale:
        return spec.log.scale[name]
    called = spec.log.columns.get(name)
    return 1.0 if called is None else factor_in_name(name, called, spec)


def velocity_is_measured(spec: Spec) -> bool:
    """Whether a simulated log has measured velocities."""
    simulation = spec.simulation
    if simulation is None:
        return False
    taken = simulation.observer and spec.observer is not None and spec.observer.velocity == "measured"
    return bool(simulation.velocity_noise) or taken
