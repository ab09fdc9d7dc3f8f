"""An actuator whose gain differs from the declared one."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives, sole_drive
from codegen.effects.start import gains
from codegen.mechanics.system import System


class InputGain(Effect):
    """w_eff = gain·w."""

    kind = "input_gain"
    sits_on = "input"
    equation = "w_eff = gain·w"
    signature = "a force proportional to the input"
    seen_over = "input"
    parameters = (EffectParameter("gain", "1", "gain", low=0.0, neutral=1.0, start=gains),)
    confused_with = (
        Confusion("inertia_error", "another force on the axis: a known load or spring"),
        Confusion("load_dependent_friction", "several loads, driving and back-driving"),
    )
    needs = "an input that acts on the machine"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, "gain", p["gain"])

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("inertia_error", x.name) for i, x in enumerate(system.positions) if sole_drive(system, i) == place]

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place)
