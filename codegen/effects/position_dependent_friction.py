"""Friction that differs along the way: a bent rail, a seal that runs out of true."""

from __future__ import annotations

import sympy

from codegen.effects.effect import Confusion, Symbols
from codegen.effects.periodic import AMPLITUDE, PERIOD, PHASE, Periodic
from codegen.mechanics.system import System


class PositionDependentFriction(Periodic):
    """level += amplitude sin(2π s/period + phase), s = U' x the slip position."""

    kind = "position_dependent_friction"
    sits_on = "contact"
    equation = "level += amplitude·sin(2π s/period + phase)"
    signature = "a force periodic in position that changes sign with the direction"
    seen_over = "position"
    parameters = (AMPLITUDE, PERIOD, PHASE)
    confused_with = (Confusion("cogging", "both directions over the same place: cogging does not change sign"),)

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return 2 * sympy.pi * system.slip_position[place] / p["period"]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_level(place, wave)
