"""Effects that are periodic in position; amplitude and phase are estimated as weights of a sine and a cosine."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from math import pi
from typing import ClassVar

import numpy as np
import sympy

from codegen.effects import coordinate
from codegen.effects.effect import PROBE, Confusion, Effect, EffectParameter, Symbols
from codegen.effects.start import Covered, periods
from codegen.mechanics.system import System

AMPLITUDE = EffectParameter("amplitude", "{F}", "amplitude", neutral=0.0)
PERIOD = EffectParameter("period", "{q}", "distance of one period", low=0.0, start=periods, moved_in=coordinate.PERIOD)
PHASE = EffectParameter("phase", "rad", "phase at zero", moved_in=coordinate.ANGLE)
SEVERAL_SPEEDS = "several speeds: the sensor's error scales with acceleration"
"""Experiment that discriminates a force periodic in position from a sensor's error."""


class Periodic(Effect):
    """Base class of a Fourier series in position: Σ_k size_k·sin(k·angle + phase_k), k = 1, 2, …

    Attributes:
        harmonics: parameter names of (size_k, phase_k), in the order of k; a simpler form has only the first ones.
    """

    seen_over = "position"
    harmonics: ClassVar[tuple[tuple[str, str], ...]] = (("amplitude", "phase"),)

    @property
    def waves(self) -> tuple[tuple[str, str], ...]:
        names = {p.name for p in self.parameters}
        return tuple(wave for wave in self.harmonics if names.issuperset(wave))

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """The shape parameters without the phases, which are estimated together with the sizes."""
        phases = {phase for _, phase in self.waves}
        return tuple(q for q in super().shapes if q.name not in phases)

    def probes(self, shape: Mapping[str, float], covered: Covered) -> list[tuple[dict[str, float], float]]:
        """As in ``Effect``: here one point with a small sine and one with a small cosine of each harmonic."""
        none = {p.name: 0.0 for p in self.parameters} | dict(shape)
        found = []
        for size, phase in self.waves:
            small = next(PROBE * covered.size(q.unit) for q in self.parameters if q.name == size)
            found += [(none | {size: small, phase: angle}, small) for angle in (0.0, np.pi / 2)]
        return found

    def weighted(self, shape: Mapping[str, float], weights: Sequence[float]) -> dict[str, float]:
        found = dict(shape)
        for (size, phase), sine, cosine in zip(self.waves, weights[::2], weights[1::2], strict=True):
            found |= {size: float(np.hypot(sine, cosine)), phase: float(np.arctan2(cosine, sine))}
        return found

    def normal_form(self, values: Mapping[str, float]) -> dict[str, float]:
        """The same values with positive sizes and with phases between −π and π."""
        found = dict(values)
        for size, phase in self.harmonics:
            if size in values:
                half_turns = 2 if values[size] < 0 else 1
                found[size] = abs(values[size])
                found[phase] = float((values[phase] + half_turns * np.pi) % (2 * np.pi) - np.pi)
        return found

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        """The angle of the first harmonic without its phase, rad."""
        return 2 * sympy.pi * system.positions[place] / p["period"]

    @abstractmethod
    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        """The system with ``wave``, an expression over position, added where this kind of effect acts."""

    def add(self, system: System, place: int, p: Symbols) -> System:
        angle = self.angle(system, place, p)
        waves = [p[size] * sympy.sin(k * angle + p[phase]) for k, (size, phase) in enumerate(self.waves, 1)]
        return self.act(system, place, sympy.Add(*waves))


class Cogging(Periodic):
    """Cogging: a force e = amplitude sin(2π x/period + phase)."""

    kind = "cogging"
    sits_on = "coordinate"
    equation = "e = amplitude·sin(2π x/period + phase)"
    signature = "a force periodic in position, the same in both directions"
    nameless: ClassVar[tuple[str, ...]] = ("drive_force_wave", "load_wave")
    parameters = (AMPLITUDE, PERIOD, PHASE)
    confused_with = (
        Confusion("position_dependent_friction", "both directions over the same place"),
        Confusion("gravity_imbalance", "more than one turn, if the period is not a turn"),
        Confusion("encoder_eccentricity", SEVERAL_SPEEDS),
    )

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, wave)

    def limit(self, system: System, place: int, values: Mapping[str, float]) -> tuple[str, dict[str, float]] | None:
        """Gravity imbalance: with a period of one turn the force is the same, and that has no free period."""
        gravity = GravityImbalance()
        if not gravity.applies(system, place):
            return None
        return gravity.kind, gravity.normal_form({"G": -values["amplitude"], "phase": values["phase"]})


class GravityImbalance(Periodic):
    """Gravity on an unbalanced mass of a rotation: e = −G sin(x + phase)."""

    kind = "gravity_imbalance"
    sits_on = "coordinate"
    equation = "e = −G·sin(x + phase)"
    signature = "a force that goes through one wave in a turn, the same in both directions"
    parameters = (EffectParameter("G", "{F}", "greatest moment of gravity", neutral=0.0), PHASE)
    confused_with = (
        Confusion("cogging", "more than one turn, if the period is not a turn"),
        Confusion("spring", "a wider range, on which the force of a spring keeps rising"),
    )
    needs = "a coordinate in rad"
    harmonics = (("G", "phase"),)

    def applies(self, system: System, place: int) -> bool:
        return system.position_units[place] == "rad"

    def period(self, values: Mapping[str, float]) -> float:
        return 2 * pi

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return system.positions[place]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, -wave)

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """−G: on the machine mounted upside down the weight acts in the other direction."""
        return dict(values) | {"G": -values["G"]}


