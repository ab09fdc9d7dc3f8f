"""A kinematic tree as exact numbers: joints, and the rigid bodies that they move."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Literal

Vector = tuple[Fraction, Fraction, Fraction]
Rows = tuple[Vector, Vector, Vector]


@dataclass(frozen=True)
class MovingBody:
    """A joint and the rigid body that it moves, links fixed to each other taken as one body.

    Attributes:
        joint: an identifier made of the joint's name; ``label`` is the name itself.
        kind: revolute (a joint without limits counts as one) or prismatic.
        parent: index of the body that carries the joint, −1 for the base.
        rotation: R of the joint's frame at x = 0: parent coordinates are R times joint coordinates.
        offset: the joint frame's origin in the parent's frame, m.
        axis: of the joint, a unit vector in its own frame.
        mass: kg.
        first_moment: mass times centre of mass, in the body's frame, kg m.
        inertia: about the body frame's origin, kg m².
        limits: of the position, m or rad; None where the file has none.
        damping, friction: of ``<dynamics>``, N m s and N m (N s/m and N for a prismatic joint).
    """

    joint: str
    label: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    rotation: Rows
    offset: Vector
    axis: Vector
    mass: Fraction
    first_moment: Vector
    inertia: Rows
    damping: float = 0.0
    friction: float = 0.0
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class LinkTolerance:
    """How well the inertial parameters of the bodies are known: standard deviations, as shares.

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
    """Bodies in an order in which a parent comes before its children, and gravity in the base's frame, m/s².

    Attributes:
        file: the robot description's name; ``sha256`` is of its bytes.
        tolerance: of the bodies' inertial parameters, where the spec gives one.
        base_parameters: (name, value in SI) of those that replace the file's.
        path: of the file, where it was read from one.
    """

    bodies: tuple[MovingBody, ...]
    gravity: Vector
    file: str
    sha256: str
    tolerance: LinkTolerance | None = None
    base_parameters: tuple[tuple[str, Fraction], ...] = ()
    path: Path | None = field(default=None, compare=False)
