"""A robot description → its kinematic tree: fixed links merged, what cannot be a rigid mechanism refused."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.exact_numbers import Exact, exact_array, sine_cosine, square_root
from codegen.spec.kinematics import KinematicTree, MovingBody, Rows, Vector
from codegen.spec.robot_file import RobotFile

STANDARD_GRAVITY = (Fraction(0), Fraction(0), Fraction("-9.81"))
MOVING = ("revolute", "continuous", "prismatic")
TRIANGLE = 1e-3  # files round their numbers, and a thin rod or plate sits on the edge
UNIT, NOWHERE = exact_array(np.eye(3, dtype=int)), exact_array([0, 0, 0])
NO_INERTIA = exact_array(np.zeros((3, 3), dtype=int))


@dataclass
class _Body:
    """A moving body while its links are gathered: what ``MovingBody`` will hold."""

    joint: Any
    parent: int
    rotation: Exact
    offset: Exact
    mass: Fraction
    first_moment: Exact
    inertia: Exact


def read_kinematic_tree(path: Path, named_at: Place, gravity: Sequence[Fraction] = STANDARD_GRAVITY) -> KinematicTree:
    """Read a URDF file.

    Args:
        path: of the file.
        named_at: where the spec names it, for a file that cannot be read.
        gravity: in the base's frame, m/s².

    Raises:
        BadInput: for a file that is no URDF, a joint that is floating, planar or a mimic, a loop, or inertial data that
            are missing or impossible.
    """
    return _Reading(RobotFile(path, named_at)).tree(gravity)


def identifier(name: str) -> str:
    """A joint's name as an identifier: letters, digits and ``_``, starting with a letter."""
    word = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name)
    return word if word[:1].isalpha() else f"joint_{word.lstrip('_')}"