class PositionDependentFriction(Periodic):
    """Position-dependent friction: level += amplitude sin(2π s/period + phase), with s = U' x the slip position.

    Where ``amplitude_2`` is given, also level += amplitude_2 sin(4π s/period + phase_2).
    """

    kind = "position_dependent_friction"
    sits_on = "contact"
    equation = "level += amplitude·sin(2π s/period + phase), and amplitude_2·sin(4π s/period + phase_2) where given"
    signature = "a force periodic in position that changes sign with the direction"
    nameless: ClassVar[tuple[str, ...]] = ("drive_force_over_position",)
    parameters = (AMPLITUDE, PERIOD, PHASE)
    more_forms = (
        (
            *parameters,
            replace(AMPLITUDE, name="amplitude_2", meaning="amplitude of the second harmonic"),
            replace(PHASE, name="phase_2", meaning="phase of the second harmonic at zero"),
        ),
    )
    confused_with = (Confusion("cogging", "both directions over the same place: cogging does not change sign"),)
    harmonics = (("amplitude", "phase"), ("amplitude_2", "phase_2"))

    def angle(self, system: System, place: int, p: Symbols) -> sympy.Expr:
        return 2 * sympy.pi * system.slip_position[place] / p["period"]

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_level(place, wave)


STEEPEST = 0.5
"""Upper bound of the slope of a sensor's error over position."""


class EncoderEccentricity(Periodic):
    """Error of an eccentric encoder: x_measured = x + amplitude sin(2π x/period + phase)."""

    kind = "encoder_eccentricity"
    sits_on = "sensor"
    equation = "x_measured = x + amplitude·sin(2π x/period + phase)"
    signature = "a force periodic in position that grows with the square of speed and with acceleration"
    parameters = (EffectParameter("amplitude", "{q}", "amplitude of the sensor's error", neutral=0.0), PERIOD, PHASE)
    confused_with = (Confusion("cogging", SEVERAL_SPEEDS), Confusion("cogging_harmonics", SEVERAL_SPEEDS))
    demands = f"2π·|amplitude| below {STEEPEST:g} of the period, so that one position has one reading"

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_sensor_error(place, wave)

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        inside = super().admissible(system, place, values)
        return inside and 2 * pi * abs(values["amplitude"]) < STEEPEST * values["period"]


class CoggingHarmonics(Effect):
    """Cogging with several harmonics: e = Σ_k sin_k sin(2π k x/period) + cos_k cos(2π k x/period).

    The orders k are those in the names of the parameters."""

    kind = "cogging_harmonics"
    sits_on = "coordinate"
    equation = "e = Σ_k sin_k·sin(2π k x/period) + cos_k·cos(2π k x/period)"
    signature = "a force periodic in position with several waves in a period, the same in both directions"
    seen_over = "position"
    refines = "cogging"
    confused_with = (
        Confusion("cogging", "a slow turn over several periods: one wave explains the force, or more are needed"),
        Confusion("encoder_eccentricity", SEVERAL_SPEEDS),
    )

    def __init__(self, orders: Sequence[int] = (1, 2, 3)) -> None:
        self.orders = tuple(orders)
        waves = [
            EffectParameter(f"{wave}_{k}", "{F}", f"{word} of order {k}", neutral=0.0)
            for k in self.orders
            for wave, word in (("sin", "sine"), ("cos", "cosine"))
        ]
        self.parameters = (PERIOD, *waves)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """The effect with the orders k of the given parameter names sin_k and cos_k."""
        found = {int(match[1]) for name in names if (match := re.fullmatch(r"(?:sin|cos)_([1-9][0-9]{0,3})", name))}
        return self.of_orders(sorted(found)) if found else self

    def of_orders(self, orders: Sequence[int]) -> CoggingHarmonics:
        """The effect with other orders."""
        return type(self)(orders)

    def without(self, free: Set[str]) -> Effect | None:
        kept = [k for k in self.orders if not {f"sin_{k}", f"cos_{k}"} <= free]
        return self.of_orders(kept) if 0 < len(kept) < len(self.orders) else None

    def values(self, period: float, weights: Sequence[tuple[float, float]]) -> dict[str, float]:
        """Parameter name → value; ``weights``: (of the sine, of the cosine) for each order."""
        waves = zip(self.orders, weights, strict=True)
        found = {f"{wave}_{k}": float(w) for k, pair in waves for wave, w in zip(("sin", "cos"), pair, strict=True)}
        return {PERIOD.name: period} | found

    def add(self, system: System, place: int, p: Symbols) -> System:
        turn = 2 * sympy.pi * system.positions[place] / p["period"]
        waves = [p[f"sin_{k}"] * sympy.sin(k * turn) + p[f"cos_{k}"] * sympy.cos(k * turn) for k in self.orders]
        return system.with_force(place, sympy.Add(*waves))
