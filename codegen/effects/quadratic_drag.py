"""Drag that grows with the square of velocity."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude


class QuadraticDrag(Effect):
    """e = −c v |v|."""

    kind = "quadratic_drag"
    sits_on = "coordinate"
    equation = "e = −c·v·|v|"
    signature = "a braking force that grows with the square of velocity"
    seen_over = "velocity"
    parameters = (EffectParameter("c", "{F}*s^2/{q}^2", "drag coefficient", neutral=0.0),)
    confused_with = (
        Confusion("viscous", "a speed ladder over two decades"),
        Confusion("stribeck", "slow motion, where a wide Stribeck curve still falls"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        v = system.velocities[place]
        return system.with_force(place, -p["c"] * v * Magnitude(v))
