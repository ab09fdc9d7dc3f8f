"""What may describe the axis, and its fit to free runs of a chosen length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from benchmarks.emps.records import FREE_SAMPLES, Measured
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.shooting import Shooter
from codegen.diagnosis.fit.trial import Runner, Trial, part_of, with_effects, with_values
from codegen.diagnosis.results import FoundEffect
from codegen.effects import CATALOGUE
from codegen.mechanics import System

Array = NDArray[np.float64]
Stretches = Sequence[tuple[int, int]]

MOVED = ("rail_a", "M", "Fv", "offset")
STARTS: dict[str, dict[str, float]] = {
    "viscous_asymmetry": {"d_b": -35.0},
    "presliding": {"sigma": 1e6},
    "stribeck": {"delta": 3.0, "v_s": 0.02},
    "quadratic_drag": {"c": 1.0},
    "hardening_spring": {"k3": 1.0},
    "position_dependent_friction": {"amplitude": 0.5, "period": 0.25, "phase": 0.0},
}
BY_DIRECTION = ("viscous_asymmetry",)
STRUCTURES: tuple[tuple[str, ...], ...] = (
    (),
    BY_DIRECTION,
    (*BY_DIRECTION, "stribeck"),
    (*BY_DIRECTION, "presliding"),
    (*BY_DIRECTION, "presliding", "quadratic_drag"),
    (*BY_DIRECTION, "presliding", "hardening_spring"),
    (*BY_DIRECTION, "presliding", "position_dependent_friction"),
)
FIT_STEPS, RUN_STEPS = 2, 4
"""Steps of the simulation in one sample: of a fit, and of a free run that is scored."""
LOST_MM = 1e3
"""Error that a run has which diverges."""


@dataclass(frozen=True, eq=False)
class Model:
    """Level, mass, viscous coefficient, offset, and effects.

    Attributes:
        system: as declared. kinds: of the effects.
    """

    system: System
    kinds: tuple[str, ...]

    @cached_property
    def trial(self) -> Trial:
        by_name = {s.name: s for s in self.system.values}
        trial = Trial(self.system, (), tuple(by_name[n] for n in MOVED))
        for kind in self.kinds:
            trial = trial.with_part(part_of(CATALOGUE[kind], 0, self.system))
        return trial

    @cached_property
    def shooter(self) -> Shooter:
        return Shooter([self.trial.changed], [self.trial.free])

    @property
    def start(self) -> Array:
        """Published values, and a guess for each effect."""
        trial = self.trial
        return trial.theta(
            np.array([float(self.system.values[s]) for s in trial.refitted_symbols]), [STARTS[k] for k in self.kinds]
        )

    def fitted(self, theta: Array, data: Measured, stretches: Stretches, seconds: float | None) -> Array:
        """Least squares of the position error over runs of this length through these stretches."""
        return self.fitted_to([(data, stretches)], theta, seconds)

    def fitted_to(self, parts: Sequence[tuple[Measured, Stretches]], theta: Array, seconds: float | None) -> Array:
        """The same over stretches of several records."""
        records = [data.runs(a, b, seconds) for data, stretches in parts for a, b in stretches]
        runners = [Runner(self.trial, self.shooter, 0, record, FIT_STEPS) for record in records]
        scale = np.maximum(np.abs(theta), 1e-3)

        def residual(z: Array) -> Array:
            errors = [1e3 * (r.run(z * scale, r.record.at_rest) - r.record.targets)[:, ::2, 0] for r in runners]
            return np.concatenate([finite(e).ravel() for e in errors])

        return np.asarray(least_squares(residual, theta / scale, diff_step=1e-5, max_nfev=60).x * scale)

    def predicted(self, theta: Array, record: Record) -> Array:
        """Positions (L,) in m of one free run."""
        return np.asarray(Runner(self.trial, self.shooter, 0, record, RUN_STEPS).run(theta, record.at_rest)[0, :, 0])

    def built(self, theta: Array) -> System:
        """The system with a fit's values."""
        refitted_values, found = self.trial.split(theta)
        effects = [FoundEffect(p.kind, p.on, v, {}) for p, v in zip(self.trial.parts, found, strict=True)]
        return with_effects(with_values(self.system, _by_name(self.trial, refitted_values)), effects)

    def flat(self, theta: Array) -> dict[str, float]:
        """Every value of a fit by name."""
        refitted_values, found = self.trial.split(theta)
        return _by_name(self.trial, refitted_values) | {
            name: float(v) for values in found for name, v in values.items()
        }

    @property
    def words(self) -> str:
        """The name of the structure in tables."""
        return " + ".join(kind.replace("_", " ") for kind in self.kinds) or "symmetric"


def _by_name(trial: Trial, refitted_values: Array) -> dict[str, float]:
    return {s.name: float(v) for s, v in zip(trial.refitted_symbols, refitted_values, strict=True)}


def finite(millimetres: Array) -> Array:
    """The errors, with a large number in place of those of a run that diverges."""
    return np.asarray(np.nan_to_num(millimetres, nan=LOST_MM, posinf=LOST_MM, neginf=-LOST_MM))


def score(predicted: Array, measured: Array) -> float:
    """RMSE in mm behind the samples that are free."""
    error = finite(1e3 * (predicted - measured))[FREE_SAMPLES:]
    return float(np.sqrt(np.mean(error**2)))
