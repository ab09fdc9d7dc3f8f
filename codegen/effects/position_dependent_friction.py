"""Friction that differs along the way: a bent rail, a seal that runs out of true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.periodic import AMPLITUDE, PERIOD, PHASE, Periodic
from codegen.effects.start import Covered
from codegen.mechanics.system import System

SECOND = (
    replace(AMPLITUDE, name="amplitude_2", meaning="amplitude of the second harmonic"),
    replace(PHASE, name="phase_2", meaning="phase of the second harmonic at zero"),
)


class PositionDependentFriction(Periodic):
    """level += amplitude sin(2π s/period + phase), s = U' x the slip position; with its second harmonic

    level += amplitude_2 sin(4π s/period + phase_2) where that is given.
    """

    kind = "position_dependent_friction"
    sits_on = "contact"
    equation = "level += amplitude·sin(2π s/period + phase), and amplitude_2·sin(4π s/period + phase_2) where given"
    signature = "a force periodic in position that changes sign with the direction"
    seen_over = "position"
    confused_with = (Confusion("cogging", "both directions over the same place: cogging does not change sign"),)

    def __init__(self, second: bool = False) -> None:
        self.parameters = (AMPLITUDE, PERIOD, PHASE, *SECOND) if second else (AMPLITUDE, PERIOD, PHASE)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """With the second harmonic where it is given."""
        return type(self)(second=any(p.name in names for p in SECOND))

    @property
    def forms(self) -> tuple[Effect, ...]:
        """A single wave first."""
        return (self, type(self)(second=True))

    @property
    def waves(self) -> tuple[tuple[str, str], ...]:
        second = (SECOND[0].name, SECOND[1].name)
        return (*super().waves, *([second] if SECOND[0] in self.parameters else []))

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """The period: amplitudes and phases are estimated together."""
        return (PERIOD,)

    def probes(self, shape: Mapping[str, float], covered: Covered) -> list[tuple[dict[str, float], float]]:
        """A small sine and cosine of each harmonic."""
        first = super().probes(shape, covered)
        if SECOND[0] not in self.parameters:
            return first
        none, small = {p.name: 0.0 for p in self.parameters}, first[0][1]
        second = [none | dict(shape) | {"amplitude_2": small, "phase_2": phase} for phase in (0.0, np.pi / 2)]
        return [*((none | values, step) for values, step in first), *((values, small) for values in second)]

    def weighted(self, shape: Mapping[str, float], weights: Sequence[float]) -> dict[str, float]:
        found = super().weighted(shape, weights[:2])
        if len(weights) > 2:
            sine, cosine = weights[2:]
            found |= {"amplitude_2": float(np.hypot(sine, cosine)), "phase_2": float(np.arctan2(cosine, sine))}
        return found

    def normal_form(self, values: Mapping[str, float]) -> dict[str, float]:
        """With positive amplitudes and phases within half a turn."""
        found = super().normal_form(values)
        if "amplitude_2" in values:
            second = super().normal_form({"amplitude": values["amplitude_2"], "phase": values["phase_2"]})
            found |= {"amplitude_2": second["amplitude"], "phase_2": second["phase"]}
        return found

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return 2 * sympy.pi * system.slip_position[place] / p["period"]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_level(place, wave)

    def add(self, system: System, place: int, p: Symbols) -> System:
        angle = self.angle(system, place, p)
        wave = p["amplitude"] * sympy.sin(angle + p["phase"])
        if "amplitude_2" in p:
            wave += p["amplitude_2"] * sympy.sin(2 * angle + p["phase_2"])
        return self.act(system, place, wave)
