"""Rigid bodies and joints of a machine, for multibody simulators, and numbers as their files have them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from codegen.base.arrays import Array
from codegen.base.rotations import quaternion, roll_pitch_yaw
from codegen.export.mechanism import Mechanism

MARGIN = 1e-9
"""Relative margin in the triangle inequality of principal moments."""
APART = 0.3
"""Metres between the bodies of a machine that has no robot file, to see them."""


def number(value: float) -> str:
    """The shortest decimal of a double; whole numbers without a point."""
    value = float(value) + 0.0
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def numbers(values: ArrayLike) -> str:
    """A number, or several with spaces between."""
    return " ".join(number(v) for v in np.ravel(values))


@dataclass(frozen=True)
class Link:
    """A body and the joint between it and its parent.

    Attributes:
        name: of the joint and the coordinate.
        parent: index of the parent link, −1 for the base.
        turns: whether the joint is revolute; else it is prismatic.
        offset, rotation: position in m, and orientation matrix, of the joint's frame in the parent's.
        axis: of the joint, in its frame.
        mass, centre, inertia: of the body; the inertia is about the centre of mass.
    """

    name: str
    parent: int
    turns: bool
    offset: Array
    rotation: Array
    axis: Array
    mass: float
    centre: Array
    inertia: Array

    # As text, for templates.

    @property
    def quat(self) -> str:
        """Orientation as a quaternion w, x, y, z."""
        return numbers(quaternion(self.rotation))

    @property
    def rpy(self) -> str:
        """Orientation as roll, pitch and yaw about fixed axes, rad."""
        return numbers(roll_pitch_yaw(self.rotation))

    @property
    def full(self) -> str:
        """Entries xx, yy, zz, xy, xz, yz of the inertia tensor."""
        i = self.inertia
        return numbers([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]])

    @property
    def moments(self) -> list[tuple[str, str]]:
        """Names and values of the inertia tensor's entries."""
        places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        return [(name, number(self.inertia[at])) for name, at in places.items()]


def links_of(mechanism: Mechanism) -> list[Link]:
    """The bodies in the order of the coordinates."""
    if mechanism.tree is None:
        units = zip(mechanism.system.positions, mechanism.system.position_units, mechanism.inertias, strict=True)
        return [_plain(k, x.name, unit == "rad", inertia) for k, (x, unit, inertia) in enumerate(units)]
    found = []
    for body in mechanism.tree.bodies:
        c, inertia = body.centre.astype(float), physical_inertia(body.about_centre.astype(float))
        frame, axis = np.array(body.frame, dtype=float), np.array(body.axis, dtype=float)
        pose = body.kind == "revolute", frame[:3, 3], frame[:3, :3], axis
        found.append(Link(body.joint, body.parent, *pose, float(body.mass), c, inertia))
    return found


def physical_inertia(inertia: Array) -> Array:
    """The inertia tensor (3, 3), corrected to satisfy the triangle inequality of principal moments.

    Simulators refuse a tensor whose largest principal moment exceeds the sum of the others. Rounded numbers of a robot
    file may violate this for a thin plate. The two smaller moments are then raised; the reader of robot files accepts
    violations of up to 1e-3 of the largest moment.
    """
    moments, axes = np.linalg.eigh(inertia)
    lacking = moments[2] * (1 + MARGIN) - moments[0] - moments[1]
    if lacking <= 0:
        return inertia
    moments[:2] += lacking / 2
    return np.asarray((axes * moments) @ axes.T)


def principal(inertia: Array) -> tuple[Array, Array]:
    """Principal moments (3,) and rotation (3, 3) whose columns are their axes."""
    moments, axes = np.linalg.eigh(inertia)
    return moments, axes * np.sign(np.linalg.det(axes))


def _plain(index: int, name: str, turns: bool, inertia: float) -> Link:
    """A body on a prismatic joint along x, or a revolute joint about z, at the base."""
    axis = np.array([0.0, 0.0, 1.0] if turns else [1.0, 0.0, 0.0])
    mass, size = (1.0, inertia) if turns else (inertia, 1.0)
    offset = np.array([0.0, round(APART * index, 1), 0.0])
    return Link(name, -1, turns, offset, np.eye(3), axis, mass, np.zeros(3), size * np.eye(3))
