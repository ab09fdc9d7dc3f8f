"""Viscous friction in a contact."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import pair_contacts, pairs
from codegen.mechanics.system import System


class Viscous(Effect):
    """λ += b u."""

    kind = "viscous"
    sits_on = "contact"
    equation = "λ += b·u"
    signature = "a force that grows in proportion to slip velocity and changes sign with it"
    seen_over = "velocity"
    parameters = (EffectParameter("b", "{F}*s/{q}", "viscous coefficient", neutral=0.0),)
    confused_with = (
        Confusion("quadratic_drag", "a speed ladder over two decades"),
        Confusion("back-EMF", "a speed ladder over two decades"),
        Confusion("actuator_lag", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("coupling", "one of the two coordinates held, the other moved"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["b"] * system.contacts[place].slip)

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        x = system.positions
        between = [pair for pair in pairs(system) if place in pair_contacts(system, *pair)]
        return [("coupling", f"{x[i]}, {x[j]}") for i, j in between]
