"""Viscous friction in a contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import pair_contacts, pairs
from codegen.effects.start import speeds
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude, Sgn

COEFFICIENT = EffectParameter("b", "{F}*s/{q}", "viscous coefficient; of a curve, what its slope loses", neutral=0.0)
THINNING = EffectParameter(
    "v_s", "{q}/s", "speed at which half of b is lost", low=0.0, start=speeds, seen_at=(0.01, 3.0)
)
LEFT = EffectParameter("b_inf", "{F}*s/{q}", "slope of a curve at high speed, 0 where it is not given", neutral=0.0)
FORMS = ((COEFFICIENT,), (COEFFICIENT, THINNING), (COEFFICIENT, THINNING, LEFT))


class Viscous(Effect):
    """λ += b u, or with ``v_s`` the curve λ += b v_s ln(1 + |u|/v_s) sgn(u) + b_inf u.

    The slope of the curve falls from b + b_inf at standstill to b_inf: a lubricant that thins with the shear rate. In
    harmonic drives, servo gears and greased bearings friction grows by less than in proportion to speed. Where the spec
    declares viscous friction in proportion, b_inf may be negative and take of that.
    """

    kind = "viscous"
    sits_on = "contact"
    equation = "λ += b·u, or b·v_s·ln(1 + ∣u∣/v_s)·sgn(u) + b_inf·u where v_s is given"
    signature = "a force that grows with slip velocity and changes sign with it"
    seen_over = "velocity"
    confused_with = (
        Confusion("quadratic_drag", "a speed ladder over two decades"),
        Confusion("back-EMF", "a speed ladder over two decades"),
        Confusion("actuator_lag", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("coupling", "one of the two coordinates held, the other moved"),
    )

    demands = "b above 0 where v_s is given"

    def __init__(self, form: int = 0) -> None:
        self.parameters = FORMS[form]

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """The simplest form that has these parameters."""
        return type(self)(2 if LEFT.name in names else 1 if THINNING.name in names else 0)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The constant slope first."""
        return tuple(type(self)(form) for form in range(len(FORMS)))

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """A curve with a negative b would be a Stribeck curve."""
        return super().admissible(system, place, values) and (THINNING.name not in values or values["b"] > 0)

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        if THINNING.name not in p:
            return system.with_contact_force(place, p["b"] * slip)
        curve = p["b"] * p["v_s"] * sympy.log(1 + Magnitude(slip) / p["v_s"]) * Sgn(slip)
        return system.with_contact_force(place, curve + p.get("b_inf", 0) * slip)

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        if THINNING in self.parameters:
            return []
        x = system.positions
        between = [pair for pair in pairs(system) if place in pair_contacts(system, *pair)]
        return [("coupling", f"{x[i]}, {x[j]}") for i, j in between]
