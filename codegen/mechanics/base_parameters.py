"""Base inertial parameters of a kinematic tree: the combinations of masses and inertias that joint torques depend on.

Rotation about a joint does not move mass on its axis. So the mass of each revolute body, and its first and second
moment along the axis, can be assigned to the parent body without a change of M(x) or h(x, v) (Khalil and Dombre 2002,
section 9.4). The entries that become zero are omitted from the recursions. The regrouping is done in exact numbers,
which are rounded to doubles once, in the recursions.

The parameters that remain are the base parameters, which can be identified from a log of joint torques. In each joint's
frame, with its z axis along the joint, they are for the body of a revolute joint the first moments mx, my and the
inertias xx (I_xx − I_yy), xy, xz, yz, zz; for that of a prismatic joint all ten. M(x) and h(x, v) are linear in them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import casadi
import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import refuse_unknown
from codegen.base.exact_numbers import Exact, exact_array, square_root
from codegen.mechanics.kinematic_chain import Points, bias_force, mass_matrix
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree, LinkTolerance, MovingBody, Vector, moments_of, pose, rows, vector

ROUNDING = Fraction(1, 10**14)
"""Sums below this fraction of their terms are set to zero, since the angles in robot files are rounded."""
UP = exact_array([0, 0, 1])
ON_AXIS = np.outer([0, 0, 1, 1], [0, 0, 1, 1]) > 0
"""Entries of a body's moments that mass on its z axis has: mass, m c_z, and the second moment along z."""
REVOLUTE = ("mx", "my", "xx", "xy", "xz", "yz", "zz")
"""Names of the base parameters of a body with a revolute joint."""
PRISMATIC = ("m", "mx", "my", "mz", "xx", "xy", "xz", "yy", "yz", "zz")
"""Names of the base parameters of a body with a prismatic joint."""
NUMBERS = 10
"""Numbers of a link in a robot file: mass, centre of mass, inertia."""
POINTS, SEED = 24, 5
"""Number of random states in which the effect of the parameters is computed, and seed of their random numbers."""
LEAST_EFFECT = 1e-9
"""Largest |∂torque/∂p| over random states, relative to that of all parameters, up to which p counts as without effect.
"""


def regrouped(tree: KinematicTree) -> KinematicTree:
    """The tree with regrouped inertias: same M(x) and h(x, v), but its bodies are no longer the physical ones."""
    bodies = list(tree.bodies)
    for i, body in enumerate(bodies):
        _give_frame(bodies, i, pose(_turn_to(body.axis), 0 * UP))
        bodies[i] = replace(bodies[i], axis=vector(UP))
    for i, body in enumerate(bodies):
        if body.kind == "revolute":
            _move_origin(bodies, i)
    for i in reversed(range(len(bodies))):
        body = bodies[i]
        if body.kind != "revolute":
            continue
        moments = exact_array(body.moments)
        on_axis = np.where(ON_AXIS, moments, exact_array(0))
        bodies[i] = _with_moments(body, moments - on_axis, on_axis)
        if body.parent >= 0:
            parent, frame = bodies[body.parent], exact_array(body.frame)
            moved = frame @ on_axis @ frame.T
            bodies[body.parent] = _with_moments(parent, exact_array(parent.moments) + moved, moved)
    return replace(tree, bodies=tuple(bodies))


def _give_frame(bodies: list[MovingBody], i: int, change: Exact) -> None:
    """Give a body another frame, which has the pose ``change`` in its own."""
    back = pose(change[:3, :3].T, -change[:3, :3].T @ change[:3, 3])
    body = bodies[i]
    moments = back @ exact_array(body.moments) @ back.T
    bodies[i] = replace(body, frame=rows(exact_array(body.frame) @ change), moments=rows(moments))
    for k, child in enumerate(bodies):
        if child.parent == i:
            bodies[k] = replace(child, frame=rows(back @ exact_array(child.frame)))


def _move_origin(bodies: list[MovingBody], i: int) -> None:
    """Move the origin of a body's frame along its joint axis to the point nearest the parent's origin.

    This makes components of the offset zero.
    """
    frame = exact_array(bodies[i].frame)
    along = -(frame[:3, 2] @ frame[:3, 3])
    _give_frame(bodies, i, pose(exact_array(np.eye(3, dtype=int)), along * UP))
    frame = exact_array(bodies[i].frame)
    frame[:3, 3] = _without_rounding(frame[:3, 3], abs(along))
    bodies[i] = replace(bodies[i], frame=rows(frame))


def _turn_to(axis: Vector) -> Exact:
    """A rotation whose third column is the axis; a signed permutation if the axis is along x, y or z."""
    third = exact_array(axis)
    first = exact_array(np.eye(3, dtype=int))[int(np.argmin(np.abs(third)))]
    first = first - third * (third @ first)
    first = first / square_root(first @ first)
    return np.column_stack([first, np.cross(third, first), third])


def _with_moments(body: MovingBody, moments: Exact, change: Exact) -> MovingBody:
    """The body with changed moments, zero where the ``change`` leaves no more than rounding errors."""
    before, result = exact_array(body.moments), moments.copy()
    for part in (np.s_[:3, :3], np.s_[:3, 3], np.s_[3, :3]):
        result[part] = _without_rounding(result[part], max(abs(before[part]).max(), abs(change[part]).max()))
    return replace(body, moments=rows(result))


def _without_rounding(values: Exact, size: Fraction) -> Exact:
    """The values with zero in place of those so small against ``size`` that they can only be rounding errors."""
    return np.where(abs(values) > ROUNDING * size, values, exact_array(0))


