"""Coulomb friction that differs by direction."""

from __future__ import annotations

from collections.abc import Mapping

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import lone_coordinate
from codegen.friction.law import DynamicLaw
from codegen.mechanics.system import System


class CoulombAsymmetry(Effect):
    """Level a + d for u > 0 and a − d for u < 0; with |d| ≤ a that is λ += d in slip and in stick alike."""

    kind = "coulomb_asymmetry"
    sits_on = "contact"
    equation = "level = a + d for u > 0, a − d for u < 0"
    signature = "a constant force, whatever the motion"
    seen_over = "velocity"
    both_ways = True
    demands = "|d| no larger than the friction level, so that neither direction's level is negative"
    parameters = (EffectParameter("d", "{F}", "half the difference of the two levels", neutral=0.0),)
    confused_with = (Confusion("offset", "another mounting; never the same log"),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["d"])

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Neither level is negative: friction does not push. A larger constant force is an offset.

        Not asked of a law with states, whose force at rest is no level.
        """
        contact = system.contacts[place]
        level = None if isinstance(contact.law, DynamicLaw) else contact.level_at_rest
        return level is None or abs(values["d"]) <= float(level.subs(system.values))

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        coordinate = lone_coordinate(system, place)
        return [] if coordinate is None else [("offset", system.positions[coordinate].name)]
