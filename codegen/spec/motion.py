"""Typed forms of an equation of motion in a spec, from which ``mechanics`` derives M, g and U.

Topology, constraints, Lagrangian, and the kinematic tree of a robot file, in exact numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np
import sympy

from codegen.base.exact_numbers import Exact, exact_array

Vector = tuple[Fraction, Fraction, Fraction]
Rows = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class MovingBody:
    """A joint and the rigid body that it moves; links that are fixed to each other are one body.

    Attributes:
        joint: the coordinate's name, an identifier made of the joint's name.
        label: the joint's name in the file.
        kind: revolute (also continuous) or prismatic.
        parent: index of the body that carries the joint, −1 for the base.
        frame: pose of the joint's frame at x = 0 in the parent's, as of ``pose``.
        axis: of the joint, a unit vector in its own frame.
        moments: J = ∫ρ (r, 1)(r, 1)', 4 by 4, over the points r of the body in its frame: its second moments ∫ρ r r' in
            kg m², first moments in kg m, and mass in kg.
        limits: of the position, m or rad, or None.
        damping, friction: of ``<dynamics>``, N m s and N m (N s/m and N for a prismatic joint).
    """

    joint: str
    label: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    frame: Rows
    axis: Vector
    moments: Rows
    damping: float = 0.0
    friction: float = 0.0
    limits: tuple[float, float] | None = None

    @property
    def mass(self) -> Fraction:
        """Mass, kg."""
        return self.moments[3][3]

    @property
    def centre(self) -> Exact:
        """Centre of mass, in the body's frame, m."""
        return np.asarray(exact_array(self.moments[3][:3]) / self.mass)

    @property
    def about_centre(self) -> Exact:
        """Inertia about the centre of mass; exact, since it is a small difference if the frame is far away."""
        second = exact_array(self.moments)[:3, :3] - self.mass * np.outer(self.centre, self.centre)
        return np.asarray(second.trace() * exact_array(np.eye(3, dtype=int)) - second)


def moments_of(mass: Fraction, centre: Exact, about_centre: Exact) -> Exact:
    """J of ``MovingBody`` from the mass, the centre of mass and the inertia about it."""
    second = about_centre.trace() / 2 * exact_array(np.eye(3, dtype=int)) - about_centre
    first = mass * centre
    return np.block([[second + np.outer(first, centre), first[:, None]], [first, mass]])


def pose(rotation: Exact, offset: Exact) -> Exact:
    """T = [R o; 0 1], 4 by 4: outer coordinates (r, 1) are T times inner ones; moments J become T J T'."""
    return np.block([[rotation, offset[:, None]], [exact_array([0, 0, 0, 1])]])


def vector(values: Any) -> Vector:
    """A tuple of three numbers."""
    x, y, z = values
    return x, y, z


def rows(values: Any) -> Rows:
    """A matrix as a tuple of rows."""
    return tuple(map(tuple, values))


@dataclass(frozen=True)
class LinkTolerance:
    """Uncertainty of the bodies' inertial parameters: relative standard deviations.

    Attributes:
        mass: of each mass.
        centre_of_mass: of the distance of the centre of mass from the joint frame's origin, in each direction.
        inertia: of the inertia about the centre of mass; entry ij as a share of √(I_ii I_jj).
    """

    mass: float = 0.0
    centre_of_mass: float = 0.0
    inertia: float = 0.0


@dataclass(frozen=True)
class KinematicTree:
    """Kinematic tree of a robot file.

    Attributes:
        bodies: in an order in which a parent precedes its children.
        gravity: in the base's frame, m/s².
        file, sha256: name of the robot description, and hash of its bytes.
        tolerance: of the bodies' inertial parameters, or None.
        base_parameters: (name, value in SI) of base parameters that replace those of the file.
        path: of the file, or None.
    """

    bodies: tuple[MovingBody, ...]
    gravity: Vector
    file: str
    sha256: str
    tolerance: LinkTolerance | None = None
    base_parameters: tuple[tuple[str, Fraction], ...] = ()
    path: Path | None = field(default=None, compare=False)


GROUND = "ground"
TRANSLATIONS = ("x", "y", "z")
DIRECTIONS = (*TRANSLATIONS, "angle")
RATES = {"x": "vx", "y": "vy", "z": "vz", "angle": "rate"}


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Attributes:
        mass: kg, over parameters; zero if the body has no x, y or z.
        inertia: about the centre of gravity, kg*m^2, over parameters; zero if the body has no angle.
        positions: direction (x, y, z in m; angle in rad) → position of the centre of gravity: in a topology a
            coordinate; under constraints an expression over the coordinates, x(q) of (A.56).
    """

    name: str
    mass: sympy.Expr
    inertia: sympy.Expr
    positions: Mapping[str, sympy.Expr]


@dataclass(frozen=True)
class Topology:
    """Bodies without constraints, whose positions are the coordinates; appendix A.1.1 to A.1.3 of the thesis."""

    bodies: tuple[Body, ...]


@dataclass(frozen=True)
class Constraints:
    """Bodies whose positions are functions of the coordinates (holonomic constraints), A.1.5.

    Attributes:
        force: (body, direction) → force or torque on it, g_x of (A.54), over coordinates, velocities and inputs.
        equations: left sides of ψ(x) = 0 (A.47), over the positions of the bodies (``position_name``).
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
    """The bodies and the direction of a contact.

    Attributes:
        bodies: one (against the ground) or two; the slip velocity is that of the first minus that of the second (A.7).
        along: direction → coefficient in the slip velocity; x: 1 and angle: −r for the rim of a wheel on the ground.
    """

    bodies: tuple[str, ...]
    along: Mapping[str, sympy.Expr]


def position_name(body: str, direction: str) -> str:
    """The name of a body's position in expressions of ``constraints:``."""
    return f"{body}_{direction}"


def rate_name(body: str, direction: str) -> str:
    """The name of a body's velocity in expressions of ``constraints:``."""
    return f"{body}_{RATES[direction]}"
