"""Viscous friction in a contact."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import pair_contacts, pairs
from codegen.effects.start import speeds
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude, Sgn

COEFFICIENT = EffectParameter("b", "{F}*s/{q}", "viscous coefficient", neutral=0.0)
FALLING = EffectParameter("b", "{F}*s/{q}", "viscous coefficient at standstill", low=0.0, neutral=0.0)
THINNING = EffectParameter(
    "v_s", "{q}/s", "speed at which the slope is half of b", low=0.0, start=speeds, least_share=0.01
)


class Viscous(Effect):
    """λ += b u, or with ``v_s`` the curve λ += b v_s ln(1 + |u|/v_s) sgn(u), whose slope b/(1 + |u|/v_s) falls with
    speed.

    The curve is that of a lubricant that thins with the shear rate: friction in harmonic drives, servo gears and
    greased bearings grows by less than in proportion to speed.
    """

    kind = "viscous"
    sits_on = "contact"
    equation = "λ += b·u, or b·v_s·ln(1 + ∣u∣/v_s)·sgn(u) where v_s is given"
    signature = "a force that grows with slip velocity and changes sign with it"
    seen_over = "velocity"
    confused_with = (
        Confusion("quadratic_drag", "a speed ladder over two decades"),
        Confusion("back-EMF", "a speed ladder over two decades"),
        Confusion("actuator_lag", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("coupling", "one of the two coordinates held, the other moved"),
    )

    def __init__(self, thinning: bool = False) -> None:
        self.parameters = (FALLING, THINNING) if thinning else (COEFFICIENT,)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With a slope that falls where v_s is given."""
        return type(self)(thinning=THINNING.name in names)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The constant slope first."""
        return (self, type(self)(thinning=True))

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        if THINNING.name not in p:
            return system.with_contact_force(place, p["b"] * slip)
        curve = sympy.log(1 + Magnitude(slip) / p["v_s"])
        return system.with_contact_force(place, p["b"] * p["v_s"] * curve * Sgn(slip))

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        if THINNING in self.parameters:
            return []
        x = system.positions
        between = [pair for pair in pairs(system) if place in pair_contacts(system, *pair)]
        return [("coupling", f"{x[i]}, {x[j]}") for i, j in between]
