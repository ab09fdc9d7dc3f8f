"""The base parameters of a robot's bodies by name: what a log of joint torques can tell of masses and inertias.

They are the moments of the bodies that ``regrouped`` leaves (Khalil and Dombre 2002, section 9.4), in each joint's
frame with its z axis along the joint: of a revolute joint's body the first moment mx, my and the inertia xx
(I_xx − I_yy), xy, xz, yz, zz; of a prismatic joint's all ten. M(x) and h(x, v) are linear in them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import casadi
import numpy as np

from codegen.base.errors import refuse_unknown
from codegen.base.exact_numbers import exact_array
from codegen.mechanics.base_parameters import regrouped
from codegen.mechanics.kinematic_chain import Points, bias_force, mass_matrix
from codegen.spec.kinematics import KinematicTree, LinkTolerance, MovingBody, Rows, Vector
from codegen.spec.model import Spec

TURNING = ("mx", "my", "xx", "xy", "xz", "yz", "zz")
SLIDING = ("m", "mx", "my", "mz", "xx", "xy", "xz", "yy", "yz", "zz")
POINTS, SEED = 24, 5
SEEN = 1e-9
"""A parameter whose largest torque over random states is smaller than this share of the largest of all acts on none."""


@dataclass(frozen=True)
class LinkParameter:
    """One base parameter.

    Attributes:
        name: joint and moment, such as elbow_pitch_mx. unit: kg, kg*m or kg*m^2.
        value: as the robot file has it, or the spec in its place.
        deviation: standard deviation by the spec's tolerance.
    """

    name: str
    unit: str
    value: Fraction
    deviation: float


def link_parameters(spec: Spec, tree: KinematicTree) -> tuple[LinkParameter, ...]:
    """Every base parameter with an effect on some joint, body by body.

    Raises:
        BadInput: for a name under ``base_parameters`` that there is not.
    """
    values = base_values(spec, tree)
    seen, spread = _acting(regrouped(tree), tuple(values)), _deviations(tree)
    return tuple(LinkParameter(n, _unit(n), value, spread[n]) for n, value in values.items() if n in seen)


def base_values(spec: Spec, tree: KinematicTree) -> dict[str, Fraction]:
    """Name → value of every base parameter: the spec's, or the robot file's where the spec gives none.

    Raises:
        BadInput: for a name under ``base_parameters`` that there is not.
    """
    nominal = _moments(regrouped(tree))
    given = dict(tree.base_parameters)
    for name in given:
        at = spec.place(f"urdf.base_parameters.{name}")
        refuse_unknown(name, nominal, at, "unknown base parameter", "those of its joints", code="SPEC008")
    return nominal | given


def masses_of(tree: KinematicTree, values: Mapping[str, Any]) -> list[Points]:
    """The bodies of a regrouped tree with these base parameters, numbers or symbols."""
    return [_points(body, values) for body in tree.bodies]


def _acting(tree: KinematicTree, names: Sequence[str]) -> set[str]:
    """Those with a torque on some joint in some state, tried at random states: a base joint leaves few."""
    n = len(tree.bodies)
    x, v, a = (casadi.SX.sym(name, n) for name in "xva")
    p = casadi.SX.sym("p", len(names))
    masses = masses_of(tree, {name: p[k] for k, name in enumerate(names)})
    torque = mass_matrix(tree, x, masses) @ a + bias_force(tree, x, v, masses)
    slopes = casadi.Function("slopes", [x, v, a], [casadi.densify(casadi.jacobian(torque, p))])
    random = np.random.default_rng(SEED)
    tried = [np.array(slopes(*random.uniform(-2, 2, (3, n)))) for _ in range(POINTS)]
    sizes = np.abs(tried).max(axis=(0, 1))
    return {name for name, size in zip(names, sizes, strict=True) if size > SEEN * sizes.max()}


def _moments(tree: KinematicTree) -> dict[str, Fraction]:
    """Name → value, of a regrouped tree."""
    found: dict[str, Fraction] = {}
    for body in tree.bodies:
        first, inertia = body.first_moment, body.inertia
        entries = {
            "m": body.mass, "mx": first[0], "my": first[1], "mz": first[2],
            "xx": inertia[0][0], "yy": inertia[1][1], "zz": inertia[2][2],
            "xy": inertia[0][1], "xz": inertia[0][2], "yz": inertia[1][2],
        }  # fmt: skip
        if body.kind == "revolute":
            entries["xx"] -= inertia[1][1]
        found |= {f"{body.joint}_{key}": entries[key] for key in _keys(body)}
    return found


def _points(body: MovingBody, values: Mapping[str, Any]) -> Points:
    """The inverse of ``_moments``; on a revolute joint with ∫ρ z² = 0, as regrouping leaves it."""
    v = {key: values[f"{body.joint}_{key}"] for key in _keys(body)}
    if body.kind == "revolute":
        across = (v["zz"] - v["xx"]) / 2, (v["zz"] + v["xx"]) / 2, 0.0
        first, mass = casadi.vertcat(v["mx"], v["my"], 0), casadi.SX(0)
    else:
        half = (v["xx"] + v["yy"] + v["zz"]) / 2
        across = half - v["xx"], half - v["yy"], half - v["zz"]
        first, mass = casadi.vertcat(v["mx"], v["my"], v["mz"]), casadi.SX(v["m"])
    second = casadi.SX(3, 3)
    for k in range(3):
        second[k, k] = across[k]
    for i, j, key in ((1, 0, "xy"), (2, 0, "xz"), (2, 1, "yz")):
        second[i, j] = second[j, i] = -v[key]
    return Points(mass, casadi.SX(first), second)


def _keys(body: MovingBody) -> tuple[str, ...]:
    return TURNING if body.kind == "revolute" else SLIDING


def _unit(name: str) -> str:
    moment = name.rsplit("_", 1)[1]
    return "kg" if moment == "m" else "kg*m" if moment.startswith("m") else "kg*m^2"


def _deviations(tree: KinematicTree) -> dict[str, float]:
    """Standard deviation of each base parameter: what each uncertain number of each body does to it, in squares."""
    nominal = _moments(regrouped(tree))
    squares = dict.fromkeys(nominal, 0.0)
    if tree.tolerance is not None:
        for k, body in enumerate(tree.bodies):
            for moved in _moved(body, tree.tolerance):
                bodies = (*tree.bodies[:k], moved, *tree.bodies[k + 1 :])
                there = _moments(regrouped(replace(tree, bodies=bodies)))
                for name, value in nominal.items():
                    squares[name] += float(there[name] - value) ** 2
    return {name: square**0.5 for name, square in squares.items()}


def _moved(body: MovingBody, tolerance: LinkTolerance) -> list[MovingBody]:
    """The body with one of its numbers one standard deviation off, for each that is uncertain."""
    unit = exact_array(np.eye(3, dtype=int))
    centre = exact_array(body.first_moment) / body.mass
    about = exact_array(body.inertia) - _of_point(body.mass, centre)
    found = []

    def add(mass: Fraction, c: Any, inertia: Any) -> None:
        whole = inertia + _of_point(mass, c)
        rows: Rows = (_vector(whole[0]), _vector(whole[1]), _vector(whole[2]))
        found.append(replace(body, mass=mass, first_moment=_vector(mass * c), inertia=rows))

    if tolerance.mass:
        add(body.mass * (1 + _exact(tolerance.mass)), centre, about)
    distance = float(np.linalg.norm(centre.astype(float)))
    if tolerance.centre_of_mass and distance:
        for k in range(3):
            add(body.mass, centre + _exact(tolerance.centre_of_mass * distance) * unit[k], about)
    if tolerance.inertia:
        for i in range(3):
            for j in range(i + 1):
                size = tolerance.inertia * float(about[i, i] * about[j, j]) ** 0.5
                change = exact_array(np.zeros((3, 3), dtype=int))
                change[i, j] = change[j, i] = _exact(size)
                add(body.mass, centre, about + change)
    return found


def _of_point(mass: Fraction, c: Any) -> Any:
    """Inertia of a point mass at c about the origin."""
    return mass * (c @ c * exact_array(np.eye(3, dtype=int)) - np.outer(c, c))


def _exact(number: float) -> Fraction:
    return Fraction(f"{number:.12g}")


def _vector(values: Any) -> Vector:
    x, y, z = values
    return x, y, z
