"""Viscous friction that differs by direction; not among the standard effects, needed on real drives (EMPS)."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude


class ViscousAsymmetry(Effect):
    """λ += d_b |u|: the viscous coefficient is b + d_b for u > 0 and b − d_b for u < 0."""

    kind = "viscous_asymmetry"
    sits_on = "contact"
    equation = "λ += d_b·|u|"
    signature = "a force that grows with slip speed and keeps its sign when the motion turns"
    seen_over = "velocity"
    both_ways = True
    parameters = (EffectParameter("d_b", "{F}*s/{q}", "half the difference of the viscous coefficients", neutral=0.0),)
    confused_with = (
        Confusion("viscous", "both directions at the same speeds"),
        Confusion("coulomb_asymmetry", "a speed ladder in both directions"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["d_b"] * Magnitude(system.contacts[place].slip))