@dataclass(frozen=True)
class LinkParameter:
    """One base parameter.

    Attributes:
        name: joint and moment, such as elbow_pitch_mx.
        unit: kg, kg*m or kg*m^2.
        value: the spec's value, or the robot file's if the spec gives none.
        changes: (links, k) its change when one uncertain number of a link in the robot file, such as its mass, changes
            by its standard deviation; zero for a number without a tolerance. The scalar product of those of two
            parameters is their covariance.
    """

    name: str
    unit: str
    value: Fraction
    changes: Array

    @property
    def deviation(self) -> float:
        """Standard deviation, from the tolerances in the spec."""
        return float(np.linalg.norm(self.changes))


def link_parameters(spec: Spec, tree: KinematicTree) -> tuple[LinkParameter, ...]:
    """The base parameters that some joint torque depends on, body by body; BadInput as ``base_values``."""
    values = base_values(spec, tree)
    acting, changes = _acting(regrouped(tree), tuple(values)), _changes(tree)
    return tuple(LinkParameter(n, _unit(n), value, changes[n]) for n, value in values.items() if n in acting)


def base_values(spec: Spec, tree: KinematicTree) -> dict[str, Fraction]:
    """Name → value of every base parameter: the spec's, or the robot file's; BadInput for an unknown name."""
    nominal = _moments(regrouped(tree))
    given = dict(tree.base_parameters)
    for name in given:
        at = spec.place(f"urdf.base_parameters.{name}")
        refuse_unknown(name, nominal, at, "unknown base parameter", "those of its joints", code="SPEC008")
    return nominal | given


def masses_of(tree: KinematicTree, values: Mapping[str, Any]) -> list[Points]:
    """Mass moments of the bodies of a regrouped tree for given base parameters (numbers or symbols), body by body."""
    return [_points(body, values) for body in tree.bodies]


def _acting(tree: KinematicTree, names: Sequence[str]) -> set[str]:
    """Names of the parameters on which a joint torque depends in at least one of several random states.

    Bodies near the base have few of them: for a first joint with a vertical axis it is zz only.
    """
    n = len(tree.bodies)
    x, v, a = (casadi.SX.sym(name, n) for name in "xva")
    p = casadi.SX.sym("p", len(names))
    masses = masses_of(tree, {name: p[k] for k, name in enumerate(names)})
    torque = mass_matrix(tree, x, masses) @ a + bias_force(tree, x, v, masses)
    slopes = casadi.Function("slopes", [x, v, a], [casadi.densify(casadi.jacobian(torque, p))])
    random = np.random.default_rng(SEED)
    tried = [np.array(slopes(*random.uniform(-2, 2, (3, n)))) for _ in range(POINTS)]
    sizes = np.abs(tried).max(axis=(0, 1))
    return {name for name, size in zip(names, sizes, strict=True) if size > LEAST_EFFECT * sizes.max()}


def _moments(tree: KinematicTree) -> dict[str, Fraction]:
    """Name → value of each base parameter of a regrouped tree."""
    found: dict[str, Fraction] = {}
    for body in tree.bodies:
        (xx, xy, xz, mx), (_, yy, yz, my), (_, _, zz, mz), (_, _, _, m) = body.moments
        entries = {
            "m": m, "mx": mx, "my": my, "mz": mz,
            "xx": yy - xx if body.kind == "revolute" else yy + zz, "yy": xx + zz, "zz": xx + yy,
            "xy": -xy, "xz": -xz, "yz": -yz,
        }  # fmt: skip
        found |= {f"{body.joint}_{key}": entries[key] for key in _keys(body)}
    return found


def _points(body: MovingBody, values: Mapping[str, Any]) -> Points:
    """Mass moments of a body from its base parameters, the inverse of ``_moments``.

    For a revolute joint mass, first moment and second moment along z are 0, as after regrouping.
    """
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
    """Names of the moments that are base parameters of a body, by the type of its joint."""
    return REVOLUTE if body.kind == "revolute" else PRISMATIC


def _unit(name: str) -> str:
    """Unit of a base parameter: kg, kg*m or kg*m^2."""
    moment = name.rsplit("_", 1)[1]
    return "kg" if moment == "m" else "kg*m" if moment.startswith("m") else "kg*m^2"


def _changes(tree: KinematicTree) -> dict[str, Array]:
    """Changes of each base parameter, as of ``LinkParameter.changes``."""
    nominal = _moments(regrouped(tree))
    changes = {name: np.zeros((len(tree.bodies), NUMBERS)) for name in nominal}
    if tree.tolerance is not None:
        for k, body in enumerate(tree.bodies):
            for j, changed in enumerate(_perturbed(body, tree.tolerance)):
                bodies = (*tree.bodies[:k], changed, *tree.bodies[k + 1 :])
                moments = _moments(regrouped(replace(tree, bodies=bodies)))
                for name, value in nominal.items():
                    changes[name][k, j] = float(moments[name] - value)
    return changes


def _perturbed(body: MovingBody, tolerance: LinkTolerance) -> list[MovingBody]:
    """One changed body for each number with a tolerance: that number is changed by one standard deviation."""
    unit = exact_array(np.eye(3, dtype=int))
    centre, about, found = body.centre, body.about_centre, list[MovingBody]()

    def add(mass: Fraction, c: Any, inertia: Any) -> None:
        found.append(replace(body, moments=rows(moments_of(mass, c, inertia))))

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


def _exact(number: float) -> Fraction:
    """A float as the fraction of its decimal of 12 digits."""
    return Fraction(f"{number:.12g}")
