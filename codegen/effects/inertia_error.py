"""An inertia that differs from the declared one."""

from __future__ import annotations

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class InertiaError(Effect):
    """M_ii += delta."""

    kind = "inertia_error"
    sits_on = "coordinate"
    equation = "M_ii += delta"
    signature = "a force proportional to acceleration"
    parameters = (EffectParameter("delta", "{F}*s^2/{q}", "added inertia", neutral=0.0),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_inertia(place, p["delta"])
