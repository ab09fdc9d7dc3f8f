"""Base class of periodic effects: amplitude and phase are estimated together, as sine and cosine weights."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
import sympy

from codegen.effects import coordinate
from codegen.effects.effect import PROBE, Effect, EffectParameter, Symbols
from codegen.effects.start import Covered, periods
from codegen.mechanics.system import Matrix, System

PHASE_NAME = "phase"
AMPLITUDE = EffectParameter("amplitude", "{F}", "amplitude", neutral=0.0)
PERIOD = EffectParameter("period", "{q}", "distance of one period", low=0.0, start=periods, moved_in=coordinate.PERIOD)
PHASE = EffectParameter(PHASE_NAME, "rad", "phase at zero", moved_in=coordinate.ANGLE)


class Periodic(Effect):
    """An effect size·sin(angle + phase) whose angle is a function of position."""

    size: ClassVar[str] = "amplitude"

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """Without the phase, which is estimated with the size."""
        return tuple(q for q in super().shapes if q.name != PHASE_NAME)

    @property
    def waves(self) -> tuple[tuple[str, str], ...]:
        return ((self.size, PHASE_NAME),)

    def probes(self, shape: Mapping[str, float], covered: Covered) -> list[tuple[dict[str, float], float]]:
        """A small sine and a small cosine."""
        small = next(PROBE * covered.size(q.unit) for q in self.parameters if q.name == self.size)
        return [(dict(shape) | {self.size: small, PHASE_NAME: phase}, small) for phase in (0.0, np.pi / 2)]

    def weighted(self, shape: Mapping[str, float], weights: Sequence[float]) -> dict[str, float]:
        sine, cosine = weights
        return dict(shape) | {self.size: float(np.hypot(sine, cosine)), PHASE_NAME: float(np.arctan2(cosine, sine))}

    def normal_form(self, values: Mapping[str, float]) -> dict[str, float]:
        """With a positive size and the phase within half a turn."""
        half_turns = 2 if values[self.size] < 0 else 1
        phase = float((values[PHASE_NAME] + half_turns * np.pi) % (2 * np.pi) - np.pi)
        return dict(values) | {self.size: abs(values[self.size]), PHASE_NAME: phase}

    @abstractmethod
    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        """The angle without its phase, rad."""

    @abstractmethod
    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        """The system with a wave of this kind."""

    def add(self, system: System, place: int, p: Symbols) -> System:
        return self.act(system, place, p[self.size] * sympy.sin(self.angle(system, place, p) + p["phase"]))

    def column(self, system: System, place: int, wave: sympy.Expr) -> Matrix:
        """Change of g − M a − U λ by a wave."""
        return Matrix(self.act(system, place, wave).equation_error - system.equation_error)
