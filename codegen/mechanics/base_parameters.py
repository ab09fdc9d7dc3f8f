"""Kinematic tree → an equal one whose joints turn about z and whose bodies have fewer inertial parameters.

Masses on the axis of a revolute joint move with the parent as well as with the body. So of each such body a line of
mass along its axis can be taken — its mass, its first and its second moment along the axis — and given to the parent
without a change of M(x) or h(x, v) (Khalil and Dombre 2002, section 9.4). The zeros that this leaves cost nothing in
the recursions. All of it in exact numbers, which are rounded to doubles once, in the recursions.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from codegen.base.exact_numbers import Exact, exact_array, square_root
from codegen.spec.kinematics import KinematicTree, MovingBody, Rows, Vector

Inertia = tuple[Fraction, Exact, Exact]
"""Mass, first moment and rotational inertia about the origin."""
ROUNDING = Fraction(1, 10**14)
"""What is smaller than this share of its terms is the rounding of a zero: files round their angles."""


def regrouped(tree: KinematicTree) -> KinematicTree:
    """The tree with the same M(x) and h(x, v); its bodies are no longer those of the machine one by one."""
    bodies = [_about_z(body) for body in tree.bodies]
    for i, body in enumerate(tree.bodies):
        if body.parent >= 0:
            turn = _turn_to(tree.bodies[body.parent].axis)
            rotation = turn.T @ exact_array(bodies[i].rotation)
            offset = turn.T @ exact_array(bodies[i].offset)
            bodies[i] = replace(bodies[i], rotation=_rows(rotation), offset=_vector(offset))
    for i, body in enumerate(bodies):
        if body.kind == "revolute":
            _slide(bodies, i)
    for i in reversed(range(len(bodies))):
        body = bodies[i]
        if body.kind != "revolute":
            continue
        line = _on_the_axis(body)
        bodies[i] = _with(body, line, -1)
        if body.parent >= 0:
            bodies[body.parent] = _with(bodies[body.parent], _in_parent(line, body), 1)
    return replace(tree, bodies=tuple(bodies))


def _about_z(body: MovingBody) -> MovingBody:
    """The body in a frame whose z axis is the joint's."""
    turn = _turn_to(body.axis)
    return replace(
        body,
        rotation=_rows(exact_array(body.rotation) @ turn),
        axis=_vector(exact_array([0, 0, 1])),
        first_moment=_vector(turn.T @ exact_array(body.first_moment)),
        inertia=_rows(turn.T @ exact_array(body.inertia) @ turn),
    )


def _slide(bodies: list[MovingBody], i: int) -> None:
    """Move a frame's origin along its joint's axis to where it is nearest the parent's: offsets of zero come of it."""
    body = bodies[i]
    up = exact_array([0, 0, 1])
    axis = exact_array(body.rotation) @ up
    offset = exact_array(body.offset)
    along = -(axis @ offset)
    d = along * up
    near = offset + along * axis
    near = _without_rounding(near, abs(along))
    first, inertia = exact_array(body.first_moment), exact_array(body.inertia)
    moved = inertia + _skew(first) @ _skew(d) + _skew(d) @ _skew(first) - body.mass * _skew(d) @ _skew(d)
    bodies[i] = replace(body, offset=_vector(near), first_moment=_vector(first - body.mass * d), inertia=_rows(moved))
    for k, child in enumerate(bodies):
        if child.parent == i:
            bodies[k] = replace(child, offset=_vector(exact_array(child.offset) - d))


def _turn_to(axis: Vector) -> Exact:
    """A rotation whose third column is the axis; a permutation with signs where the axis is one of the frame's."""
    third = exact_array(axis)
    first = exact_array(np.eye(3, dtype=int))[int(np.argmin(np.abs(third)))]
    first = first - third * (third @ first)
    first = first / square_root(first @ first)
    return np.column_stack([first, np.cross(third, first), third])


def _on_the_axis(body: MovingBody) -> Inertia:
    """The line of mass on z that leaves the body without mass, first and second moment along z."""
    inertia = exact_array(body.inertia)
    second = (inertia[0, 0] + inertia[1, 1] - inertia[2, 2]) / 2
    return body.mass, exact_array([0, 0, body.first_moment[2]]), second * exact_array(np.diag([1, 1, 0]))


def _in_parent(line: Inertia, body: MovingBody) -> Inertia:
    """In the parent's coordinates, about the parent's origin."""
    mass, moment, inertia = line
    rotation, r = exact_array(body.rotation), exact_array(body.offset)
    turned = rotation @ moment
    shifted = turned + mass * r
    moved = rotation @ inertia @ rotation.T - _skew(r) @ _skew(turned) - _skew(shifted) @ _skew(r)
    return mass, shifted, moved


def _with(body: MovingBody, more: Inertia, sign: int) -> MovingBody:
    mass, moment, inertia = more
    old, first = exact_array(body.inertia), exact_array(body.first_moment)
    return replace(
        body,
        mass=body.mass + sign * mass,
        first_moment=_vector(_without_rounding(first + sign * moment, max(abs(first).max(), abs(moment).max()))),
        inertia=_rows(_without_rounding(old + sign * inertia, max(abs(old).max(), abs(inertia).max()))),
    )


def _without_rounding(values: Exact, size: Fraction) -> Exact:
    """The values, with zeros where they are the rounding of terms of this size."""
    return np.where(abs(values) > ROUNDING * size, values, exact_array(0))


def _vector(values: Exact) -> Vector:
    x, y, z = values
    return x, y, z


def _rows(values: Exact) -> Rows:
    return _vector(values[0]), _vector(values[1]), _vector(values[2])


def _skew(r: Exact) -> Exact:
    return exact_array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
