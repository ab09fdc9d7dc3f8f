"""Viscous friction between two coordinates that no declared contact joins."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import pair_contacts, pairs
from codegen.mechanics.system import System


class Coupling(Effect):
    """e₁ = −c (v₁ − v₂), e₂ = +c (v₁ − v₂)."""

    kind = "coupling"
    sits_on = "two coordinates"
    equation = "e₁ = −c·(v₁ − v₂), e₂ = +c·(v₁ − v₂)"
    signature = "a force that grows with the difference of two velocities, equal and opposite on the two coordinates"
    seen_over = "velocity"
    parameters = (EffectParameter("c", "{F}*s/{q}", "viscous coefficient", neutral=0.0),)
    confused_with = (Confusion("viscous", "the two coordinates moved apart from each other: one held, one moved"),)
    needs = "two coordinates of one unit"

    def applies(self, system: System, place: int) -> bool:
        first, second = pairs(system)[place]
        return system.position_units[first] == system.position_units[second]

    def add(self, system: System, place: int, p: Symbols) -> System:
        first, second = pairs(system)[place]
        force = p["c"] * (system.velocities[first] - system.velocities[second])
        return system.with_force(first, -force).with_force(second, force)

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("viscous", system.contacts[c].name) for c in pair_contacts(system, *pairs(system)[place])]
