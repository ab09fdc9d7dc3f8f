"""Serial arms by a row a joint: the figures of a data sheet, as URDF, and those of a machine that differs from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from ruamel.yaml import YAML

from benchmarks.text import render

Vector = tuple[float, float, float]
MASS, CENTRE, INERTIA, DAMPING, ROTOR, FRICTION = 0.25, 0.2, 0.4, 0.4, 0.15, 0.3
"""Most by which a figure of the machine differs from the data sheet's, as a share of it; a fifth of that at least."""


@dataclass(frozen=True)
class Joint:
    """A joint and the link behind it; at zero positions all frames are parallel to the base's, z upwards.

    Attributes:
        kind: of the URDF.
        origin: of the joint in the frame before it, m. axis: of its motion.
        mass: of the link, kg. centre: of mass in the joint's frame, m. inertia: about it, I_xx, I_yy, I_zz, kg m².
        friction: Coulomb level, N m or N. damping: N m s or N s/m. rotor: inertia behind the gear, kg m² or kg.
        reach: half the range of the motion, rad or m. middle: of this range.
        count: of the encoder, rad or m. torque: step of the measured torque or force, N m or N.
    """

    name: str
    kind: Literal["continuous", "prismatic"]
    origin: Vector
    axis: Vector
    mass: float
    centre: Vector
    inertia: Vector
    friction: float
    damping: float
    rotor: float
    reach: float
    middle: float
    count: float
    torque: float


def link(
    name: str,
    axis: str,
    origin: Vector,
    mass: float,
    box: Vector,
    centre: Vector,
    drive: Vector,
    motion: tuple[float, float],
    sensors: tuple[float, float],
) -> Joint:
    """A joint by its row in robots.yaml, which says what the arguments are."""
    letter, sign = axis[-1], -1.0 if axis.startswith("-") else 1.0
    x, y, z = (sign if letter.lower() == other else 0.0 for other in "xyz")
    a, b, c = (edge**2 for edge in box)
    xx, yy, zz = (round(mass / 12 * squares, 9) for squares in (b + c, a + c, a + b))
    kind: Literal["continuous", "prismatic"] = "prismatic" if letter.isupper() else "continuous"
    return Joint(name, kind, origin, (x, y, z), mass, centre, (xx, yy, zz), *drive, *motion, *sensors)


_SHEETS = YAML(typ="safe").load(Path(__file__).with_name("robots.yaml"))
ROBOTS = {name: tuple(link(joint, **row) for joint, row in rows.items()) for name, rows in _SHEETS.items()}
"""Name → its joints, from the base outwards."""


def urdf(name: str, joints: tuple[Joint, ...]) -> str:
    """The arm as a robot description file."""
    return render("arm.urdf.j2", name=name, joints=joints)


def built(joints: tuple[Joint, ...], seed: int) -> tuple[Joint, ...]:
    """A machine whose figures differ from its data sheet."""
    random = np.random.default_rng(seed)

    def other(value: float, most: float) -> float:
        return float(value * (1 + random.choice([-1.0, 1.0]) * random.uniform(most / 5, most)))

    def moved(centre: Vector) -> Vector:
        share = CENTRE * float(np.linalg.norm(centre))
        x, y, z = np.array(centre) + share / np.sqrt(3) * random.uniform(-1, 1, 3)
        return float(x), float(y), float(z)

    def scaled(inertia: Vector) -> Vector:
        share = other(1.0, INERTIA)
        x, y, z = inertia
        return share * x, share * y, share * z

    return tuple(
        replace(
            joint,
            mass=other(joint.mass, MASS),
            centre=moved(joint.centre),
            inertia=scaled(joint.inertia),
            friction=other(joint.friction, FRICTION),
            damping=other(joint.damping, DAMPING),
            rotor=other(joint.rotor, ROTOR),
        )
        for joint in joints
    )
