"""Result of a closed-loop simulation: its log file, and excursions from the spec's envelope."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.files import write_atomically
from codegen.spec.column_units import factor_in_name
from codegen.spec.model import Spec


@dataclass(frozen=True)
class LoopRun:
    """Signals of a simulated loop, measured and true; SI, one row per sample.

    Attributes:
        time: (N,) seconds from 0.
        positions: (N, n) encoder readings, with noise and in steps.
        velocities: (N, n) tachometer readings, with noise.
        inputs: (N, m) commands sent, held from t_k to t_(k+1).
        cancelling: (N, m) the cancelling input ū in them, before the limit.
        true_positions, true_velocities: (N, n).
        contact_forces: (N, contacts) λ just after t_k; positive opposes u > 0.
        friction: (N, n) U λ.
        outputs: names of the observer's outputs; none without an observer.
        estimates: (N, outputs) of the observer's latest sample.
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
        """The observer's estimate of the friction force on each coordinate, (N, n)."""
        return self.estimates[:, [k for k, name in enumerate(self.outputs) if name.startswith("F_hat_on_")]]


def write_log(path: Path, spec: Spec, run: LoopRun) -> None:
    """Write t, coordinates, inputs and estimates as CSV, atomically; the same run gives the same bytes.

    Velocities are written if the spec's observer measures them or its simulation gives them a noise. Names, scales and
    units of the columns are those of the spec's ``log:`` section, so that the spec can read the log.

    Raises BadInput if the folder cannot be written to.
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
    """Factor from the column of a quantity to SI."""
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


ROUNDING = 1e-9
"""Share of a range that a quantity may exceed it by, for rounding."""


@dataclass(frozen=True)
class Excursion:
    """A quantity that leaves its range of the envelope.

    Attributes:
        low, high: the range, in ``unit``.
        value, time: the value farthest outside, in ``unit``, and its time, s.
        beyond: its distance from the range, in ``unit``.
        share: of the samples that are outside.
    """

    name: str
    unit: str
    low: float
    high: float
    value: float
    time: float
    beyond: float
    share: float


def excursions(spec: Spec, run: LoopRun) -> tuple[Excursion, ...]:
    """Positions, velocities, accelerations, position noises and inputs that leave the envelope, the worst first.

    An acceleration is the mean over a sample; noise is the reading of a sensor minus the true value.
    """
    found = []
    for name, (unit, values) in _quantities(spec, run).items():
        if name not in spec.envelope:
            continue
        low, high = (float(end) for end in spec.envelope[name])
        out = np.maximum(low - values, values - high)
        at = int(np.argmax(out))
        least = ROUNDING * max(abs(low), abs(high))
        if out[at] > least:
            share = float(np.mean(out > least))
            found.append(
                Excursion(name, unit, low, high, float(values[at]), float(run.time[at]), float(out[at]), share)
            )
    return tuple(sorted(found, key=lambda e: -e.beyond / max(abs(e.low), abs(e.high), ROUNDING)))


def _quantities(spec: Spec, run: LoopRun) -> dict[str, tuple[str, Array]]:
    """Name in the envelope → (unit, values over the run)."""
    period = float(np.diff(run.time[:2])[0]) if len(run.time) > 1 else 1.0
    found: dict[str, tuple[str, Array]] = {}
    for j, c in enumerate(spec.coordinates):
        true = run.true_positions[:, j]
        found[c.name] = (c.unit, true)
        found[c.velocity] = (f"{c.unit}/s", run.true_velocities[:, j])
        found[f"{c.name}_noise"] = (c.unit, run.positions[:, j] - true)
        if len(run.time) > 1:
            found[f"{c.velocity}_dot"] = (f"{c.unit}/s^2", np.diff(run.true_velocities[:, j]) / period)
    return found | {w.name: (w.unit, run.inputs[:, j]) for j, w in enumerate(spec.inputs)}
