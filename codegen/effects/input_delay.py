"""A dead time between command and force."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import delays
from codegen.mechanics.system import System


class InputDelay(Effect):
    """w_eff(t) = w(t − T)."""

    kind = "input_delay"
    sits_on = "input"
    equation = "w_eff(t) = w(t − T)"
    signature = "a force proportional to the rate of the input"
    seen_over = "input rate"
    parameters = (EffectParameter("T", "s", "dead time", low=0.0, start=delays),)
    confused_with = (
        Confusion("actuator_lag", "a chirp to high frequencies"),
        Confusion("viscous", "a chirp"),
        Confusion("compliance", "a chirp to high frequencies"),
    )
    needs = "an input that acts on the machine"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "delay", p["T"])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
