"""An actuator that follows its command with a time constant."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drives
from codegen.effects.start import lags
from codegen.mechanics.system import System

TAU = EffectParameter("tau", "s", "time constant", low=0.0, start=lags)
EACH = EffectParameter(
    "tau_each", "s", "time constant of each of two equal lags in series, in place of tau", low=0.0, start=lags
)


class ActuatorLag(Effect):
    """tau w_eff' = w − w_eff, settled at the start; with ``tau_each`` in place of ``tau`` two such lags in series, a
    critically damped actuator of second order.
    """

    kind = "actuator_lag"
    sits_on = "input"
    equation = "tau·dw_eff/dt = w − w_eff; with tau_each, two such lags one after the other"
    signature = "a force proportional to the rate of the input, smaller at high frequencies than a delay's"
    seen_over = "input rate"
    confused_with = (
        Confusion("input_delay", "a chirp to high frequencies"),
        Confusion("viscous", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("compliance", "a chirp to high frequencies"),
    )
    needs = "an input that acts on the machine and has no lag yet"

    def __init__(self, twice: bool = False) -> None:
        self.parameters = (EACH,) if twice else (TAU,)

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """Two lags where ``tau_each`` is given."""
        return type(self)(twice=EACH.name in names)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The single lag first."""
        return (type(self)(), type(self)(twice=True))

    def add(self, system: System, place: int, p: Symbols) -> System:
        if EACH.name in p:
            return system.with_stage(place, "lag", p[EACH.name], sympy.Integer(2))
        return system.with_stage(place, "lag", p[TAU.name])

    def applies(self, system: System, place: int) -> bool:
        return drives(system, place) and system.actuator(place).lag is None
