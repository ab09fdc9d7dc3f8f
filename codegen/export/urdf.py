"""Export as URDF, where the spec's robot file keeps all but its friction, or a new file; and as SDF 1.9 for Gazebo."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.base.input_files import read_bytes
from codegen.base.text import render
from codegen.export.bodies import links_of, number, numbers
from codegen.export.exporter import Remark
from codegen.export.joints import JointTerms, joint_terms
from codegen.export.mechanism import Mechanism
from codegen.export.xml_edit import edited
from codegen.spec.model import Spec
from codegen.spec.urdf import LARGEST


def urdf_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The text of the file, and remarks.

    If the spec has a robot file, this is edited: ``damping`` and ``friction`` of each joint's ``<dynamics>``, and
    ``effort`` of a ``<limit>`` if a saturation is declared. Everything else is unchanged byte for byte.
    """
    joints, remarks = joint_terms(spec, mechanism, "URDF", springs=False)
    lines = [*header, *(r.text for r in remarks)]
    if mechanism.tree is not None and mechanism.tree.path is not None:
        labels = {body.joint: body.label for body in mechanism.tree.bodies}
        robot = _edited(spec, mechanism.tree.path, {labels[j.name]: j for j in joints})
        return render("export/edited.urdf.xml.j2", header=lines) + robot, remarks
    pairs = list(zip(links_of(mechanism), joints, strict=True))
    return render("export/robot.urdf.xml.j2", name=spec.name, header=lines, pairs=pairs, n=numbers), remarks


def sdf_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The text of an SDF file, and remarks; in SDF gravity is a property of the world, not of the model."""
    joints, remarks = joint_terms(spec, mechanism, "SDF", springs=True)
    if mechanism.tree is None:
        how = "the spec states its forces itself: put the model into a world without gravity"
        remarks = (*remarks, Remark("gravity", "nearest", how))
    lines = [*header, *(r.text for r in remarks)]
    pairs = list(zip(links_of(mechanism), joints, strict=True))
    return render("export/model.sdf.xml.j2", name=spec.name, header=lines, pairs=pairs, n=numbers), remarks


def _edited(spec: Spec, path: Path, joints: Mapping[str, JointTerms]) -> str:
    """The text of the edited robot file, without its XML declaration."""
    expected = "a robot description (URDF)"
    content = read_bytes(path, expected, LARGEST, spec.place("urdf"))
    joint: JointTerms | None = None
    has_dynamics = False

    def changed(opened: Sequence[str], attributes: Mapping[str, str]) -> dict[str, str]:
        nonlocal joint, has_dynamics
        values: dict[str, float] = {}
        if opened == ["robot", "joint"]:
            joint, has_dynamics = joints.get(attributes.get("name", "")), False
        elif opened == ["robot", "joint", "dynamics"] and joint is not None:
            has_dynamics, values = True, {"damping": joint.damping, "friction": joint.friction}
        elif opened == ["robot", "joint", "limit"] and joint is not None and joint.effort is not None:
            values = {"effort": joint.effort}
        there = {name: value for name, value in values.items() if name in attributes or value != 0}
        return {name: number(value) for name, value in there.items() if not _is(attributes.get(name, ""), value)}

    def added(opened: Sequence[str]) -> str:
        if opened != ["robot", "joint"] or joint is None or has_dynamics or not (joint.damping or joint.friction):
            return ""
        return f'  <dynamics damping="{number(joint.damping)}" friction="{number(joint.friction)}"/>\n  '

    text = edited(content, path, "a robot description", expected, changed, added)
    text = text.removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}").lstrip()
    return text.partition("?>")[2].lstrip() if text.startswith("<?xml") else text


def _is(text: str, value: float) -> bool:
    """Whether an attribute's text is this number."""
    try:
        return float(text) == value
    except ValueError:  # a limit's effort, which nothing has read before
        return False
