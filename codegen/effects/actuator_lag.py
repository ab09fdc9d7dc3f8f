"""An actuator that follows its command with a time constant."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import lags
from codegen.mechanics.system import System


class ActuatorLag(Effect):
    """tau w_eff' = w − w_eff, settled at the start."""

    kind = "actuator_lag"
    sits_on = "input"
    equation = "tau·dw_eff/dt = w − w_eff"
    signature = "a force proportional to the rate of the input, smaller at high frequencies than a delay's"
    seen_over = "input rate"
    parameters = (EffectParameter("tau", "s", "time constant", low=0.0, start=lags),)
    confused_with = (
        Confusion("input_delay", "a chirp to high frequencies"),
        Confusion("viscous", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("compliance", "a chirp to high frequencies"),
    )
    needs = "an input that acts on the machine and has no lag yet"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "lag", p["tau"])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place) and system.actuator(place).lag is None
