"""The Stribeck effect: friction rises towards standstill."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.start import Covered, speeds
from codegen.friction.law import DynamicLaw
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude

RISE = EffectParameter("delta", "{F}", "rise of the level at standstill", low=0.0, neutral=0.0)
SPEED = EffectParameter("v_s", "{q}/s", "Stribeck velocity", low=0.0, start=speeds)
EXPONENT = EffectParameter(
    "exponent", "1", "2 where it is not given; 1 for an exponential", low=0.5, high=4.0, usual=2.0, as_number=True
)

SEEN_SPEED = replace(SPEED, seen_at=(0.0, 0.5))
DIFFERENCE = EffectParameter("d_delta", "{F}", "half the difference of the rises for u > 0 and u < 0", neutral=0.0)
FORMS = ((RISE, SPEED), (RISE, SPEED, EXPONENT), (RISE, SEEN_SPEED, DIFFERENCE))


class Stribeck(Effect):
    """level += delta exp(−(u/v_s)²), or with another ``exponent`` than 2 level += delta exp(−(|u|/v_s)^exponent).

    With ``d_delta`` the rise differs by direction, as in a worm gear: delta + d_delta for u > 0, delta − d_delta for
    u < 0. A diagnosis tries that up to half of the log's top speed: above, the curve is a viscous asymmetry with one
    parameter more.

    Exponents between 0.5 and 1 have been measured in ball bearings and gears (Armstrong-Hélouvry, Dupont and Canudas
    de Wit 1994); the exponent 1 is Tustin's curve. Below 1 the slope is infinite at standstill, and no certificate
    expresses an exponent that is no whole number: where an observer with estimated velocity is to be certified, declare
    the nearest of 1, 2 and 3.
    """

    kind = "stribeck"
    sits_on = "contact"
    equation = (
        "level += delta·exp(−(|u|/v_s)²), or with exponent in place of 2, or (delta + d_delta·sgn(u)) in place of "
        "delta, where given"
    )
    signature = "extra friction at low slip speed that is gone above the Stribeck velocity"
    seen_over = "velocity"
    confused_with = (
        Confusion("friction_drift", "speeds in random order: a rising ladder of speeds goes along with time"),
        Confusion("presliding", "a microscopic slow sine"),
        Confusion("quantisation", "a finer encoder, or slow motion in one direction"),
        Confusion("quadratic_drag", "slow motion, where a wide Stribeck curve still falls"),
    )

    demands = "d_delta such that the level is not negative in either direction"

    def __init__(self, form: int = 0) -> None:
        self.parameters = FORMS[form]

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With an exponent, or a rise by direction, where that is given."""
        return type(self)(2 if DIFFERENCE.name in names else 1 if EXPONENT.name in names else 0)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The symmetric Gaussian first."""
        return tuple(type(self)(form) for form in range(len(FORMS)))

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Neither level at rest is negative: friction does not push. Not asked of a law with states."""
        contact = system.contacts[place]
        level = None if isinstance(contact.law, DynamicLaw) else contact.level_at_rest
        lower = values["delta"] - abs(values.get(DIFFERENCE.name, 0.0))
        is_friction = level is None or lower >= 0 or float(level.subs(system.values)) + lower >= 0
        return super().admissible(system, place, values) and is_friction

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """At Stribeck velocities from a hundredth of the top speed up, an exponent at 1."""
        exponents = [{"exponent": 1.0}] if EXPONENT in self.parameters else [{}]
        return [{"v_s": float(v)} | e for v, e in product(speeds(covered), exponents)]

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        if EXPONENT.name in p:
            power = Magnitude(slip) ** p["exponent"] / p["v_s"] ** p["exponent"]
            return system.with_level(place, p["delta"] * sympy.exp(-power))
        curve = sympy.exp(-((slip / p["v_s"]) ** 2))
        changed = system.with_level(place, p["delta"] * curve)
        return changed.with_contact_force(place, p["d_delta"] * curve) if DIFFERENCE.name in p else changed
