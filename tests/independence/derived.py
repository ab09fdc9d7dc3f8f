"""The first derivation as numbers: Ψ and A of ``derive_error_dynamics`` at a point, and points to look at."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.operating_points import evaluate, operating_points
from codegen.observers import Observer
from codegen.spec import Spec

from .true_plant import Point, TruePlant
from .variants import TRUE_LEVELS


class Derived:
    """Ψ and A from SymPy, evaluated where a Point says."""

    def __init__(self, spec: Spec, dynamics: ErrorDynamics) -> None:
        self.dynamics, self.points = dynamics, operating_points(dynamics, spec)

    def matrices(self, p: Point, plant: TruePlant, h: float) -> tuple[Any, Any]:
        observer, system = self.dynamics.observer, self.dynamics.observer.system
        now, _, following = plant.slips(p, h)
        truths = [e.truth for e in observer.errors if e.truth not in system.velocities]
        values = dict(zip((*system.positions, *system.velocities, *system.inputs), (*p.x, *p.v, *p.w), strict=True))
        values |= dict(zip(truths, p.truth, strict=True)) | dict(zip(observer.signs, np.sign(now), strict=True))
        later = dict(zip(system.velocities, following, strict=True))
        values |= {name: later[v] for name, v in self.dynamics.next_velocity.items()}
        row = np.array([[values[s] for s in self.points.variables]], dtype=float).reshape(1, -1)
        at = replace(self.points, values=row)
        psi = evaluate(self.dynamics, self.dynamics.jacobian, at, h)[0]
        return psi, evaluate(self.dynamics, self.dynamics.sampled, at, h)[0]


def random_point(spec: Spec, observer: Observer, generator: np.random.Generator, slow: float = 1.0) -> Point:
    """A point of the envelope, with true levels and states where laws keep them; ``slow`` scales the velocities."""
    system = observer.system

    def within(name: str, unit: str) -> float:
        low, high = spec.envelope.get(name, (-np.pi, np.pi) if unit == "rad" else (-1, 1))
        return float(generator.uniform(float(low), float(high)))

    x = [within(s.name, unit) for s, unit in zip(system.positions, system.position_units, strict=True)]
    v = [slow * within(s.name, "") for s in system.velocities]
    w = generator.uniform(-5, 5, len(system.inputs))
    truth = []
    for error in observer.errors:
        if error.truth in system.velocities:
            continue
        if error.truth in observer.truth_ranges:
            low, high = observer.truth_ranges[error.truth]
            truth.append(float(generator.uniform(float(low), float(high))))
        elif observer.kind in ("to", "gto", "mgto"):
            truth.append(float(generator.normal() * 3))
        else:
            truth.append(float(generator.uniform(*TRUE_LEVELS)))
    return Point(np.array(x), np.array(v), w, np.array(truth))
