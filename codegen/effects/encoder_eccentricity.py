"""An encoder whose disc or scale runs out of true."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import sympy

from codegen.effects.effect import Confusion, EffectParameter, Symbols
from codegen.effects.periodic import PERIOD, PHASE, Periodic
from codegen.mechanics.system import Matrix, System

STEEPEST = 0.5


class EncoderEccentricity(Periodic):
    """x_measured = x + amplitude sin(2π x/period + phase)."""

    kind = "encoder_eccentricity"
    sits_on = "sensor"
    equation = "x_measured = x + amplitude·sin(2π x/period + phase)"
    signature = "a force periodic in position that grows with the square of speed and with acceleration"
    seen_over = "position"
    parameters = (EffectParameter("amplitude", "{q}", "amplitude of the sensor's error", neutral=0.0), PERIOD, PHASE)
    confused_with = (
        Confusion("cogging", "several speeds: the sensor's error scales with acceleration"),
        Confusion("cogging_harmonics", "several speeds: the sensor's error scales with acceleration"),
    )
    demands = f"2π·|amplitude| below {STEEPEST:g} of the period, so that one position has one reading"

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return 2 * sympy.pi * system.positions[place] / p["period"]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_sensor_error(place, wave)

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        inside = super().admissible(system, place, values)
        return inside and 2 * pi * abs(values["amplitude"]) < STEEPEST * values["period"]

    def change(self, system: System, place: int, p: Symbols) -> Matrix:
        """To first order in the amplitude."""
        return self.column(system, place, p["amplitude"] * sympy.sin(self.angle(system, place, p) + p["phase"]))

    def column(self, system: System, place: int, wave: sympy.Expr) -> Matrix:
        """First-order change of g − M a − U λ over the measured motion for x = x_measured − wave(x_measured)."""
        x, v, a = system.positions[place], system.velocities[place], system.accelerations[place]
        slope, curvature = wave.diff(x), wave.diff(x, 2)
        error = system.equation_error
        change = error.diff(x) * wave + error.diff(v) * (slope * v) + error.diff(a) * (curvature * v**2 + slope * a)
        return Matrix(-change)
