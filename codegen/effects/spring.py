"""A linear spring to the frame."""

from __future__ import annotations

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class Spring(Effect):
    """e = −k x."""

    kind = "spring"
    sits_on = "coordinate"
    equation = "e = −k·x"
    signature = "a force proportional to position, the same in both directions"
    parameters = (EffectParameter("k", "{F}/{q}", "stiffness", neutral=0.0),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["k"] * system.positions[place])
