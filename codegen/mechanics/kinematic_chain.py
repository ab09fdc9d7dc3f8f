"""Kinematic tree → M(x) and the bias force h(x, v) in CasADi SX.

Composite-rigid-body algorithm for M, recursive Newton–Euler for h (Featherstone 2008, tables 6.2 and 5.1), both in body
coordinates.
"""

from __future__ import annotations

from typing import Any

import casadi

from codegen.mechanics.spatial import JointTransform, Spatial, SpatialInertia
from codegen.spec.kinematics import KinematicTree, MovingBody


def mass_matrix(tree: KinematicTree, positions: Any) -> Any:
    """M(x) by the composite-rigid-body algorithm.

    Args:
        positions: x, n by 1 SX, rad or m.

    Returns:
        n by n SX, symmetric, kg m² on rotations; entries that are zero for every x are structural zeros.
    """
    bodies = tree.bodies
    transforms = [joint_transform(b, positions[i]) for i, b in enumerate(bodies)]
    composite = [_inertia(b) for b in bodies]
    for i in reversed(range(len(bodies))):
        if bodies[i].parent >= 0:
            composite[bodies[i].parent] += transforms[i].inertia_to_parent(composite[i])
    mass = casadi.SX(len(bodies), len(bodies))
    for i, body in enumerate(bodies):
        force = composite[i].times(motion_subspace(body))
        mass[i, i] = motion_subspace(body).dot(force)
        j = i
        while bodies[j].parent >= 0:
            force = transforms[j].force_to_parent(force)
            j = bodies[j].parent
            mass[i, j] = mass[j, i] = motion_subspace(bodies[j]).dot(force)
    return casadi.sparsify(mass)


def bias_force(tree: KinematicTree, positions: Any, velocities: Any) -> Any:
    """h(x, v): what the joints must give for v' = 0 — gravity, centrifugal and Coriolis forces.

    Args:
        positions, velocities: x and v, n by 1 SX.

    Returns:
        n by 1 SX, N m on rotations, N on translations.
    """
    bodies = tree.bodies
    transforms = [joint_transform(b, positions[i]) for i, b in enumerate(bodies)]
    motion: list[Spatial] = []
    acceleration: list[Spatial] = []
    forces: list[Spatial] = []
    # A base that accelerates upwards feels like gravity.
    base = Spatial(casadi.SX.zeros(3), -_column(tree.gravity))
    for i, body in enumerate(bodies):
        moved_by = motion_subspace(body).times(velocities[i])
        at_rest = body.parent < 0
        velocity = moved_by if at_rest else transforms[i].motion(motion[body.parent]) + moved_by
        carried = transforms[i].motion(base if at_rest else acceleration[body.parent])
        inertia = _inertia(body)
        motion.append(velocity)
        acceleration.append(carried + velocity.cross_motion(moved_by))
        forces.append(inertia.times(acceleration[i]) + velocity.cross_force(inertia.times(velocity)))
    bias = casadi.SX(len(bodies), 1)
    for i in reversed(range(len(bodies))):
        bias[i] = motion_subspace(bodies[i]).dot(forces[i])
        if bodies[i].parent >= 0:
            forces[bodies[i].parent] += transforms[i].force_to_parent(forces[i])
    return casadi.sparsify(bias)


def motion_subspace(body: MovingBody) -> Spatial:
    """S of a joint: the motion that its unit velocity makes."""
    axis, still = _column(body.axis), casadi.SX.zeros(3)
    return Spatial(axis, still) if body.kind == "revolute" else Spatial(still, axis)


def joint_transform(body: MovingBody, position: Any) -> JointTransform:
    """X(x) of a joint: its fixed placement, then its own motion."""
    placed = _matrix(body.rotation)
    axis = casadi.DM(body.axis)
    if body.kind == "prismatic":
        return JointTransform(placed.T, _column(body.offset) + placed @ _column(body.axis) * position)
    along = axis @ axis.T
    # Rodrigues; what the axis leaves alone stays a number, so that zeros of the rotation stay zeros.
    turned = along + casadi.cos(position) * (casadi.DM.eye(3) - along) - casadi.sin(position) * casadi.skew(axis)
    return JointTransform(casadi.densify(casadi.SX(turned)) @ placed.T, _column(body.offset))


def _inertia(body: MovingBody) -> SpatialInertia:
    return SpatialInertia(casadi.SX(body.mass), _column(body.first_moment), _matrix(body.inertia))


def _column(values: Any) -> Any:
    return casadi.SX(casadi.DM(values))


def _matrix(rows: Any) -> Any:
    return casadi.SX(casadi.DM([list(row) for row in rows]))
