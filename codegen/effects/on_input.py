"""Effects of an actuator: gain, dead time, lag, dead zone and saturation of an input."""

from collections.abc import Mapping
from typing import ClassVar

import sympy

from codegen.effects.effect import Axis, Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import sole_drive
from codegen.effects.start import dead_widths, delays, gains, lags, limits, roundings, thresholds
from codegen.mechanics.actuator import Stage
from codegen.mechanics.system import System

CHIRP = "a chirp to high frequencies"
"""Experiment that discriminates a delay, a lag and compliance."""


class OnInput(Effect):
    """Base class: the effect adds one stage, with its parameters, to an input's actuator model."""

    sits_on = "input"
    seen_over: ClassVar[Axis] = "input"
    needs = "an input that acts on the machine"
    stage: ClassVar[Stage]

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_stage(place, self.stage, *(p[q.name] for q in self.parameters))

    def applies(self, system: System, place: int) -> bool:
        return bool(system.force.has(system.inputs[place]))


class InputGain(OnInput):
    """Gain error of an actuator: w_eff = gain·w."""

    kind = "input_gain"
    equation = "w_eff = gain·w"
    signature = "a force proportional to the input"
    parameters = (EffectParameter("gain", "1", "gain", low=0.0, neutral=1.0, start=gains),)
    confused_with = (
        Confusion("inertia_error", "another force on the axis: a known load or spring"),
        Confusion("load_dependent_friction", "several loads, driving and back-driving"),
    )
    stage = "gain"

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("inertia_error", x.name) for i, x in enumerate(system.positions) if sole_drive(system, i) == place]


class InputDelay(OnInput):
    """Dead time of an actuator: w_eff(t) = w(t − T)."""

    kind = "input_delay"
    equation = "w_eff(t) = w(t − T)"
    signature = "a force proportional to the rate of the input"
    seen_over = "input rate"
    parameters = (EffectParameter("T", "s", "dead time", low=0.0, start=delays),)
    confused_with = (Confusion("actuator_lag", CHIRP), Confusion("viscous", "a chirp"), Confusion("compliance", CHIRP))
    stage = "delay"

    def delay(self, values: Mapping[str, float]) -> float:
        return values["T"]


TAU = EffectParameter("tau", "s", "time constant", low=0.0, start=lags)
EACH = EffectParameter(
    "tau_each", "s", "time constant of each of two equal lags in series, in place of tau", low=0.0, start=lags
)


class ActuatorLag(OnInput):
    """First-order lag of an actuator: tau w_eff' = w − w_eff, with w_eff = w at the start.

    With ``tau_each`` in place of ``tau`` there are two such lags in series: a critically damped second-order actuator.
    """

    kind = "actuator_lag"
    equation = "tau·dw_eff/dt = w − w_eff; with tau_each, two such lags one after the other"
    signature = "a force proportional to the rate of the input, smaller at high frequencies than a delay's"
    seen_over = "input rate"
    parameters = (TAU,)
    more_forms = ((EACH,),)
    confused_with = (
        Confusion("input_delay", CHIRP),
        Confusion("viscous", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("compliance", CHIRP),
    )
    needs = "an input that acts on the machine and has no lag yet"

    def delay(self, values: Mapping[str, float]) -> float:
        return 2 * values[EACH.name] if EACH.name in values else values[TAU.name]

    def add(self, system: System, place: int, p: Symbols) -> System:
        if EACH.name in p:
            return system.with_stage(place, "lag", p[EACH.name], sympy.Integer(2))
        return system.with_stage(place, "lag", p[TAU.name])

    def applies(self, system: System, place: int) -> bool:
        return super().applies(system, place) and system.actuator(place).lag is None


WIDTH = EffectParameter("width", "{w}", "half width of the dead zone", low=0.0, start=dead_widths)
THRESHOLD = EffectParameter(
    "threshold", "{w}", "greatest input that has no effect, in place of a width; a larger one acts whole",
    low=0.0, start=thresholds,
)  # fmt: skip


class DeadZone(OnInput):
    """Dead zone of an actuator: w_eff = sgn(w) max(|w| − width, 0).

    With ``threshold`` in place of ``width``: w_eff = w where |w| > threshold, else 0; a drive that ignores small
    commands.
    """

    kind = "dead_zone"
    equation = "w_eff = sgn(w)·max(|w| − width, 0); with a threshold, w where |w| > threshold and 0 elsewhere"
    signature = "a force that is missing: all of it at small commands, a constant share at large ones"
    parameters = (WIDTH,)
    more_forms = ((THRESHOLD,),)
    confused_with = (
        Confusion("input_gain", "two amplitudes of one motion"),
        Confusion("coulomb friction", "a force in one direction that is not reversed while the motion is"),
    )

    @property
    def rough(self) -> bool:
        """True with a threshold: the effective input jumps as the threshold crosses a sample."""
        return THRESHOLD in self.parameters

    def add(self, system: System, place: int, p: Symbols) -> System:
        if THRESHOLD.name in p:
            return system.with_stage(place, "threshold", p[THRESHOLD.name])
        return system.with_stage(place, "dead_zone", p[WIDTH.name])


LIMIT = EffectParameter("limit", "{w}", "greatest effective input", low=0.0, start=limits)
ROUNDING = EffectParameter(
    "rounding", "1", "0 for a sharp corner at the limit, towards 1 for a gradual approach", low=0.0, high=1.0,
    start=roundings,
)  # fmt: skip


class Saturation(OnInput):
    """Saturation of an actuator: w_eff = clip(w, −limit, limit), or with ``rounding`` r the smooth curve

    w_eff = (√((w + l)² + r²·limit²) − √((w − l)² + r²·limit²))·limit/(2 l), l = limit·√(1 − r²).

    The slope of the curve is 1 at w = 0 and it tends to ±limit, as with a saturating magnetic circuit or an amplifier's
    soft limit. Up to |w| = 1.5 limits it fits limit·tanh(w/limit) to 0.3 % of the difference w − w_eff.
    """

    kind = "saturation"
    equation = "w_eff = clip(w, −limit, limit), its corners rounded where rounding is given"
    signature = "a force that is missing at large commands and at no others"
    parameters = (LIMIT,)
    more_forms = ((LIMIT, ROUNDING),)
    confused_with = (
        Confusion("input_gain", "a small and a large amplitude of one motion"),
        Confusion("quadratic_drag", "a large command at low speed"),
    )
    stage = "saturation"
