"""Effects of a user's own, one for each way in which ``add`` may change a System, none with a kind that is shipped."""

from __future__ import annotations

import sympy

from codegen.effects import Effect, EffectParameter
from codegen.friction import DynamicLaw, LawParameter, LawState
from codegen.mechanics.actuator import Transmission
from codegen.mechanics.system import TIME
from codegen.spec.functions import Magnitude


class Own(Effect):
    """What these have in common."""

    equation = signature = "of a test"
    seen_over = "position"
    confused_with = ()


class Wall(Own):
    """A force over position and velocity."""

    kind = "wall"
    sits_on = "coordinate"
    parameters = (
        EffectParameter("k", "{F}/{q}^3", "", neutral=0.0),
        EffectParameter("d", "{F}*s/{q}", "", neutral=0.0),
    )

    def add(self, system, place, p):
        x, v = system.positions[place], system.velocities[place]
        return system.with_force(place, -p["k"] * x**3 - p["d"] * v)


class Warming(Own):
    """A level over time and slip."""

    kind = "warming"
    sits_on = "contact"
    parameters = (EffectParameter("r", "{F}", "", neutral=0.0), EffectParameter("T", "s", "", low=0.0))

    def add(self, system, place, p):
        return system.with_level(place, p["r"] * TIME / (TIME + p["T"]))


class Swollen(Own):
    """A smooth contact force."""

    kind = "swollen"
    sits_on = "contact"
    parameters = (EffectParameter("b", "{F}*s^2/{q}^2", "", neutral=0.0),)

    def add(self, system, place, p):
        slip = system.contacts[place].slip
        return system.with_contact_force(place, p["b"] * slip * Magnitude(slip))


class Payload(Own):
    """An inertia."""

    kind = "payload"
    sits_on = "coordinate"
    parameters = (EffectParameter("m", "{F}*s^2/{q}", "", low=0.0, neutral=0.0),)

    def add(self, system, place, p):
        return system.with_inertia(place, p["m"])


class Drive(Own):
    """Every stage of an actuator, from two parameters."""

    kind = "drive"
    sits_on = "input"
    parameters = (
        EffectParameter("late", "s", "", low=0.0, start=lambda covered: [0.005]),
        EffectParameter("full", "{w}", "", low=0.0, start=lambda covered: [8.0]),
    )

    def add(self, system, place, p):
        stages = (
            ("lag", 2 * p["late"]), ("saturation", p["full"]), ("dead_zone", p["full"] / 10), ("gain", 1 + p["late"]),
            ("delay", p["late"] / 2),
        )  # fmt: skip
        for stage, parameter in stages:
            system = system.with_stage(place, stage, parameter)
        return system


class Stretched(Own):
    """A sensor error that is no wave."""

    kind = "stretched"
    sits_on = "sensor"
    parameters = (EffectParameter("s", "1/{q}^2", "", neutral=0.0),)

    def add(self, system, place, p):
        return system.with_sensor_error(place, p["s"] * system.positions[place] ** 3)


class Soft(Own):
    """A transmission whose numbers hang together."""

    kind = "soft"
    sits_on = "axis"
    parameters = (
        EffectParameter("k", "{F}/{q}", "", low=0.0),
        EffectParameter("play", "{q}", "", low=0.0),
    )
    rough = True

    def add(self, system, place, p):
        return system.with_transmission(Transmission(place, p["k"], p["k"] / 200, sympy.Rational(2, 5), p["play"]))


class SoftLaw(DynamicLaw):
    """Two bristles side by side, one of them damped, whose level is the contact's own."""

    name = "soft_law"
    source = "a test"
    parameters = (
        LawParameter("a", "{F}", True, ""),
        LawParameter("s", "{F}/{q}", True, ""),
    )
    states = (LawState("z", "{q}", ""), LawState("y", "{q}", ""))

    def _limits(self, p):
        return p["a"] / p["s"], p["a"] / (4 * p["s"])

    def rates(self, u, z, p):
        return tuple(
            u - Magnitude(u) * deflection / limit for deflection, limit in zip(z, self._limits(p), strict=True)
        )

    def force(self, u, z, p):
        return p["s"] * z[0] / 2 + 2 * p["s"] * z[1] + p["s"] / 400 * self.rates(u, z, p)[0]

    def state_range(self, top_speed, p):
        return tuple((-limit, limit) for limit in self._limits(p))

    def level(self, slip_speed, p):
        return p["a"]

    def slope_bound(self, p):
        return sympy.Integer(0)


class Creeping(Own):
    """A law with states, in place of the contact's own."""

    kind = "creeping"
    sits_on = "contact"
    parameters = (EffectParameter("s", "{F}/{q}", "", low=0.0, start=lambda covered: [3e3]),)

    def add(self, system, place, p):
        level = system.contacts[place].law_parameters["a"]
        return system.with_law(place, SoftLaw(), {"a": level, "s": p["s"]})


EFFECTS = [Wall(), Warming(), Swollen(), Payload(), Drive(), Stretched(), Soft(), Creeping()]
VALUES = {
    "wall": {"k": 3000.0, "d": 4.0},
    "warming": {"r": 2.0, "T": 1.5},
    "swollen": {"b": 20.0},
    "payload": {"m": 0.7},
    "drive": {"late": 0.012, "full": 9.0},
    "stretched": {"s": 3.0},
    "soft": {"k": 4000.0, "play": 2e-3},
    "creeping": {"s": 800.0},
}
