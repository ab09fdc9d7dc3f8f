"""Friction that settles while the machine warms up."""

from __future__ import annotations

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.start import slow_times
from codegen.mechanics.system import TIME, System


class FrictionDrift(Effect):
    """level += delta exp(−t/T), t from the start of the log; in an observer from its first sample."""

    kind = "friction_drift"
    sits_on = "contact"
    equation = "level += delta·exp(−t/T)"
    signature = "friction that changes slowly in time, whatever the motion"
    seen_over = "time"
    parameters = (
        EffectParameter("delta", "{F}", "change of the level at the start", neutral=0.0),
        EffectParameter("T", "s", "time constant", low=0.0, start=slow_times),
    )
    confused_with = (
        Confusion("stribeck", "speeds in random order: a rising ladder of speeds goes along with time"),
        Confusion("temperature", "repeat the same motion later"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_level(place, p["delta"] * sympy.exp(-TIME / p["T"]))
