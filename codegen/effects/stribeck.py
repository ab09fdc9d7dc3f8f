"""The Stribeck effect: friction rises towards standstill."""

from __future__ import annotations

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.start import speeds
from codegen.mechanics.system import System


class Stribeck(Effect):
    """level += delta exp(−(u/v_s)²)."""

    kind = "stribeck"
    sits_on = "contact"
    equation = "level += delta·exp(−(u/v_s)²)"
    signature = "extra friction at low slip speed that is gone above the Stribeck velocity"
    seen_over = "velocity"
    parameters = (
        EffectParameter("delta", "{F}", "rise of the level at standstill", low=0.0, neutral=0.0),
        EffectParameter("v_s", "{q}/s", "Stribeck velocity", low=0.0, start=speeds),
    )
    confused_with = (
        Confusion("friction_drift", "speeds in random order: a rising ladder of speeds goes along with time"),
        Confusion("presliding", "a microscopic slow sine"),
        Confusion("quantisation", "a finer encoder, or slow motion in one direction"),
        Confusion("quadratic_drag", "slow motion, where a wide Stribeck curve still falls"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        return system.with_level(place, p["delta"] * sympy.exp(-((slip / p["v_s"]) ** 2)))
