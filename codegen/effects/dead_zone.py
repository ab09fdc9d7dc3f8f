"""An actuator that does not answer to small commands."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import dead_widths
from codegen.mechanics.system import System


class DeadZone(Effect):
    """w_eff = sgn(w) max(|w| − width, 0)."""

    kind = "dead_zone"
    sits_on = "input"
    equation = "w_eff = sgn(w)·max(|w| − width, 0)"
    signature = "a force that is missing: all of it at small commands, a constant share at large ones"
    seen_over = "input"
    parameters = (EffectParameter("width", "{w}", "half width of the dead zone", low=0.0, start=dead_widths),)
    confused_with = (
        Confusion("input_gain", "two amplitudes of one motion"),
        Confusion("coulomb friction", "a force in one direction that is not reversed while the motion is"),
    )
    needs = "an input that acts on the machine"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "dead_zone", p["width"])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
