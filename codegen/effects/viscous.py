"""Viscous friction in a contact."""

from __future__ import annotations

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class Viscous(Effect):
    """λ += b u."""

    kind = "viscous"
    sits_on = "contact"
    equation = "λ += b·u"
    signature = "a force that grows in proportion to slip velocity and changes sign with it"
    parameters = (EffectParameter("b", "{F}*s/{q}", "viscous coefficient", neutral=0.0),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["b"] * system.contacts[place].slip)
