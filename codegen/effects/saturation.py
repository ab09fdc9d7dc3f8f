"""An actuator that gives no more than its limit."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import limits
from codegen.mechanics.system import System


class Saturation(Effect):
    """w_eff = clip(w, −limit, limit)."""

    kind = "saturation"
    sits_on = "input"
    equation = "w_eff = clip(w, −limit, limit)"
    signature = "a force that is missing at large commands and at no others"
    seen_over = "input"
    parameters = (EffectParameter("limit", "{w}", "greatest effective input", low=0.0, start=limits),)
    confused_with = (
        Confusion("input_gain", "a small and a large amplitude of one motion"),
        Confusion("quadratic_drag", "a large command at low speed"),
    )
    needs = "an input that acts on the machine"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "saturation", p["limit"])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
