"""A constant force on a coordinate."""

from __future__ import annotations

from collections.abc import Mapping

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import lone_contacts
from codegen.mechanics.system import System


class Offset(Effect):
    """e = f0."""

    kind = "offset"
    sits_on = "coordinate"
    equation = "e = f0"
    signature = "a constant force, whatever the motion"
    seen_over = "time"
    parameters = (EffectParameter("f0", "{F}", "constant force", neutral=0.0),)
    confused_with = (
        Confusion("coulomb_asymmetry", "another mounting; never the same log"),
        Confusion("gravity_imbalance", "another position of the axis"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, p["f0"])

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """A constant force that does not turn with the machine is weight."""
        return {"f0": -values["f0"]}

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("coulomb_asymmetry", system.contacts[c].name) for c in lone_contacts(system, place)]
