"""Kinematic tree → an equal one with fewer inertial parameters: what lies on a joint's axis moves to the parent.

Masses on the axis of a revolute joint move with the parent as well as with the body. So of each such body a line of
mass along its axis can be taken — its whole mass, its first moment along the axis, one transverse moment of inertia —
and given to the parent without a change of M(x) or h(x, v) (Khalil and Dombre 2002, section 9.4). The zeros that this
leaves cost nothing in the recursions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from codegen.spec.kinematics import KinematicTree, MovingBody

Array = NDArray[np.float64]
Inertia = tuple[float, Array, Array]
"""Mass, first moment and rotational inertia about the origin."""
ROUNDING = 1e-14
"""What is smaller than this share of its terms is the rounding of a zero."""


def regrouped(tree: KinematicTree) -> KinematicTree:
    """The tree with the same M(x) and h(x, v); its bodies are no longer those of the machine one by one."""
    bodies = list(tree.bodies)
    for i in reversed(range(len(bodies))):
        body = bodies[i]
        if body.kind != "revolute":
            continue
        line = _on_the_axis(body)
        bodies[i] = _with(body, line, -1.0)
        if body.parent >= 0:
            bodies[body.parent] = _with(bodies[body.parent], _in_parent(line, body), 1.0)
    return replace(tree, bodies=tuple(bodies))


def _on_the_axis(body: MovingBody) -> Inertia:
    axis = np.array(body.axis)
    across = np.eye(3)[np.argmin(np.abs(axis))]
    across = across - axis * (axis @ across)
    across /= np.linalg.norm(across)
    moment = float(across @ np.array(body.inertia) @ across)
    along = float(axis @ np.array(body.first_moment))
    return body.mass, along * axis, moment * (np.eye(3) - np.outer(axis, axis))


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
        first_moment=tuple(np.where(np.abs(first) > ROUNDING * length, first, 0.0).tolist()),
        inertia=tuple(tuple(row) for row in np.where(np.abs(total) > ROUNDING * size, total, 0.0).tolist()),
    )


def _skew(r: Array) -> Array:
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
