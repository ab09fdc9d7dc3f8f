"""An inertia that differs from the declared one."""

from __future__ import annotations

from collections.abc import Mapping

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import sole_drive
from codegen.mechanics.system import System


class InertiaError(Effect):
    """M_ii += delta."""

    kind = "inertia_error"
    sits_on = "coordinate"
    equation = "M_ii += delta"
    signature = "a force proportional to acceleration"
    seen_over = "acceleration"
    parameters = (EffectParameter("delta", "{F}*s^2/{q}", "added inertia", neutral=0.0),)
    confused_with = (
        Confusion("input_gain", "another force on the axis: a known load or spring"),
        Confusion("input_delay", "two frequencies"),
        Confusion("presliding", "two frequencies"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_inertia(place, p["delta"])

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        drive = sole_drive(system, place)
        return [] if drive is None else [("input_gain", system.inputs[drive].name)]

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """An inertia stays positive."""
        declared = system.mass_matrix[place, place].subs(system.values).subs(dict.fromkeys(system.positions, 0))
        return float(declared) + values["delta"] > 0
