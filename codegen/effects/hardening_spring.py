"""A spring to the frame that grows stiffer with its deflection."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class HardeningSpring(Effect):
    """e = −k3 x³."""

    kind = "hardening_spring"
    sits_on = "coordinate"
    equation = "e = −k3·x³"
    signature = "a force that grows with the cube of position, the same in both directions"
    seen_over = "position"
    parameters = (EffectParameter("k3", "{F}/{q}^3", "cubic stiffness", neutral=0.0),)
    confused_with = (Confusion("spring", "a range on both sides of zero, twice as wide"),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["k3"] * system.positions[place] ** 3)
