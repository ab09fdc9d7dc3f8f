"""Export of friction into a user's own MuJoCo model: attributes of its joints, and elements added at the end.

Everything else is unchanged byte for byte: bodies, shapes, actuators, sensors, keyframes, comments. ``damping`` and
``frictionloss`` of a joint are set if the compiled model has other values, ``stiffness`` if the machine has one, and
``armature`` so that the joint's inertia is that of the machine. Elements that need a ``dcmotor`` or a tendon (cogging,
LuGre friction, friction between joints) are added at the end of the file.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, nearest_name
from codegen.base.input_files import read_bytes
from codegen.base.text import render
from codegen.export.bodies import number
from codegen.export.exporter import Remark
from codegen.export.mechanism import Mechanism
from codegen.export.mjcf import MjcfWriter
from codegen.export.xml_edit import edited
from codegen.spec.mjcf import EXPECTED, compiled
from codegen.spec.model import Spec
from codegen.spec.urdf import LARGEST, identifier

SAME = 1e-9
"""Relative difference below which a value of the file is kept as it is written."""
SAME_INERTIA = 1e-6
"""The same of an inertia, which MuJoCo adds up from bodies."""
FRICTION = ("damping", "frictionloss")
KEPT = {"damping": "dof_damping", "frictionloss": "dof_frictionloss", "armature": "dof_armature"}
"""Attribute of a joint → field of the compiled model, by degree of freedom."""


@dataclass(frozen=True)
class _Joint:
    """A joint of the user's model.

    Attributes:
        label: its name.
        dof: index of its degree of freedom.
        values: attribute → value in the compiled model.
        spring_force: force of its spring at zero.
    """

    label: str
    dof: int
    values: Mapping[str, float]
    spring_force: float


def mjcf_into(spec: Spec, mechanism: Mechanism, path: Path, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The text of the user's model with the machine's friction, and remarks.

    ``path``: the model; its joints are named like the coordinates. Raises BadInput for a file that is no model, a
    coordinate without a joint, or a joint in an included file.
    """
    mujoco, model = compiled(path)
    joints = _joints(mujoco, model)
    names = [x.name for x in mechanism.system.positions]
    for name in names:
        if name not in joints:
            found = f"no joint for the coordinate {name}"
            raise BadInput(str(path), found, "a joint of that name", nearest_name(name, joints), code="SPEC031")
    labels = {name: joints[name].label for name in names}
    rest = {name: joints[name].spring_force for name in names}
    writer = MjcfWriter(spec, mechanism, float(model.opt.timestep), labels)
    attributes = writer.add_to(rest)
    armatures, notes = _armatures(mujoco, model, mechanism, [joints[name] for name in names])
    remarks = (*notes, *writer.remarks)
    wanted = {name: {**attributes[name], **armatures.get(labels[name], {})} for name in names}
    changes = {labels[name]: _changed(joints[name], wanted[name]) for name in names}
    content = read_bytes(path, EXPECTED, LARGEST)
    edited = _edited(content, {label: new for label, new in changes.items() if new}, path)
    lines = [
        *header,
        f"of {path.name}, whose joints have other values, and new elements at the end",
        *writer.assumptions,
    ]
    lines = [*lines, *(r.text for r in remarks)]
    return _with_parts(edited, writer, lines, path), remarks


def _joints(mujoco: Any, model: Any) -> dict[str, _Joint]:
    """Hinge and slide joints with a name, by the identifier made of it."""
    found = {}
    moving = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}
    for j in range(model.njnt):
        label = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        if not label or int(model.jnt_type[j]) not in moving:
            continue
        dof = int(model.jnt_dofadr[j])
        values = {name: float(np.ravel(getattr(model, field)[dof])[0]) for name, field in KEPT.items()}
        values["stiffness"] = float(np.ravel(model.jnt_stiffness[j])[0])
        rest = values["stiffness"] * float(model.qpos_spring[model.jnt_qposadr[j]])
        found[identifier(label)] = _Joint(label, dof, values, rest)
    return found


