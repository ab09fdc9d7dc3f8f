"""A linear spring to the frame."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class Spring(Effect):
    """e = −k x."""

    kind = "spring"
    sits_on = "coordinate"
    equation = "e = −k·x"
    signature = "a force proportional to position, the same in both directions"
    seen_over = "position"
    parameters = (EffectParameter("k", "{F}/{q}", "stiffness", neutral=0.0),)
    confused_with = (
        Confusion("hardening_spring", "a range on both sides of zero, twice as wide"),
        Confusion("gravity_imbalance", "a wider range: a spring goes on rising"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["k"] * system.positions[place])
