"""Export as SDF 1.9 for Gazebo: joints with damping, friction, a linear spring and an effort limit."""

from __future__ import annotations

from codegen.base.text import render
from codegen.export.bodies import links_of
from codegen.export.joints import joint_terms
from codegen.export.mechanism import Mechanism
from codegen.export.numbers import numbers
from codegen.export.remarks import Remark
from codegen.spec.model import Spec


def sdf_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The text of the file, and remarks; in SDF gravity is a property of the world, not of the model."""
    joints, remarks = joint_terms(spec, mechanism, "SDF", springs=True)
    if mechanism.tree is None:
        how = "the spec states its forces itself: put the model into a world without gravity"
        remarks = (*remarks, Remark("gravity", "nearest", how))
    lines = [*header, *(r.text for r in remarks)]
    pairs = list(zip(links_of(mechanism), joints, strict=True))
    return render("export/model.sdf.xml.j2", name=spec.name, header=lines, pairs=pairs, n=numbers), remarks
