"""Conversion of a MuJoCo model (MJCF) to a robot description (URDF), through MuJoCo's compiler.

MuJoCo computes inertias from shapes and resolves defaults, includes and orientations; the compiled model is read here.
A MuJoCo joint has any position in its body, and q = ref in the pose of the file: a hinge rotates the body by q − ref
about an axis through the joint's point (MuJoCo, Computation, Kinematics). In URDF the origin of a link is at its joint,
and the joint's frame in the parent link is that of the link at q = 0. So the link's frame is the body's, translated to
the joint's point, and the joint's frame is rotated (for a slide: translated) back by ref.

Indices follow MuJoCo: b for a body, j for a joint, k for an actuator or another object.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_bytes
from codegen.base.rotations import about_axis, of_quaternion, roll_pitch_yaw
from codegen.base.user_text import one_line
from codegen.spec.urdf import LARGEST, identifier

EXPECTED = "a MuJoCo model (MJCF) of an arm of hinge and slide joints"
STANDARD_GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class MjcfJoint:
    """Properties of a joint that a robot description (URDF) cannot state.

    Attributes:
        joint: the joint's name as an identifier of a spec.
        armature: reflected inertia of the motor, kg m² of a hinge or kg of a slide.
        stiffness: of the joint's spring, N m/rad or N/m; 0 without a spring.
        rest: position at which the spring force is zero, rad or m.
        limits: (lowest, highest) position, rad or m; None without limits.
    """

    joint: str
    armature: float
    stiffness: float
    rest: float
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class RobotModel:
    """A robot description, with what it cannot state of the MuJoCo model that it is converted from, if it is.

    Attributes:
        urdf: text of the robot description.
        joints: in MuJoCo's order of bodies.
        gravity: (x, y, z) in the world's frame, m/s².
        remarks: properties of the model that the conversion leaves out or changes, in words.
    """

    urdf: str
    joints: tuple[MjcfJoint, ...] = ()
    gravity: tuple[float, ...] = STANDARD_GRAVITY
    remarks: tuple[str, ...] = ()


def read_mjcf(path: Path) -> RobotModel:
    """A MuJoCo model, converted.

    Raises BadInput if MuJoCo is not installed, for a file that is no model, a floating base, or a body with two joints
    or a ball joint.
    """
    mujoco, model = compiled(path)
    conversion = _Conversion(path, mujoco, model)
    with np.errstate(all="ignore"):  # numbers that are too large are refused by the reader of the robot description
        gravity = tuple(map(float, model.opt.gravity))
        return RobotModel(conversion.urdf(), conversion.joints(), gravity, conversion.remarks())


def compiled(path: Path) -> tuple[Any, Any]:
    """The package mujoco, and the compiled model of a file.

    Raises BadInput if MuJoCo is not installed, or for a file that is no model.
    """
    read_bytes(path, EXPECTED, LARGEST)
    try:
        import mujoco
    except ImportError as error:
        found = f"a MuJoCo model, and no package `mujoco` that can be imported ({error})"
        expected = "it installed: pip install 'stiction[mujoco]'"
        raise BadInput(Place(str(path)), found, expected, code="TOOL003") from None
    mujoco.set_mju_user_warning(lambda _: None)  # by default it writes a file into the user's folder
    try:
        return mujoco, mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        line = re.search(r"line (\d+)", str(error))
        words = one_line(" ".join(str(error).split()))
        raise BadInput(Place(str(path), int(line[1]) if line else None), words, EXPECTED, code="SPEC030") from None


class _Conversion:
    """Conversion of a compiled model.

    Attributes:
        skipped: bodies that are left out: free ones and those fixed to them.
        bodies: all others except the world, body 0.
        joint_of: body → the joint that connects it with its parent; no entry for a body that is fixed to its parent.
        labels: body → name of that joint.

    Raises:
        BadInput: as ``read_mjcf``.
    """

    def __init__(self, path: Path, mujoco: Any, model: Any) -> None:
        self.path, self.mujoco, self.model = path, mujoco, model
        self.skipped = self._free_objects()
        self.bodies = [b for b in range(1, model.nbody) if b not in self.skipped]
        self.joint_of: dict[int, int] = {}
        self.labels: dict[int, str] = {}
        for b in self.bodies:
            first, count = int(model.body_jntadr[b]), int(model.body_jntnum[b])
            if count > 1:
                expected = "one joint per body; for each further joint insert a body of small mass without geometry"
                raise BadInput(self._place("body", b), f"{count} joints on one body", expected, code="SPEC031")
            if count:
                self._add_joint(b, first)
        if not self.joint_of:
            raise BadInput(Place(str(path)), "no hinge or slide joint", EXPECTED, code="SPEC031")

    def urdf(self) -> str:
        """The robot description: a link for each body, with the full inertia matrix about its centre of mass."""
        from lxml import etree

        robot = etree.Element("robot", name="robot")
        etree.SubElement(robot, "link", name="world")
        names = {0: "world", **{b: self._unique("body", b) for b in self.bodies}}
        for b in self.bodies:
            self._link(etree.SubElement(robot, "link", name=names[b]), b)
        for b in self.bodies:
            joint = etree.SubElement(robot, "joint", name=self.labels.get(b, f"fixed_{names[b]}"))
            self._joint(joint, b, names)
        return str(etree.tostring(robot, pretty_print=True, encoding="unicode"))

    def joints(self) -> tuple[MjcfJoint, ...]:
        """Properties of each joint that the robot description does not have."""
        m, joints = self.model, []
        for b, j in self.joint_of.items():
            stiffness = float(np.ravel(m.jnt_stiffness[j])[0])
            joints.append(
                MjcfJoint(
                    joint=identifier(self.labels[b]),
                    armature=float(m.dof_armature[m.jnt_dofadr[j]]),
                    stiffness=stiffness,
                    rest=float(m.qpos_spring[m.jnt_qposadr[j]]) if stiffness else 0.0,
                    limits=(float(m.jnt_range[j][0]), float(m.jnt_range[j][1])) if m.jnt_limited[j] else None,
                )
            )
        return tuple(joints)

    def remarks(self) -> tuple[str, ...]:
        """Properties that affect the motion in MuJoCo and are missing or different in the spec, in words."""
        m, words = self.model, []
        words += [f"free body {self._name('body', b)}: left out" for b in sorted(self.skipped) if m.body_jntnum[b]]
        words += [self._actuator(k) for k in range(m.nu)]
        for count, what in (
            (int(m.neq), "equality constraint(s): a spec takes `constraints:` of its own form; left out"),
            (int(m.ntendon), "tendon(s): left out with their springs, damping and friction"),
            (_nonzero(m, "dof_dampingpoly"), "coefficient(s) of damping that rises with speed: left out"),
            (_nonzero(m, "jnt_stiffnesspoly"), "coefficient(s) of springs that harden: left out"),
            (_nonzero(m, "body_gravcomp"), "body or bodies with gravcomp: the spec has the whole gravity"),
        ):
            if count:
                words.append(f"{count} {what}")
        if m.opt.density or m.opt.viscosity:
            words.append("density and viscosity of the medium: left out")
        if any(m.geom_contype[g] and m.geom_conaffinity[g] for g in range(m.ngeom)):
            words.append("contacts between bodies: left out; use stretches of a log without them")
        if any(m.jnt_limited[j] for j in self.joint_of.values()):
            words.append("forces at the limits of joints: left out; use stretches of a log without them")
        return tuple(words)

    def _free_objects(self) -> set[int]:
        """Free bodies and those fixed to them, such as objects on a table; raise BadInput if one carries a joint."""
        m, free = self.model, int(self.mujoco.mjtJoint.mjJNT_FREE)
        free_bodies: set[int] = set()
        for b in range(1, m.nbody):  # parents come before their children
            joint_types = m.jnt_type[m.body_jntadr[b] : m.body_jntadr[b] + m.body_jntnum[b]]
            if int(m.body_parentid[b]) in free_bodies:
                if len(joint_types):
                    words = "a joint on a floating base"
                    raise BadInput(self._place("body", b), words, "an arm whose base is fixed", code="SPEC031")
                free_bodies.add(b)
            elif any(joint_types == free):
                free_bodies.add(b)
        return free_bodies

    def _add_joint(self, b: int, j: int) -> None:
        """Store joint j of body b; raise BadInput if it is neither a hinge nor a slide."""
        kinds = self.mujoco.mjtJoint
        if int(self.model.jnt_type[j]) not in (int(kinds.mjJNT_HINGE), int(kinds.mjJNT_SLIDE)):
            raise BadInput(self._place("joint", j), "a ball joint", "hinge and slide joints", code="SPEC031")
        self.joint_of[b] = j
        self.labels[b] = self._unique("joint", j)

    def _link(self, link: Any, b: int) -> None:
        """Mass, centre of mass and inertia matrix of a body, in the link's frame."""
        m = self.model
        if not m.body_mass[b]:
            return
        principal_axes = of_quaternion(m.body_iquat[b])
        centre = m.body_ipos[b] - self._anchor(b)
        inertia = principal_axes @ np.diag(m.body_inertia[b]) @ principal_axes.T
        inertial = _child(link, "inertial")
        _child(inertial, "origin", xyz=_numbers(centre), rpy="0 0 0")
        _child(inertial, "mass", value=_number(m.body_mass[b]))
        keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        _child(inertial, "inertia", **{key: _number(inertia[at]) for key, at in keys.items()})

    def _joint(self, joint: Any, b: int, names: dict[int, str]) -> None:
        """The joint between a body and its parent: origin (pose of the link at q = 0), axis, damping and friction."""
        m = self.model
        parent = int(m.body_parentid[b])
        rotation = of_quaternion(m.body_quat[b])
        position = m.body_pos[b] + rotation @ self._anchor(b) - self._anchor(parent)
        j = self.joint_of.get(b)
        joint.set("type", "fixed" if j is None else "prismatic")
        if j is not None:
            axis, reference, dof = m.jnt_axis[j], float(m.qpos0[m.jnt_qposadr[j]]), m.jnt_dofadr[j]
            if int(m.jnt_type[j]) == int(self.mujoco.mjtJoint.mjJNT_HINGE):
                joint.set("type", "continuous")
                rotation = rotation @ about_axis(axis, -reference)
            else:
                position = position - rotation @ axis * reference
        _child(joint, "origin", xyz=_numbers(position), rpy=_numbers(roll_pitch_yaw(rotation)))
        _child(joint, "parent", link=names[parent])
        _child(joint, "child", link=names[b])
        if j is not None:
            _child(joint, "axis", xyz=_numbers(axis))
            damping, friction = np.ravel(m.dof_damping[dof])[0], m.dof_frictionloss[dof]
            _child(joint, "dynamics", damping=_number(damping), friction=_number(friction))

    def _anchor(self, b: int) -> Array:
        """Origin of a body's URDF link in the body's frame, m: the joint's point, or zero without a joint."""
        j = self.joint_of.get(b)
        return np.zeros(3) if j is None else np.array(self.model.jnt_pos[j])

    def _actuator(self, k: int) -> str:
        """A remark on an actuator: its joint, and the spec's input w as a function of MuJoCo's control signal ctrl.

        With the gear ratio r, the transmission has the length l = r q and the joint force is w = r f. The actuator's
        force is f = gain·ctrl + b0 + b1 l + b2 dl/dt, hence w = r gain ctrl + r b0 + r² b1 q + r² b2 v.
        """
        m, kinds = self.model, self.mujoco.mjtTrn
        name = self._name("actuator", k)
        if int(m.actuator_trntype[k]) not in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)):
            return f"actuator {name}: it acts on no joint; left out"
        joint = next((self.labels[b] for b, j in self.joint_of.items() if j == m.actuator_trnid[k][0]), None)
        if joint is None:
            return f"actuator {name}: on a joint that is left out"
        gear, q = float(m.actuator_gear[k][0]), identifier(joint)
        biases, bias = self.mujoco.mjtBias, int(m.actuator_biastype[k])
        terms = [(gear * float(m.actuator_gainprm[k][0]), "*ctrl")]
        if bias == int(biases.mjBIAS_AFFINE):
            b0, b1, b2 = (float(value) for value in m.actuator_biasprm[k][:3])
            terms += [(gear * b0, ""), (gear**2 * b1, f"*{q}"), (gear**2 * b2, f"*v_{q}")]
        law = f"w_{q} = " + " ".join(f"{value:+.6g}{factor}" for value, factor in terms if value).removeprefix("+")
        if bias not in (int(biases.mjBIAS_NONE), int(biases.mjBIAS_AFFINE)):
            law = "its force law is not affine in ctrl, position and velocity"
        limited = f", force within {_numbers(m.actuator_forcerange[k])}" if m.actuator_forcelimited[k] else ""
        state = (
            ", behind an activation state" if int(m.actuator_dyntype[k]) != int(self.mujoco.mjtDyn.mjDYN_NONE) else ""
        )
        return f"actuator {name} on {joint}: {law}{limited}{state}"

    def _name(self, kind: str, k: int) -> str:
        """The name of a body, joint or actuator in the model, or its kind and number."""
        object_type = {"body": "mjOBJ_BODY", "joint": "mjOBJ_JOINT", "actuator": "mjOBJ_ACTUATOR"}[kind]
        name = self.mujoco.mj_id2name(self.model, getattr(self.mujoco.mjtObj, object_type), k)
        return one_line(name) if name else f"{kind}_{k}"

    def _unique(self, kind: str, k: int) -> str:
        """The name, and for a body called ``world`` also its number: the URDF's base link has that name."""
        name = self._name(kind, k)
        return f"{name}_{k}" if kind == "body" and name == "world" else name

    def _place(self, kind: str, k: int) -> Place:
        return Place(str(self.path), None, f"{kind} {self._name(kind, k)}")


def _nonzero(model: Any, name: str) -> int:
    """Number of nonzero entries of an array of the model; 0 if this version of MuJoCo does not have it."""
    return int(np.count_nonzero(getattr(model, name, 0)))


def _child(parent: Any, tag: str, **attributes: str) -> Any:
    """A new XML element at the end of ``parent``."""
    from lxml import etree

    return etree.SubElement(parent, tag, **attributes)


def _number(value: float) -> str:
    """A number as XML text: the shortest decimal of the double, and 0.0 for -0.0."""
    return repr(float(value) + 0.0)


def _numbers(values: Sequence[float] | Array) -> str:
    """Numbers as XML text, separated by spaces."""
    return " ".join(map(_number, values))
