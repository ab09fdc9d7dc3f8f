"""A drive that is not rigid: a spring, or a spring with play, between motor and load."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import coupled_or_varying
from codegen.effects.start import dampings, gaps, shares, stiffnesses
from codegen.mechanics.system import System
from codegen.mechanics.transmission import Transmission

STIFFNESS = EffectParameter("k", "{F}/{q}", "stiffness", low=0.0, start=stiffnesses)
DAMPING = EffectParameter("c", "{F}*s/{q}", "damping", low=0.0, start=dampings)
SHARE = EffectParameter(
    "load_fraction", "1", "share ρ of the inertia behind the spring", low=0.0, high=1.0, start=shares
)
NEEDS = "an axis with a constant inertia of its own, not coupled to others, and no compliance or backlash yet"


class Compliance(Effect):
    """(1 − ρ)M at the motor, ρM at the load; between them k dx + c dv, dx = x − x_load."""

    kind = "compliance"
    sits_on = "axis"
    equation = "(1 − ρ)·M at the motor, ρ·M at the load; between them k·dx + c·dv"
    signature = "a resonance: ringing after each jump of the input or of friction"
    seen_over = "time"
    parameters = (STIFFNESS, DAMPING, SHARE)
    confused_with = (
        Confusion("backlash", "preload: it takes the play out"),
        Confusion("input_delay", "a chirp to high frequencies"),
        Confusion("actuator_lag", "a chirp to high frequencies"),
        Confusion("presliding", "a chirp to high frequencies"),
    )
    needs = NEEDS

    def applies(self, system: System, place: int) -> bool:
        taken = any(t.coordinate == place for t in system.transmissions)
        return not taken and not coupled_or_varying(system, place)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_transmission(Transmission(place, p["k"], p["c"], p["load_fraction"]))


class Backlash(Effect):
    """As compliance, with a force only beyond half the gap, and never one that pulls."""

    kind = "backlash"
    sits_on = "axis"
    equation = "as compliance, with a force only where |dx| > gap/2, and never pulling"
    signature = "lost motion: after each reversal the motor turns without its load"
    seen_over = "time"
    parameters = (
        EffectParameter("gap", "{q}", "full width of the play", low=0.0, start=gaps),
        STIFFNESS,
        DAMPING,
        SHARE,
    )
    confused_with = (
        Confusion("compliance", "preload: it takes the play out"),
        Confusion("presliding", "a microscopic slow sine: presliding holds it with a force, backlash lets it go"),
        Confusion("input_delay", "a chirp at two amplitudes"),
    )
    needs = NEEDS

    def applies(self, system: System, place: int) -> bool:
        return Compliance().applies(system, place)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_transmission(Transmission(place, p["k"], p["c"], p["load_fraction"], p["gap"]))