class _Reading:
    def __init__(self, file: RobotFile) -> None:
        self.file = file
        self.joints: list[Any] = file.robot.joints
        self.links: dict[str, Any] = file.robot.link_map
        self.bodies: list[_Body] = []

    def tree(self, gravity: Sequence[Fraction]) -> KinematicTree:
        root = self._root()
        waiting = [(root, -1, UNIT, NOWHERE)]
        reached = set()
        while waiting:
            link, body, rotation, offset = waiting.pop()
            reached.add(link)
            if body >= 0:
                self._add_inertia(self.bodies[body], link, rotation, offset)
            following = []
            for joint in self.joints:
                if joint.parent != link:
                    continue
                turn, shift = self._placement(joint.origin, self.file.place("joint", joint.name, "origin"))
                here, there = rotation @ turn, offset + rotation @ shift
                if self._kind(joint) == "fixed":
                    following.append((joint.child, body, here, there))
                else:
                    self.bodies.append(_Body(joint, body, here, there, Fraction(0), NOWHERE, NO_INERTIA))
                    following.append((joint.child, len(self.bodies) - 1, UNIT, NOWHERE))
            waiting += reversed(following)
        if len(reached) < len(self.links):
            lost = next(name for name in self.links if name not in reached)
            raise BadInput(
                self.file.place("link", lost),
                "a link in a closed loop of joints",
                f"a tree of links that starts at {root}",
                code="SPEC031",
            )
        if not self.bodies:
            raise BadInput(
                str(self.file.path), "no moving joint", f"at least one joint: {', '.join(MOVING)}", code="SPEC031"
            )
        digest = hashlib.sha256(self.file.content).hexdigest()
        return KinematicTree(self._moving_bodies(), _vector(gravity), self.file.path.name, digest, path=self.file.path)

    def _root(self) -> str:
        parent: dict[str, str] = {}
        for joint in self.joints:
            for end in ("parent", "child"):
                if getattr(joint, end) not in self.links:
                    place = self.file.place("joint", joint.name, end)
                    raise BadInput(place, f'unknown link "{getattr(joint, end)}"', f"a link as {end}", code="SPEC008")
            if joint.child in parent:
                found = f'link "{joint.child}" is the child of {parent[joint.child]} already'
                raise BadInput(
                    self.file.place("joint", joint.name, "child"),
                    found,
                    "exactly one joint for each moving link",
                    code="SPEC031",
                )
            parent[joint.child] = joint.name
        roots = [name for name in self.links if name not in parent]
        if len(roots) != 1:
            found = f"links {', '.join(roots)} without a parent" if roots else "no link without a parent"
            raise BadInput(
                str(self.file.path), found, "one base link, to which all others are connected", code="SPEC031"
            )
        return roots[0]

    def _kind(self, joint: Any) -> str:
        place = self.file.place("joint", joint.name)
        if joint.mimic is not None:
            raise BadInput(
                self.file.place("joint", joint.name, "mimic"),
                "a mimic joint",
                "a joint of its own, or a fixed one",
                code="SPEC031",
            )
        if joint.type not in (*MOVING, "fixed"):
            raise BadInput(place, f"a {joint.type} joint", f"one of {', '.join(MOVING)}, fixed", code="SPEC031")
        return str(joint.type)

    def _placement(self, origin: Any, place: Place) -> tuple[Exact, Exact]:
        """R and p of an ``<origin>``; roll, pitch and yaw about fixed axes x, y, z."""
        if origin is None:
            return UNIT, NOWHERE
        xyz, rpy = (self._numbers(v if v is not None else [0.0] * 3, place) for v in (origin.xyz, origin.rpy))
        (sr, cr), (sp, cp), (sy, cy) = (sine_cosine(angle) for angle in rpy)
        rotation = exact_array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return rotation, xyz

    def _add_inertia(self, body: _Body, link: str, rotation: Exact, offset: Exact) -> None:
        """Add a link that stands still on a body: I about the body's origin by the parallel-axis theorem."""
        inertial = self.links[link].inertial
        if inertial is None:
            return  # a frame without mass
        place = self.file.place("link", link, "inertial")
        mass = self._numbers([inertial.mass], self.file.place("link", link, "inertial/mass"))[0]
        if mass == 0 and inertial.inertia is not None and not np.any(inertial.inertia.to_matrix()):
            return  # the same, written with zeros
        if not mass > 0:
            raise BadInput(
                self.file.place("link", link, "inertial/mass"),
                f"a mass of {float(mass):g} kg",
                "a positive mass",
                code="SPEC032",
            )
        if inertial.inertia is None:
            raise BadInput(
                place, "<inertia> is missing", "ixx, ixy, ixz, iyy, iyz, izz about the centre of mass", code="SPEC032"
            )
        where = self.file.place("link", link, "inertial/inertia")
        about_centre = exact_array([self._numbers(row, where) for row in inertial.inertia.to_matrix()])
        try:
            smallest, middle, largest = (float(value) for value in np.linalg.eigvalsh(about_centre.astype(float)))
        except np.linalg.LinAlgError as error:
            found = f"principal moments that cannot be computed ({error})"
            raise BadInput(where, found, "a positive definite inertia", code="SPEC032") from None
        if smallest > 0 and largest > (smallest + middle) * (1 + TRIANGLE):
            found = f"principal moments {smallest:.4g}, {middle:.4g} and {largest:.4g} kg m^2"
            raise BadInput(
                where, found, "those of a real body: the largest is at most the sum of the other two", code="SPEC032"
            )
        if not smallest > 0:
            found = f"an inertia with the principal moment {smallest:.4g} kg m^2"
            raise BadInput(where, found, "a positive definite inertia", code="SPEC032")
        turn, centre = self._placement(inertial.origin, self.file.place("link", link, "inertial/origin"))
        turn, c = rotation @ turn, offset + rotation @ centre
        body.mass += mass
        body.first_moment = body.first_moment + mass * c
        body.inertia = body.inertia + turn @ about_centre @ turn.T + mass * (c @ c * UNIT - np.outer(c, c))

    def _moving_bodies(self) -> tuple[MovingBody, ...]:
        names: dict[str, str] = {}
        result = []
        for body in self.bodies:
            joint, place = body.joint, self.file.place("joint", body.joint.name)
            name = identifier(joint.name)
            if name in names:
                found = f'joints "{names[name]}" and "{joint.name}" both read as {name}'
                raise BadInput(place, found, "names that differ in letters and digits", code="SPEC009")
            names[name] = joint.name
            if not body.mass > 0:
                found = f'link "{joint.child}" and the links fixed to it have no mass'
                raise BadInput(
                    self.file.place("link", joint.child), found, "<inertial> with mass and inertia", code="SPEC032"
                )
            result.append(
                MovingBody(
                    joint=name,
                    label=joint.name,
                    kind="prismatic" if joint.type == "prismatic" else "revolute",
                    parent=body.parent,
                    rotation=_rows(body.rotation),
                    offset=_vector(body.offset),
                    axis=_vector(self._axis(joint)),
                    mass=body.mass,
                    first_moment=_vector(body.first_moment),
                    inertia=_rows(body.inertia),
                    damping=self._dynamics(joint, "damping"),
                    friction=self._dynamics(joint, "friction"),
                    limits=self.file.limits.get(joint.name),
                )
            )
        return tuple(result)

    def _axis(self, joint: Any) -> Exact:
        place = self.file.place("joint", joint.name, "axis")
        axis = self._numbers(joint.axis if joint.axis is not None else [1.0, 0.0, 0.0], place)
        length = square_root(axis @ axis)
        if not length > 0:
            raise BadInput(place, "an axis of zeros", "a direction", code="SPEC031")
        return cast(Exact, axis / length)

    def _dynamics(self, joint: Any, name: str) -> float:
        place = self.file.place("joint", joint.name, "dynamics")
        value = getattr(joint.dynamics, name, None) if joint.dynamics is not None else None
        number = float(self._numbers([value or 0.0], place)[0])
        if number < 0:
            raise BadInput(place, f"{name} {number:g}", "zero or a positive number", code="SPEC007")
        return number

    def _numbers(self, values: Any, place: Place) -> Exact:
        numbers = np.array(values, dtype=float)
        if not np.isfinite(numbers).all():
            raise BadInput(place, f"{' '.join(map(str, values))}", "finite numbers", code="SPEC006")
        return exact_array([float(number) for number in numbers])


def _vector(values: Sequence[Fraction] | Exact) -> Vector:
    return cast(Vector, tuple(values))


def _rows(matrix: Exact) -> Rows:
    return cast(Rows, tuple(_vector(row) for row in matrix))
