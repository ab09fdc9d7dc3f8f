"""What a machine has and its spec lacks: effects by ../../../shared/effects.md, and foreign disturbances of no kind.

Each is a class with the hooks that it needs; the plant calls them all. Forces are in N or N·m on a coordinate, levels
in the force unit of a contact, currents in A, times in s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import copysign, exp, pi, sin
from typing import Any

import numpy as np


@dataclass
class Disturbance:
    """Base class: no change of the machine.

    Attributes:
        kind: of the catalogue, or the name of a foreign disturbance. k: index of its coordinate and contact.
        p: its parameters. on: what a spec names as its place.
    """

    kind: str
    k: int
    p: dict[str, float]
    on: Any = ""
    stage: int = 0
    """Order in the chain of the actuator."""

    def current(self, t: float, i: float, dt: float) -> float:
        """The current that acts, of the one that is commanded; called once a step."""
        return i

    def force(self, t: float, x: Sequence[float], v: Sequence[float], drive: float) -> float:
        """Added to coordinate k."""
        return 0.0

    def level(self, t: float, s: float, u: float, load: float) -> float:
        """Added to the level of contact k; ``load`` is the drive force on it."""
        return 0.0

    def measured(self, x: float) -> float:
        """The position that the encoder of coordinate k reads."""
        return x


@dataclass
class Force(Disturbance):
    """A force that is a function of position and speed of its coordinate."""

    law: Callable[[dict[str, float], float, float], float] = lambda p, x, v: 0.0

    def force(self, t: float, x: Sequence[float], v: Sequence[float], drive: float) -> float:
        return self.law(self.p, x[self.k], v[self.k])


@dataclass
class Level(Disturbance):
    """A level that is a function of (time, slip position, slip speed, drive force)."""

    law: Callable[[dict[str, float], float, float, float, float], float] = lambda p, t, s, u, load: 0.0

    def level(self, t: float, s: float, u: float, load: float) -> float:
        return self.law(self.p, t, s, u, load)


class Viscous(Force):
    """A force of a contact that the plant integrates like any other."""


class Coupling(Disturbance):
    """−c (v₁ − v₂) on the first coordinate and + on the second; the plant asks once for each."""

    def force(self, t: float, x: Sequence[float], v: Sequence[float], drive: float) -> float:
        return -self.p["c"] * (v[0] - v[1])


@dataclass
class Delay(Disturbance):
    held: list[tuple[float, float]] = field(default_factory=list)

    def current(self, t: float, i: float, dt: float) -> float:
        self.held.append((t + self.p["T"], i))
        while len(self.held) > 1 and self.held[1][0] <= t + 1e-12:
            self.held.pop(0)
        return self.held[0][1] if self.held[0][0] <= t + 1e-12 else 0.0


@dataclass
class Lag(Disturbance):
    state: float = 0.0

    def current(self, t: float, i: float, dt: float) -> float:
        self.state += (1 - exp(-dt / self.p["tau"])) * (i - self.state)
        return self.state


@dataclass
class Static(Disturbance):
    """A current that is a function of the commanded one."""

    law: Callable[[dict[str, float], float], float] = lambda p, i: i

    def current(self, t: float, i: float, dt: float) -> float:
        return self.law(self.p, i)


class Inertia(Disturbance):
    """M_kk += delta; the plant reads it."""


class Presliding(Disturbance):
    """Dahl's law in place of the set-valued one; the plant integrates it."""


class Coupled(Disturbance):
    """A load behind a spring: (1 − ρ) M at the motor, ρ M at the load, and this force between them."""

    def between(self, d: float, dv: float) -> float:
        k, c, half = self.p["k"], self.p["c"], self.p.get("gap", 0.0) / 2
        if half == 0.0:
            return k * d + c * dv
        if d > half:
            return max(0.0, k * (d - half) + c * dv)
        return min(0.0, k * (d + half) + c * dv) if d < -half else 0.0


class Eccentric(Disturbance):
    def measured(self, x: float) -> float:
        return x + self.p["amplitude"] * sin(2 * pi * x / self.p["period"] + self.p["phase"])


def _wave(p: dict[str, float], x: float) -> float:
    return p["amplitude"] * sin(2 * pi * x / p["period"] + p["phase"])


