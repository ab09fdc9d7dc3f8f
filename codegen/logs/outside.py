"""How far a log's coordinates lie outside the spec's envelope: the clue to whose scale is off, theirs or an input's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codegen.logs.log import Array, Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

USUAL = 0.95
"""Quantile: single peaks say nothing of a scale."""


@dataclass(frozen=True)
class Outside:
    """A coordinate that the log has far outside the envelope.

    Attributes:
        coordinate: its name.
        what: its position or velocity, by name; value: how large that is, SI; unit: its unit.
        times: value over the envelope's bound.
    """

    coordinate: str
    what: str
    value: float
    unit: str
    times: float

    @property
    def words(self) -> str:
        """For a message."""
        return f"{self.what} reaches {self.value:.3g} {self.unit}, {self.times:.3g} times the spec's envelope"


def furthest_outside(log: Log, spec: Spec, motion: Motion, least: float) -> Outside | None:
    """The coordinate furthest outside its declared range, by a factor of at least ``least``; None where none is."""
    found = []
    for j, c in enumerate(spec.coordinates):
        signals = {c.name: (log.positions, c.unit), c.velocity: (motion.velocities, f"{c.unit}/s")}
        for name, (values, unit) in signals.items():
            if name in spec.envelope and motion.usable.any():
                size, bound = _usual(values[motion.usable, j]), max(abs(float(b)) for b in spec.envelope[name])
                if bound > 0 and size >= least * bound:
                    found.append(Outside(c.name, name, size, unit, size / bound))
    return max(found, key=lambda o: o.times, default=None)


def _usual(values: Array) -> float:
    return float(np.quantile(np.abs(values), USUAL))
