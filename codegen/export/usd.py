"""Export as a USD scene in text (.usda): UsdPhysics, with the joint attributes of Newton and of PhysX.

UsdPhysics has bodies, masses and joints, but neither friction nor armature of a joint. Two schemas have these, and both
are written: ``NewtonJointAPI`` of newton-usd-schemas 0.4 or later, and ``PhysxJointAxisAPI`` of Omniverse Physics. In
both, the damping of a hinge is per degree (N m s/deg), and numbers are in single precision.
"""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.rotations import quaternion
from codegen.base.text import render
from codegen.export.bodies import Link, links_of, number, principal
from codegen.export.exporter import Remark
from codegen.export.joints import JointTerms, joint_terms
from codegen.export.mechanism import Mechanism
from codegen.spec.model import Spec


def usd_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The file's text, and remarks on what it cannot represent. The base is a body fixed to the world."""
    joints, remarks = joint_terms(spec, mechanism, "USD", springs=False, armatures=True)
    gravity = np.zeros(3)
    if mechanism.tree is None:
        how = "the spec states its forces itself: the scene has no gravity"
        remarks = (*remarks, Remark("gravity", "nearest", how))
    else:
        gravity = np.array(mechanism.tree.gravity, dtype=float)
    magnitude = float(np.sqrt(gravity @ gravity))
    return render(
        "export/model.usda.j2",
        name=spec.name,
        header=[*header, *(r.text for r in remarks)],
        bodies=_bodies(links_of(mechanism), joints),
        down=_singles(gravity / magnitude if magnitude else [0, 0, -1]),
        gravity=_single(magnitude),
    ), remarks


def _bodies(links: Sequence[Link], joints: Sequence[JointTerms]) -> list[dict[str, Any]]:
    """Links and their joints as text for the template.

    - ``position``, ``orientation``: of the body in the world, with all coordinates zero.
    - ``place``, ``turned``: position and orientation of the joint frame in the parent body; ``along``: its orientation
      in the body itself. The x axis of the joint frame is the joint's axis.
    - ``moments``: principal moments of inertia, about the axes of the orientation ``axes``.
    - ``damping``: in N m s/deg or N s/m.
    """
    bodies, poses = [], list[tuple[Array, Array]]()
    for link, joint in zip(links, joints, strict=True):
        parent_rotation, parent_origin = (np.eye(3), np.zeros(3)) if link.parent < 0 else poses[link.parent]
        rotation, origin = parent_rotation @ link.rotation, parent_origin + parent_rotation @ link.offset
        poses.append((rotation, origin))
        joint_frame, (moments, axes) = _from_x(link.axis), principal(link.inertia)
        body = {
            "link": link,
            "parent": "base" if link.parent < 0 else f"{links[link.parent].name}_link",
            "position": _doubles(origin),
            "orientation": _doubles(quaternion(rotation)),
            "place": _singles(link.offset),
            "turned": _singles(quaternion(link.rotation @ joint_frame)),
            "along": _singles(quaternion(joint_frame)),
            "mass": _single(link.mass),
            "centre": _singles(link.centre),
            "moments": _singles(moments),
            "axes": _singles(quaternion(axes)),
            "armature": _single(joint.armature),
            "damping": _single(joint.damping * (pi / 180 if link.turns else 1)),
            "friction": _single(joint.friction),
            "effort": "" if joint.effort is None else _single(joint.effort),
        }
        bodies.append(body)
    return bodies


def _from_x(axis: Array) -> Array:
    """A rotation R with R x̂ = axis: by 180° about the bisector b of x̂ and the axis, R = 2 b b'/b'b − I."""
    bisector = axis + np.array([1.0, 0.0, 0.0])
    if not bisector @ bisector > 1e-12:  # axis = −x̂: any axis perpendicular to x̂ is valid
        bisector = np.array([0.0, 0.0, 1.0])
    return np.asarray(2 * np.outer(bisector, bisector) / (bisector @ bisector) - np.eye(3))


def _single(value: float) -> str:
    """The shortest decimal that reads back as the same single-precision number; −0 is written as 0."""
    return str(np.float32(value) + np.float32(0))


def _singles(values: Sequence[float] | Array) -> str:
    return f"({', '.join(map(_single, values))})"


def _doubles(values: Sequence[float] | Array) -> str:
    return f"({', '.join(map(number, values))})"
