"""Reading of the section ``urdf``: the content of the robot file is added to the document before its validation."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput, Place, PlaceOf
from codegen.spec.expression import exact_number
from codegen.spec.motion import KinematicTree, LinkTolerance, MovingBody
from codegen.spec.quantity import read_share
from codegen.spec.schema import RobotDocument, RobotSection
from codegen.spec.urdf import read_kinematic_tree
from codegen.spec.validation import nearest_place, validate

OF_ROBOT_FILE = ("coordinates", "inputs", "force")
"""Sections of a spec whose content comes from the robot file, so that the spec may not have them."""


def expand_robot(
    document: Mapping[str, Any], path: Path, places: Mapping[str, Place]
) -> tuple[dict[str, Any], KinematicTree | None]:
    """The document with the content of its robot file: a coordinate and an input per joint, g = w − h, joint friction.

    Without ``friction:`` each joint has a Coulomb contact and a viscous effect with the values of its ``<dynamics>``;
    with it, U is the identity unless a distribution is given.

    Args:
        document: a spec as plain data, not yet validated.
        path: of the spec, to which the path of the robot file is relative.
        places: key → its file and line.

    Returns:
        the completed document, and the tree; the unchanged document and None without ``urdf:``.
    """
    filled = dict(document)
    if "urdf" not in filled:
        return filled, None

    def place(key: str) -> Place:
        return nearest_place(key, places, str(path))

    section = validate(RobotDocument, {"urdf": filled["urdf"]}, places, str(path)).urdf
    tree = _read(section, path, place, "urdf" if isinstance(filled["urdf"], str) else "urdf.file")
    for key in OF_ROBOT_FILE:
        if filled.get(key) is not None:
            expected = "one of them, since the robot file gives the joints"
            raise BadInput(place(key), f"`{key}:` together with `urdf:`", expected, code="SPEC005")
    bodies, units = tree.bodies, {"revolute": "rad", "prismatic": "m"}
    filled["coordinates"] = {b.joint: {"velocity": f"v_{b.joint}", "unit": units[b.kind]} for b in bodies}
    filled["inputs"] = {f"w_{b.joint}": {"unit": _force_unit(b)} for b in bodies}
    filled["force"] = list(filled["inputs"])
    if filled.get("friction") is None:
        filled["friction"] = {"contacts": [_contact(b) for b in bodies]}
        damping = section.tolerance and section.tolerance.damping
        known = {"tolerance": damping} if damping else {}
        damped = [
            {"kind": "viscous", "on": b.joint, "parameters": {"b": b.damping}} | known for b in bodies if b.damping
        ]
        filled["effects"] = damped + list(filled.get("effects") or [])
    friction = filled["friction"]
    if isinstance(friction, Mapping) and friction.get("distribution") is None:
        identity = [[int(i == j) for j in range(len(bodies))] for i in range(len(bodies))]
        filled["friction"] = {**friction, "distribution": identity}
    return filled, tree


def _read(section: RobotSection, path: Path, place: PlaceOf, key: str) -> KinematicTree:
    """The tree of the section's robot file, which the spec names at ``key``, with tolerances and base parameters."""

    def exact(text: str, key: str) -> Fraction:
        return Fraction(str(exact_number(text, place(key))))

    gravity = [exact(text, f"urdf.gravity[{k}]") for k, text in enumerate(section.gravity)]
    tree = read_kinematic_tree(path.parent / section.file, place(key), gravity)
    stated = {} if section.tolerance is None else section.tolerance.model_dump(exclude_none=True)
    shares = {key: read_share(text, place(f"urdf.tolerance.{key}")) for key, text in stated.items()}
    links = {key: share for key, share in shares.items() if key != "damping"}
    base = tuple((name, exact(t, f"urdf.base_parameters.{name}")) for name, t in section.base_parameters.items())
    return replace(tree, tolerance=LinkTolerance(**links) if links else None, base_parameters=base)


def _contact(body: MovingBody) -> dict[str, Any]:
    return {"name": body.joint, "law": "coulomb", "unit": _force_unit(body), "a": body.friction}


def _force_unit(body: MovingBody) -> str:
    return "N*m" if body.kind == "revolute" else "N"
