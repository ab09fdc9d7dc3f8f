"""A turning part whose centre of mass is off its axis."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from codegen.effects.effect import Confusion, EffectParameter, Symbols
from codegen.effects.periodic import PHASE, Periodic
from codegen.mechanics.system import System


class GravityImbalance(Periodic):
    """e = −G sin(x + phase)."""

    kind = "gravity_imbalance"
    sits_on = "coordinate"
    equation = "e = −G·sin(x + phase)"
    signature = "a force that goes through one wave in a turn, the same in both directions"
    seen_over = "position"
    parameters = (EffectParameter("G", "{F}", "greatest moment of gravity", neutral=0.0), PHASE)
    confused_with = (
        Confusion("cogging", "more than one turn, if the period is not a turn"),
        Confusion("spring", "a wider range: a spring goes on rising"),
    )
    needs = "a coordinate in rad"
    size = "G"

    def applies(self, system: System, place: int) -> bool:
        return system.position_units[place] == "rad"

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return system.positions[place]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, -wave)

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """Its weight pulls the other way."""
        return dict(values) | {"G": -values["G"]}
