"""Where a simulated motion leaves the spec's envelope; its certificate holds only inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec

Array = NDArray[np.float64]
ROUNDING = 1e-9
"""Of the range: less is no excursion."""


@dataclass(frozen=True)
class Excursion:
    """A quantity of the envelope that leaves its range.

    Attributes:
        low, high: the range; value: furthest out, in ``unit``; time: of it, s.
        beyond: how far that is out, in ``unit``; share: of the samples that are out.
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
    """The envelope's positions, velocities, accelerations, position noises and inputs that leave it, the worst first.

    An acceleration is the mean over a sample; noise is what a sensor shows less what is true.
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
