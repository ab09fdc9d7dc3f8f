"""A declared model of one axis in the quantities that MuJoCo has: inertia, gravity, damping, friction level, offset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from codegen.mechanics.system import System

FACTOR = 1.5
"""Each quantity may move by so much both ways from its declared value."""
FRICTION_FACTOR = 3.0
"""Friction and damping may move from 0 to this multiple of their declared value."""
OFFSET_BOUND = 1.0
"""An offset may reach this share of the friction level, both ways."""

NEAR = 1e-4
QUANTITIES = ("inertia", "moment", "damping", "level", "offset")


@dataclass(frozen=True)
class Quantity:
    """A quantity of a MuJoCo model that is fitted.

    Attributes:
        name: inertia, moment, damping, level or offset.
        symbol: parameter of the spec that it stands for; the quantity is the parameter times ``times``.
        force: whether it is friction, which may be nothing.
    """

    name: str
    symbol: str
    times: float = 1.0
    force: bool = False


@dataclass(frozen=True)
class Axis:
    """One coordinate of one input.

    Attributes:
        joint: slide or hinge. gravity: none, hanging (G sin q) or level (G cos q).
        gain: force per unit of the input.
        quantities: those that may move; others are 0.
    """

    joint: str
    gravity: str
    gain: float
    quantities: tuple[Quantity, ...]

    def task(self, system: System) -> dict[str, Any]:
        """The task for mujoco_fit.py, without the log."""
        told: dict[str, Any] = {name: {"value": 0.0, "bounds": None} for name in QUANTITIES}
        declared = values_of(system)
        for q in self.quantities:
            told[q.name] = {"value": q.times * declared[q.symbol], "bounds": self._bounds(q, declared)}
        return {"joint": self.joint, "gravity": self.gravity, "gain": self.gain, "quantities": told}

    def _bounds(self, q: Quantity, declared: Mapping[str, float]) -> list[float]:
        if q.name == "offset":
            level = next(one for one in self.quantities if one.name == "level")
            reach = OFFSET_BOUND * declared[level.symbol]
            return [-reach, reach]
        value = q.times * declared[q.symbol]
        return [0.0, FRICTION_FACTOR * value] if q.force else [value / FACTOR, FACTOR * value]

    def at_bound(self, system: System, found: Mapping[str, float]) -> tuple[str, ...]:
        """Parameters of the spec whose quantity ends at a bound."""
        declared = values_of(system)
        limits = {q.symbol: (self._bounds(q, declared), found[q.name]) for q in self.quantities}
        near = {name: NEAR * (high - low) for name, ((low, high), _) in limits.items()}
        return tuple(n for n, ((low, high), v) in limits.items() if v <= low + near[n] or v >= high - near[n])

    def refitted(self, found: Mapping[str, float]) -> dict[str, float]:
        """Values of the spec's parameters, from those of the quantities."""
        return {q.symbol: found[q.name] / q.times for q in self.quantities}


def values_of(system: System) -> dict[str, float]:
    """Name of a parameter → its value."""
    return {symbol.name: float(value) for symbol, value in system.values.items()}


def axis_of(system: System, name: str) -> Axis | None:
    """The axis of a spec of this name; None if its translation for MuJoCo is not known."""
    v = values_of(system)

    def level(symbol: str) -> Quantity:
        return Quantity("level", symbol, force=True)

    viscous = (Quantity("damping", "b", force=True),) if "b" in v else ()
    match name:
        case "one_mass_stage":
            return Axis("slide", "none", 1.0, (Quantity("inertia", "m"), *viscous, level("F1_a")))
        case "gantry_axis":
            moved = (Quantity("inertia", "M"), Quantity("damping", "Fv", force=True), level("Fc_a"))
            return Axis("slide", "none", v["kt"], moved)
        case "pendulum_arm":
            moment = Quantity("moment", "m", v["g"] * v["l"])
            return Axis("hinge", "hanging", 1.0, (Quantity("inertia", "J"), moment, *viscous, level("Fb_a")))
        case "harmonic_joint":
            moved = (Quantity("inertia", "J"), Quantity("moment", "G"), *viscous, level("Fj_a"))
            return Axis("hinge", "level", v["kt"], moved)
        case "emps":
            damping, offset = Quantity("damping", "Fv", force=True), Quantity("offset", "offset", -1.0)
            return Axis("slide", "none", v["gtau"], (Quantity("inertia", "M"), damping, offset, level("rail_a")))
        case "simple_pendulum":
            moved = (Quantity("inertia", "J"), Quantity("moment", "G"), *viscous, level("joint_a"))
            return Axis("hinge", "hanging", 1.0, moved)
    return None
