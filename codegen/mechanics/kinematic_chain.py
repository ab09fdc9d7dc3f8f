"""Mass matrix M(x) and bias force h(x, v) of a kinematic tree, in CasADi SX.

M is computed by the composite-rigid-body algorithm and h by the recursive Newton–Euler algorithm (Featherstone 2008,
sections 6.2 and 5.3), in body coordinates. The recursion uses accelerations of points, so it needs no linear velocity.

A body's inertia is stored as its second moment Σ = ∫ρ r r'; the inertia tensor is tr(Σ) 1 − Σ. A point r of the body
has the acceleration U r relative to the body's origin, with U = [ω'] + [ω]² and [·] the matrix of a cross product. From
the nine entries of U follow both the force U ∫ρ r and the moment, the axial vector of UΣ − ΣU'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import casadi

from codegen.base.exact_numbers import exact_array
from codegen.spec.motion import KinematicTree, MovingBody

ROUNDING = Fraction(1, 10**14)
"""Share of the largest second moment up to which a second moment is set to zero, as a rounding error."""


@dataclass(frozen=True)
class Points:
    """Mass, first moment ∫ρ r (3 by 1) and second moment Σ (3 by 3, symmetric) of a body about its frame's origin."""

    mass: Any
    first: Any
    second: Any

    def __add__(self, other: Points) -> Points:
        return Points(self.mass + other.mass, self.first + other.first, self.second + other.second)


@dataclass(frozen=True)
class Joint:
    """Position of a body relative to its parent, at the present joint position.

    Attributes:
        rotation: R, 3 by 3, from the body's coordinates to the parent's.
        origin: r, 3 by 1, the body's origin in the parent's frame, m.
        axis: unit vector of the joint in the body's frame.
        placed: R at joint position zero.
        position: of the joint, rad or m.
    """

    rotation: Any
    origin: Any
    axis: Any
    revolute: bool
    placed: Any
    position: Any

    def points_to_parent(self, points: Points) -> Points:
        """Moments of the body in the parent's coordinates and about the parent's origin."""
        turned, r = self.rotation @ points.first, self.origin
        mixed = turned @ r.T
        second = self._turned(points.second) + mixed + mixed.T + points.mass * (r @ r.T)
        return Points(points.mass, turned + points.mass * r, casadi.tril2symm(casadi.tril(second)))

    def _turned(self, s: Any) -> Any:
        """R Σ R'. For a revolute joint about z only four products depend on the joint position."""
        if not self.revolute or not _is_z(self.axis):
            return casadi.tril2symm(casadi.tril(self.rotation @ s @ self.rotation.T))
        c, d = casadi.cos(self.position), casadi.sin(self.position)
        along = c * (s[0, 0] - s[1, 1]) - d * (2 * s[1, 0])
        x, y = c * s[2, 0] - d * s[2, 1], d * s[2, 0] + c * s[2, 1]
        m = casadi.SX(3, 3)
        m[0, 0], m[1, 0], m[1, 1] = s[1, 1] + c * along, s[1, 0] + d * along, s[0, 0] - c * along
        m[2, 0], m[2, 1], m[2, 2] = x, y, s[2, 2]
        m = casadi.tril2symm(m)
        return casadi.tril2symm(casadi.tril(self.placed @ m @ self.placed.T))

    def wrench_to_parent(self, moment: Any, force: Any) -> tuple[Any, Any]:
        """Moment and force on the body in the parent's coordinates, the moment about the parent's origin."""
        turned = self.rotation @ force
        return self.rotation @ moment + casadi.cross(self.origin, turned), turned


def mass_matrix(tree: KinematicTree, positions: Any, masses: Sequence[Points]) -> Any:
    """The mass matrix M(x), n by n SX, symmetric; zeros for every x are structural zeros.

    Args:
        positions: x, n by 1 SX, rad or m.
        masses: moments of the bodies.
    """
    bodies = tree.bodies
    joints = [_joint(b, positions[i]) for i, b in enumerate(bodies)]
    composite = list(masses)
    for i in reversed(range(len(bodies))):
        if bodies[i].parent >= 0:
            composite[bodies[i].parent] += joints[i].points_to_parent(composite[i])
    mass = casadi.SX(len(bodies), len(bodies))
    for i in range(len(bodies)):
        moment, force = _unit_acceleration(joints[i], composite[i])
        mass[i, i] = _along(joints[i], moment, force)
        j = i
        while bodies[j].parent >= 0:
            moment, force = joints[j].wrench_to_parent(moment, force)
            j = bodies[j].parent
            mass[i, j] = mass[j, i] = _along(joints[j], moment, force)
    return casadi.sparsify(mass)


