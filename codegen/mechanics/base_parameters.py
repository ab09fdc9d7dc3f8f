"""Kinematic tree → an equal one whose joints turn about z and whose bodies have fewer inertial parameters.

Masses on the axis of a revolute joint move with the parent as well as with the body. So of each such body a line of
mass along its axis can be taken — its mass, its first and its second moment along the axis — and given to the parent
without a change of M(x) or h(x, v) (Khalil and Dombre 2002, section 9.4). The zeros that this leaves cost nothing in
the recursions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from codegen.spec.kinematics import KinematicTree, MovingBody, Rows, Vector

Array = NDArray[np.float64]
Inertia = tuple[float, Array, Array]
"""Mass, first moment and rotational inertia about the origin."""
ROUNDING = 1e-14
"""What is smaller than this share of its terms is the rounding of a zero."""


def regrouped(tree: KinematicTree) -> KinematicTree:
    """The tree with the same M(x) and h(x, v); its bodies are no longer those of the machine one by one."""
    bodies = [_about_z(body) for body in tree.bodies]
    for i, body in enumerate(tree.bodies):
        if body.parent >= 0:
            turn = _turn_to(tree.bodies[body.parent].axis)
            rotation = turn.T @ np.array(bodies[i].rotation)
            offset = turn.T @ np.array(bodies[i].offset)
            bodies[i] = replace(bodies[i], rotation=_rows(rotation), offset=_vector(offset))
    for i, body in enumerate(bodies):
        if body.kind == "revolute":
            _slide(bodies, i)
    for i in reversed(range(len(bodies))):
        body = bodies[i]
        if body.kind != "revolute":
            continue
        line = _on_the_axis(body)
        bodies[i] = _with(body, line, -1.0)
        if body.parent >= 0:
            bodies[body.parent] = _with(bodies[body.parent], _in_parent(line, body), 1.0)
    return replace(tree, bodies=tuple(bodies))


def _about_z(body: MovingBody) -> MovingBody:
    """The body in a frame whose z axis is the joint's."""
    turn = _turn_to(body.axis)
    return replace(
        body,
        rotation=_rows(np.array(body.rotation) @ turn),
        axis=(0.0, 0.0, 1.0),
        first_moment=_vector(turn.T @ np.array(body.first_moment)),
        inertia=_rows(turn.T @ np.array(body.inertia) @ turn),
    )


def _slide(bodies: list[MovingBody], i: int) -> None:
    """Move a frame's origin along its joint's axis to where it is nearest the parent's: offsets of zero come of it."""
    body = bodies[i]
    up = np.array([0.0, 0.0, 1.0])
    axis = np.array(body.rotation) @ up
    offset = np.array(body.offset)
    along = -float(axis @ offset)
    d = along * up
    near = offset + along * axis
    near = np.where(np.abs(near) > ROUNDING * abs(along), near, 0.0)
    first, inertia = np.array(body.first_moment), np.array(body.inertia)
    moved = inertia + _skew(first) @ _skew(d) + _skew(d) @ _skew(first) - body.mass * _skew(d) @ _skew(d)
    bodies[i] = replace(body, offset=_vector(near), first_moment=_vector(first - body.mass * d), inertia=_rows(moved))
    for k, child in enumerate(bodies):
        if child.parent == i:
            bodies[k] = replace(child, offset=_vector(np.array(child.offset) - d))


def _turn_to(axis: Vector) -> Array:
    """A rotation whose third column is the axis; a permutation with signs where the axis is one of the frame's."""
    third = np.array(axis)
    first = np.eye(3)[int(np.argmin(np.abs(third)))]
    first = first - third * (third @ first)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(third, first), third])


def _on_the_axis(body: MovingBody) -> Inertia:
    """The line of mass on z that leaves the body without mass, first and second moment along z."""
    inertia = np.array(body.inertia)
    second = float(inertia[0, 0] + inertia[1, 1] - inertia[2, 2]) / 2
    return body.mass, np.array([0.0, 0.0, body.first_moment[2]]), second * np.diag([1.0, 1.0, 0.0])


def _in_parent(line: Inertia, body: MovingBody) -> Inertia:
    """In the parent's coordinates, about the parent's origin."""
    mass, moment, inertia = line
    rotation, r = np.array(body.rotation), np.array(body.offset)
    turned = rotation @ moment
    shifted = turned + mass * r
    moved = rotation @ inertia @ rotation.T - _skew(r) @ _skew(turned) - _skew(shifted) @ _skew(r)
    return mass, shifted, moved


def _with(body: MovingBody, more: Inertia, sign: float) -> MovingBody:
    mass, moment, inertia = more
    total = np.array(body.inertia) + sign * inertia
    size = max(1e-300, float(np.abs(body.inertia).max()), float(np.abs(inertia).max()))
    first = np.array(body.first_moment) + sign * moment
    length = max(1e-300, float(np.abs(body.first_moment).max()), float(np.abs(moment).max()))
    return replace(
        body,
        mass=float(body.mass + sign * mass),
        first_moment=_vector(np.where(np.abs(first) > ROUNDING * length, first, 0.0)),
        inertia=_rows(np.where(np.abs(total) > ROUNDING * size, total, 0.0)),
    )


def _vector(values: Array) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _rows(values: Array) -> Rows:
    return _vector(values[0]), _vector(values[1]), _vector(values[2])


def _skew(r: Array) -> Array:
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
