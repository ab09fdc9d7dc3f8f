"""The ways to state an equation of motion, in typed form; ``mechanics`` turns each into M, g and U."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy

from codegen.spec.kinematics import KinematicTree

GROUND = "ground"
TRANSLATIONS = ("x", "y", "z")
DIRECTIONS = (*TRANSLATIONS, "angle")
RATES = {"x": "vx", "y": "vy", "z": "vz", "angle": "rate"}


@dataclass(frozen=True)
class Body:
    """A rigid body: its mass, its moment of inertia about its centre of gravity, and where it is.

    Attributes:
        mass: kg, over parameters; zero where the body has no x, y or z.
        inertia: kg*m^2, over parameters; zero where the body has no angle.
        positions: direction (x, y, z in m; angle in rad) → position of the centre of gravity. In a topology a symbol;
            under constraints an expression over the coordinates, x(q) of (A.56).
    """

    name: str
    mass: sympy.Expr
    inertia: sympy.Expr
    positions: Mapping[str, sympy.Expr]

    def weight(self, direction: str) -> sympy.Expr:
        """The mass, or the moment of inertia where the direction is ``angle``."""
        return self.inertia if direction == "angle" else self.mass


@dataclass(frozen=True)
class Topology:
    """Bodies without constraints, A.1.1 to A.1.4.

    Attributes:
        transform: T of x = T x̄ (A.37), coordinates by positions of the bodies in their order; None for the identity,
            where each position is a coordinate.
    """

    bodies: tuple[Body, ...]
    transform: sympy.ImmutableMatrix | None


@dataclass(frozen=True)
class Constraints:
    """Bodies whose positions are functions of the coordinates, A.1.5.

    Attributes:
        force: (body, direction) → force or torque on it, g_x of (A.54), over coordinates, velocities and inputs.
        equations: left sides of ψ(x) = 0 (A.47), over the symbols ``position_symbol`` of the bodies.
    """

    bodies: tuple[Body, ...]
    force: Mapping[tuple[str, str], sympy.Expr]
    equations: tuple[sympy.Expr, ...]


@dataclass(frozen=True)
class Lagrangian:
    """L = E − V.

    Attributes:
        kinetic: E(x, v) in J.
        potential: V(x) in J.
    """

    kinetic: sympy.Expr
    potential: sympy.Expr


Form = Topology | Constraints | Lagrangian | KinematicTree


@dataclass(frozen=True)
class Sliding:
    """Between which bodies a contact acts, and in which direction.

    Attributes:
        bodies: one (against the ground) or two; the slip velocity is the first's velocity less the second's (A.7).
        along: direction → its part in the slip velocity; x: 1 and angle: −r is the rim of a wheel on the ground.
    """

    bodies: tuple[str, ...]
    along: Mapping[str, sympy.Expr]


def position_name(body: str, direction: str) -> str:
    """What a body's position is called in expressions of ``constraints:``."""
    return f"{body}_{direction}"


def rate_name(body: str, direction: str) -> str:
    """What a body's velocity is called in expressions of ``constraints:``."""
    return f"{body}_{RATES[direction]}"
