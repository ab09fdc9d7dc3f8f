"""A force that repeats along the axis: motor cogging, a pulley's or a screw's once-per-turn force."""

from __future__ import annotations

import sympy

from codegen.effects.effect import Confusion, Symbols
from codegen.effects.periodic import AMPLITUDE, PERIOD, PHASE, Periodic
from codegen.mechanics.system import System


class Cogging(Periodic):
    """e = amplitude sin(2π x/period + phase)."""

    kind = "cogging"
    sits_on = "coordinate"
    equation = "e = amplitude·sin(2π x/period + phase)"
    signature = "a force periodic in position, the same in both directions"
    seen_over = "position"
    parameters = (AMPLITUDE, PERIOD, PHASE)
    confused_with = (
        Confusion("position_dependent_friction", "both directions over the same place"),
        Confusion("gravity_imbalance", "more than one turn, if the period is not a turn"),
        Confusion("encoder_eccentricity", "several speeds: the sensor's error scales with acceleration"),
    )

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return 2 * sympy.pi * system.positions[place] / p["period"]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, wave)