def _armatures(
    mujoco: Any, model: Any, mechanism: Mechanism, joints: list[_Joint]
) -> tuple[dict[str, dict[str, str]], tuple[Remark, ...]]:
    """Joint → the armature with which its inertia is that of the machine, and remarks.

    None for the machine of a robot file, whose bodies are there and whose other inertias are armatures already.
    """
    found: dict[str, dict[str, str]] = {}
    remarks: list[Remark] = []
    if mechanism.tree is not None:
        return found, ()
    at_rest, elsewhere = (_rows(mujoco, model, joints, away) for away in (0.0, 1.0))
    for i, (joint, wanted) in enumerate(zip(joints, mechanism.inertias, strict=True)):
        has, before = float(at_rest[i, joint.dof]), joint.values["armature"]
        alone = np.eye(model.nv)[joint.dof] * has
        constant = all(np.allclose(row[i], alone, rtol=0, atol=SAME_INERTIA * has) for row in (at_rest, elsewhere))
        if constant and math.isclose(wanted, has, rel_tol=SAME_INERTIA):
            continue
        armature = before + wanted - has
        if constant and armature >= 0:
            found[joint.label] = {"armature": number(armature)}
            how = f"armature {number(armature)} instead of {number(before)}"
            remarks.append(Remark(f"inertia of {joint.label}", "exact", how))
            continue
        unit = "kg" if mechanism.system.position_units[i] == "m" else "kg*m^2"
        how = f"inertia differs: {wanted:.4g} in the spec against {has:.4g} {unit} in the file"
        if not constant:
            how += " in its reference position; in others it is another, or joints are coupled by it"
        remarks.append(Remark(f"inertia of {joint.label}", "dropped", how))
    return found, tuple(remarks)


def _rows(mujoco: Any, model: Any, joints: list[_Joint], away: float) -> Any:
    """Rows of the mass matrix for the joints, with every joint displaced by ``away`` from the reference position."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_integratePos(model, data.qpos, np.ones(model.nv), away)
    mujoco.mj_forward(model, data)
    rows = np.zeros((len(joints), model.nv))
    for row, joint in zip(rows, joints, strict=True):
        mujoco.mj_mulM(model, data, row, np.eye(model.nv)[joint.dof])
    return rows


def _changed(joint: _Joint, wanted: Mapping[str, str]) -> dict[str, str]:
    """Attributes with other values than in the model; friction that the machine does not have is set to zero."""
    new = {}
    for name, text in (dict.fromkeys(FRICTION, "0") | dict(wanted)).items():
        before, terms = joint.values.get(name), text.split()
        if before is None or len(terms) > 1 or not math.isclose(float(text), before, rel_tol=SAME, abs_tol=1e-300):
            new[name] = text
    return new


def _edited(content: bytes, changes: Mapping[str, Mapping[str, str]], path: Path) -> str:
    """The file with new attributes of the joints in ``changes``."""
    found: set[str] = set()

    def changed(opened: Sequence[str], attributes: Mapping[str, str]) -> Mapping[str, str]:
        label = attributes.get("name", "") if opened[-2:] == ["body", "joint"] else ""
        found.add(label)
        return changes.get(label, {})

    text = edited(content, path, "a model", EXPECTED, changed)
    for label in changes:
        if label not in found:
            expected = "it in this file itself: `<include>` and macros are not looked into"
            raise BadInput(str(path), f'the joint "{label}" is not written there', expected, code="SPEC031")
    return text


def _with_parts(text: str, writer: MjcfWriter, lines: list[str], path: Path) -> str:
    """The text with a comment at the top, which marks it as written by stiction, and new elements at the end."""
    end = text.rfind("</mujoco")
    if end < 0:
        raise BadInput(str(path), "no element mujoco with an end of its own", EXPECTED, code="SPEC030")
    comment = render("export/mjcf_comment.xml.j2", header=lines)
    added = render("export/mjcf_parts.xml.j2", tendons=writer.tendons, actuators=writer.actuators)
    declaration = re.match(r"\ufeff?(<\?xml[^>]*\?>[ \t]*\r?\n?)?", text)
    top = declaration.end() if declaration is not None else 0
    return text[:top] + comment + text[top:end] + added + text[end:]
