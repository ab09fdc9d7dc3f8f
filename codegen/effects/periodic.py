"""What the effects of wave form share: size and phase are found together, as a sine and a cosine."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from math import atan2, cos, hypot, sin
from typing import ClassVar

import sympy

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.effects.start import periods
from codegen.mechanics.system import Matrix, System

AMPLITUDE = EffectParameter("amplitude", "{F}", "amplitude", neutral=0.0)
PERIOD = EffectParameter("period", "{q}", "distance of one period", low=0.0, start=periods)
PHASE = EffectParameter("phase", "rad", "phase at zero")


class Periodic(Effect):
    """An effect that is size·sin(angle + phase), where the angle follows a position."""

    size: ClassVar[str] = "amplitude"

    @abstractmethod
    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        """The angle without its phase, rad."""

    @abstractmethod
    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        """The system with a wave of this kind."""

    def add(self, system: System, place: int, p: Symbols) -> System:
        return self.act(system, place, p[self.size] * sympy.sin(self.angle(system, place, p) + p["phase"]))

    def regressors(self, system: System, place: int, p: Symbols) -> tuple[list[Matrix], tuple[str, ...]]:
        """Sine and cosine of the angle, so that size and phase are both found by least squares."""
        angle = self.angle(system, place, p)
        columns = [self.column(system, place, wave) for wave in (sympy.sin(angle), sympy.cos(angle))]
        return columns, tuple(q.name for q in self.parameters if q.name == "period")

    def column(self, system: System, place: int, wave: sympy.Expr) -> Matrix:
        """What a wave adds to g − M a − U λ."""
        return Matrix(self.act(system, place, wave).equation_error - system.equation_error)

    def recover(self, weights: Sequence[float], shape: Mapping[str, float]) -> dict[str, float]:
        sine, cosine = weights
        found = {self.size: hypot(sine, cosine), "phase": atan2(cosine, sine)}
        found |= {name: float(value) for name, value in shape.items()}
        return {q.name: found[q.name] for q in self.parameters}

    def weights(self, values: Mapping[str, float]) -> list[float]:
        return [values[self.size] * cos(values["phase"]), values[self.size] * sin(values["phase"])]
