"""A kinematic tree as numbers: joints, and the rigid bodies that they move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Vector = tuple[float, float, float]
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
        damping, friction: of ``<dynamics>``, N m s and N m (N s/m and N for a prismatic joint).
    """

    joint: str
    label: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    rotation: Rows
    offset: Vector
    axis: Vector
    mass: float
    first_moment: Vector
    inertia: Rows
    damping: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True)
class KinematicTree:
    """Bodies in an order in which a parent comes before its children, and gravity in the base's frame, m/s².

    Attributes:
        file: the robot description's name; ``sha256`` is of its bytes.
    """

    bodies: tuple[MovingBody, ...]
    gravity: Vector
    file: str
    sha256: str