def bias_force(tree: KinematicTree, positions: Any, velocities: Any, masses: Sequence[Points]) -> Any:
    """The bias force h(x, v) of gravity, centrifugal and Coriolis forces: the joint forces that give v' = 0.

    n by 1 SX, N m on rotations, N on translations; the arguments are those of ``mass_matrix``, and v.
    """
    bodies = tree.bodies
    joints = [_joint(b, positions[i]) for i, b in enumerate(bodies)]
    motions: list[tuple[Any, Any, Any, Any]] = []  # ω, ω', U and the acceleration of the origin
    wrenches: list[tuple[Any, Any]] = []
    for i, body in enumerate(bodies):
        joint, rate = joints[i], velocities[i]
        back = joint.rotation.T
        if body.parent < 0:  # gravity as an upward acceleration of the base
            w, dw, a = casadi.SX(3, 1), casadi.SX(3, 1), back @ -_column(tree.gravity)
        else:
            turning, angular, tensor, origin = motions[body.parent]
            w, dw, a = back @ turning, back @ angular, back @ (origin + tensor @ joint.origin)
        across = casadi.cross(w, joint.axis) * rate
        if joint.revolute:
            w, dw = w + joint.axis * rate, dw + across
        else:
            a = a + 2 * across
        u = _acceleration_tensor(w, dw)
        motions.append((w, dw, u, a))
        moment = _moment(u, masses[i].second) + casadi.cross(masses[i].first, a)
        wrenches.append((moment, masses[i].mass * a + u @ masses[i].first))
    bias = casadi.SX(len(bodies), 1)
    for i in reversed(range(len(bodies))):
        bias[i] = _along(joints[i], *wrenches[i])
        p = bodies[i].parent
        if p >= 0:
            moment, force = joints[i].wrench_to_parent(*wrenches[i])
            wrenches[p] = (wrenches[p][0] + moment, wrenches[p][1] + force)
    return casadi.sparsify(bias)


def _acceleration_tensor(w: Any, dw: Any) -> Any:
    """U: the acceleration of a point r of the body, less that of its origin, is U r."""
    x, y, z = w[0], w[1], w[2]
    rows = [
        [-(y * y + z * z), x * y - dw[2], x * z + dw[1]],
        [x * y + dw[2], -(x * x + z * z), y * z - dw[0]],
        [x * z - dw[1], y * z + dw[0], -(x * x + y * y)],
    ]
    return casadi.vertcat(*[casadi.horzcat(*row) for row in rows])


def _moment(u: Any, s: Any) -> Any:
    """The vector of UΣ − ΣU'."""
    return casadi.vertcat(
        s[1, 1] * u[2, 1] - s[2, 2] * u[1, 2] + s[0, 1] * u[2, 0] - s[0, 2] * u[1, 0] + s[1, 2] * (u[2, 2] - u[1, 1]),
        s[2, 2] * u[0, 2] - s[0, 0] * u[2, 0] + s[1, 2] * u[0, 1] - s[0, 1] * u[2, 1] + s[0, 2] * (u[0, 0] - u[2, 2]),
        s[0, 0] * u[1, 0] - s[1, 1] * u[0, 1] + s[0, 2] * u[1, 2] - s[1, 2] * u[0, 2] + s[0, 1] * (u[1, 1] - u[0, 0]),
    )


def _unit_acceleration(joint: Joint, points: Points) -> tuple[Any, Any]:
    """Moment and force that give a body at rest one unit of acceleration along the joint."""
    if not joint.revolute:
        return casadi.cross(points.first, joint.axis), points.mass * joint.axis
    moment = casadi.trace(points.second) * joint.axis - points.second @ joint.axis
    if _is_z(joint.axis):
        moment[2] = points.second[0, 0] + points.second[1, 1]
    return moment, casadi.cross(joint.axis, points.first)


def _along(joint: Joint, moment: Any, force: Any) -> Any:
    """Generalised force of a joint: the component of the moment (revolute) or force (prismatic) along its axis."""
    return casadi.dot(joint.axis, moment if joint.revolute else force)


def _joint(body: MovingBody, position: Any) -> Joint:
    """The Joint of a body at a joint position: the fixed placement in the parent, then the joint's motion."""
    frame, axis = exact_array(body.frame), casadi.DM([float(c) for c in body.axis])
    placed, offset = _matrix(frame[:3, :3]), _column(frame[:3, 3])
    if body.kind == "prismatic":
        return Joint(placed, offset + placed @ casadi.SX(axis) * position, casadi.SX(axis), False, placed, position)
    along = axis @ axis.T
    # Rodrigues' formula; entries that do not depend on the position stay numbers, so that zeros stay structural zeros.
    turned = along + casadi.cos(position) * (casadi.DM.eye(3) - along) + casadi.sin(position) * casadi.skew(axis)
    rotation = placed @ casadi.densify(casadi.SX(turned))
    return Joint(rotation, offset, casadi.SX(axis), True, placed, position)


def _is_z(axis: Any) -> bool:
    """Whether an axis is the z axis exactly."""
    return bool(casadi.DM(axis)[0] == 0 and casadi.DM(axis)[1] == 0 and casadi.DM(axis)[2] == 1)


def points_of(body: MovingBody) -> Points:
    """Mass moments of a body as doubles; up to here its numbers are exact."""
    moments = exact_array(body.moments)
    first, second = moments[3, :3], moments[:3, :3]
    for k in range(3):
        if abs(second[k, k]) <= ROUNDING * abs(second).max():
            second[k, k] = Fraction(0)
    return Points(casadi.SX(float(body.mass)), _column(first), _matrix(second))


def _column(values: Any) -> Any:
    """Exact numbers as a column of doubles, SX."""
    return casadi.SX(casadi.DM([float(value) for value in values]))


def _matrix(rows: Any) -> Any:
    """Rows of exact numbers as a matrix of doubles, SX."""
    return casadi.SX(casadi.DM([[float(value) for value in row] for row in rows]))
