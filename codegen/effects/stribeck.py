"""The Stribeck effect: friction rises towards standstill."""

from __future__ import annotations

import sympy

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class Stribeck(Effect):
    """level += delta exp(−(u/v_s)²)."""

    kind = "stribeck"
    sits_on = "contact"
    equation = "level += delta·exp(−(u/v_s)²)"
    signature = "extra friction at low slip speed that is gone above the Stribeck velocity"
    parameters = (
        EffectParameter("delta", "{F}", "rise of the level at standstill", low=0.0, neutral=0.0),
        EffectParameter("v_s", "{q}/s", "Stribeck velocity", low=0.0),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        return system.with_level(place, p["delta"] * sympy.exp(-((slip / p["v_s"]) ** 2)))
