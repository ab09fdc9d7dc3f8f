"""What the effects of wave form share: size and phase are found together, as a sine and a cosine."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import sympy

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.effects.start import periods
from codegen.mechanics.system import Matrix, System

PHASE_NAME = "phase"
AMPLITUDE = EffectParameter("amplitude", "{F}", "amplitude", neutral=0.0)
PERIOD = EffectParameter("period", "{q}", "distance of one period", low=0.0, start=periods)
PHASE = EffectParameter(PHASE_NAME, "rad", "phase at zero")


class Periodic(Effect):
    """An effect that is size·sin(angle + phase), where the angle follows a position."""

    size: ClassVar[str] = "amplitude"

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """Without the phase: it is found together with the size."""
        return tuple(q for q in super().shapes if q.name != PHASE_NAME)

    @abstractmethod
    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        """The angle without its phase, rad."""

    @abstractmethod
    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        """The system with a wave of this kind."""

    def add(self, system: System, place: int, p: Symbols) -> System:
        return self.act(system, place, p[self.size] * sympy.sin(self.angle(system, place, p) + p["phase"]))

    def column(self, system: System, place: int, wave: sympy.Expr) -> Matrix:
        """What a wave adds to g − M a − U λ."""
        return Matrix(self.act(system, place, wave).equation_error - system.equation_error)
