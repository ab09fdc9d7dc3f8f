"""The machine as a USD scene in text (.usda): UsdPhysics, with the joint attributes of Newton and of PhysX.

UsdPhysics has bodies, masses and joints, and neither friction nor armature of a joint. Those are in two schemas, which
are both written: ``NewtonJointAPI`` of newton-usd-schemas 0.4 or later, and ``PhysxJointAxisAPI`` of Omniverse Physics.
Both count a damping of a hinge per degree. Numbers are single precision there.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.rotations import quaternion
from codegen.base.text import render
from codegen.export.bodies import Link, links_of, principal
from codegen.export.joints import JointTerms, joint_terms
from codegen.export.mechanism import Mechanism
from codegen.export.numbers import number
from codegen.export.remarks import Remark
from codegen.spec.model import Spec


def usd_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The file, and what it holds. The base is a body that is fixed to the world."""
    joints, remarks = joint_terms(spec, mechanism, "USD", springs=False, armatures=True)
    gravity = np.zeros(3)
    if mechanism.tree is None:
        how = "the spec states its forces itself: the scene has no gravity"
        remarks = (*remarks, Remark("gravity", "nearest", how))
    else:
        gravity = np.array(mechanism.tree.gravity, dtype=float)
    size = float(np.sqrt(gravity @ gravity))
    return render(
        "export/model.usda.j2",
        name=spec.name,
        header=[*header, *(r.text for r in remarks)],
        bodies=_bodies(links_of(mechanism), joints),
        down=_singles(gravity / size if size else [0, 0, -1]),
        gravity=_single(size),
    ), remarks


def _bodies(links: Sequence[Link], joints: Sequence[JointTerms]) -> list[dict[str, Any]]:
    """Links and their joints as text for the template.

    ``position`` and ``orientation`` are the body's in the world, all coordinates zero; ``place`` and ``turned`` the
    joint frame's in the parent's body, ``along`` in the body's own: its x axis is the joint's. ``moments`` are the
    principal ones about ``axes``; ``damping`` in N m s/deg or N s/m.
    """
    found, poses = [], list[tuple[Array, Array]]()
    for link, joint in zip(links, joints, strict=True):
        turn, at = (np.eye(3), np.zeros(3)) if link.parent < 0 else poses[link.parent]
        poses.append((turn @ link.rotation, at + turn @ link.offset))
        along, (moments, axes) = _from_x(link.axis), principal(link.inertia)
        body = {
            "link": link,
            "parent": "base" if link.parent < 0 else f"{links[link.parent].name}_link",
            "position": _doubles(poses[-1][1]),
            "orientation": _doubles(quaternion(poses[-1][0])),
            "place": _singles(link.offset),
            "turned": _singles(quaternion(link.rotation @ along)),
            "along": _singles(quaternion(along)),
            "mass": _single(link.mass),
            "centre": _singles(link.centre),
            "moments": _singles(moments),
            "axes": _singles(quaternion(axes)),
            "armature": _single(joint.armature),
            "damping": _single(joint.damping * (pi / 180 if link.turns else 1)),
            "friction": _single(joint.friction),
            "effort": "" if joint.effort is None else _single(joint.effort),
        }
        found.append(body)
    return found


def _from_x(axis: Array) -> Array:
    """A rotation that takes the x axis to this one: by half a turn about what lies between them."""
    between = axis + np.array([1.0, 0.0, 0.0])
    if not between @ between > 1e-12:
        between = np.array([0.0, 0.0, 1.0])
    return np.asarray(2 * np.outer(between, between) / (between @ between) - np.eye(3))


def _single(value: float) -> str:
    """The shortest text of a single."""
    return str(np.float32(value) + np.float32(0))


def _singles(values: Sequence[float] | Array) -> str:
    return f"({', '.join(map(_single, values))})"


def _doubles(values: Sequence[float] | Array) -> str:
    return f"({', '.join(map(number, values))})"
