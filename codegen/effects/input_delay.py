"""A dead time between command and force."""

from __future__ import annotations

from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.mechanics.system import System


class InputDelay(Effect):
    """w_eff(t) = w(t − T)."""

    kind = "input_delay"
    sits_on = "input"
    equation = "w_eff(t) = w(t − T)"
    signature = "a force proportional to the rate of the input"
    parameters = (EffectParameter("T", "s", "dead time", low=0.0),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_delay(place, p["T"])

    def applies(self, system: System, place: int) -> bool:
        return bool(system.force.has(system.inputs[place]))