FORCES: dict[str, Callable[[dict[str, float], float, float], float]] = {
    "viscous": lambda p, x, v: -p["b"] * v,
    "quadratic_drag": lambda p, x, v: -p["c"] * v * abs(v),
    "offset": lambda p, x, v: p["f0"],
    "cogging": lambda p, x, v: _wave(p, x),
    "gravity_imbalance": lambda p, x, v: -p["G"] * sin(x + p["phase"]),
    "spring": lambda p, x, v: -p["k"] * x,
    "hardening_spring": lambda p, x, v: -p["k3"] * x**3,
}
LEVELS: dict[str, Callable[[dict[str, float], float, float, float, float], float]] = {
    "stribeck": lambda p, t, s, u, load: p["delta"] * exp(-((u / p["v_s"]) ** 2)),
    "coulomb_asymmetry": lambda p, t, s, u, load: copysign(p["d"], p["d"] * u),
    "position_dependent_friction": lambda p, t, s, u, load: _wave(p, s),
    "load_dependent_friction": lambda p, t, s, u, load: p["mu"] * abs(load),
    "friction_drift": lambda p, t, s, u, load: p["delta"] * exp(-t / p["T"]),
}
CHAIN: dict[str, Callable[[dict[str, float], float], float]] = {
    "input_gain": lambda p, i: p["gain"] * i,
    "dead_zone": lambda p, i: copysign(max(abs(i) - p["width"], 0.0), i),
    "saturation": lambda p, i: min(max(i, -p["limit"]), p["limit"]),
}
OTHERS: dict[str, type[Disturbance]] = {
    "coupling": Coupling,
    "input_delay": Delay,
    "actuator_lag": Lag,
    "inertia_error": Inertia,
    "presliding": Presliding,
    "compliance": Coupled,
    "backlash": Coupled,
    "encoder_eccentricity": Eccentric,
}
STAGES = ("input_delay", "input_gain", "dead_zone", "saturation", "actuator_lag")


def effect(kind: str, k: int, p: dict[str, float], on: Any) -> Disturbance:
    """An effect of the catalogue."""
    stage = STAGES.index(kind) if kind in STAGES else 0
    if kind in FORCES:
        return Force(kind, k, p, on, stage, FORCES[kind])
    if kind in LEVELS:
        return Level(kind, k, p, on, stage, LEVELS[kind])
    if kind in CHAIN:
        return Static(kind, k, p, on, stage, CHAIN[kind])
    return OTHERS[kind](kind, k, p, on, stage)


@dataclass
class Heating(Disturbance):
    """A torque constant that falls with the winding's heat: kt (1 − loss·heat), T heat' = (i/rms)² − heat."""

    heat: float = 0.0

    def current(self, t: float, i: float, dt: float) -> float:
        self.heat += dt / self.p["T"] * ((i / self.p["rms"]) ** 2 - self.heat)
        return i * (1 - self.p["loss"] * min(self.heat, 2.0))


@dataclass
class Ripple(Disturbance):
    """A torque ripple that is proportional to the current: drive·share·sin(2π x/period)."""

    def force(self, t: float, x: Sequence[float], v: Sequence[float], drive: float) -> float:
        return drive * self.p["share"] * sin(2 * pi * x[self.k] / self.p["period"])


@dataclass
class Table(Disturbance):
    """A force over time, from a table with 100 values a second: gusts, or a cable that pulls now and then."""

    values: list[float] = field(default_factory=list)

    def force(self, t: float, x: Sequence[float], v: Sequence[float], drive: float) -> float:
        return self.values[min(int(100 * t), len(self.values) - 1)]


@dataclass
class Spots(Disturbance):
    """A bearing that sticks at a few places: a hump of the level at each."""

    places: tuple[float, ...] = ()

    def level(self, t: float, s: float, u: float, load: float) -> float:
        return self.p["height"] * sum(exp(-(((s - at) / self.p["width"]) ** 2)) for at in self.places)


class Slip(Coupled):
    """A belt that slips: the load is driven by a force of at most ``limit``."""

    def between(self, d: float, dv: float) -> float:
        return self.p["limit"] * float(np.tanh(dv / self.p["v0"]))
