"""A force that repeats along the axis: motor cogging, a pulley's or a screw's once-per-turn force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, cos, hypot, sin

import sympy

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import Matrix, System


class Cogging(Effect):
    """e = amplitude sin(2π x/period + phase)."""

    kind = "cogging"
    sits_on = "coordinate"
    equation = "e = amplitude·sin(2π x/period + phase)"
    signature = "a force periodic in position, the same in both directions"
    parameters = (
        EffectParameter("amplitude", "{F}", "amplitude", neutral=0.0),
        EffectParameter("period", "{q}", "distance of one period", low=0.0),
        EffectParameter("phase", "rad", "phase at x = 0"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        angle = 2 * sympy.pi * system.positions[place] / p["period"] + p["phase"]
        return system.with_force(place, p["amplitude"] * sympy.sin(angle))

    def regressors(self, system: System, place: int, p: Symbols) -> tuple[list[Matrix], tuple[str, ...]]:
        """Sine and cosine of the position, so that amplitude and phase are both found by least squares."""
        angle = 2 * sympy.pi * system.positions[place] / p["period"]
        columns = []
        for wave in (sympy.sin(angle), sympy.cos(angle)):
            column = sympy.zeros(system.degrees_of_freedom, 1)
            column[place] = wave
            columns.append(Matrix(column))
        return columns, ("period",)

    def recover(self, weights: Sequence[float], shape: Mapping[str, float]) -> dict[str, float]:
        sine, cosine = weights
        return {"amplitude": hypot(sine, cosine), "period": float(shape["period"]), "phase": atan2(cosine, sine)}

    def weights(self, values: Mapping[str, float]) -> list[float]:
        return [values["amplitude"] * cos(values["phase"]), values["amplitude"] * sin(values["phase"])]
