"""Reading of the section ``urdf``: the content of the robot file is added to the document before its validation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput, Place, refuse_unknown
from codegen.spec.expression import exact_number
from codegen.spec.motion import KinematicTree, LinkTolerance, MovingBody
from codegen.spec.quantity import read_share
from codegen.spec.urdf import STANDARD_GRAVITY, read_kinematic_tree

GIVEN = ("coordinates", "inputs", "force")
PARTS = ("file", "gravity", "tolerance", "base_parameters")
DAMPING = "damping"
TOLERANCES = (*(f.name for f in fields(LinkTolerance)), DAMPING)


def expand_robot(
    document: Mapping[str, Any], path: Path, place: Callable[[str], Place]
) -> tuple[dict[str, Any], KinematicTree | None]:
    """The document with the content of its robot file: a coordinate and an input per joint, g = w − h, joint friction.

    Without ``friction:`` each joint has a Coulomb contact and a viscous effect with the values of its ``<dynamics>``;
    with it, U is the identity unless a distribution is given.

    Args:
        document: a spec as plain data, not yet validated.
        path: of the spec, to which the path of the robot file is relative.
        place: key → its file and line.

    Returns:
        the completed document, and the tree; the unchanged document and None without ``urdf:``.

    Raises:
        BadInput: for an invalid robot file, or for sections that the robot file replaces.
    """
    filled = dict(document)
    if filled.get("urdf") is None:
        return filled, None
    tree = _read(filled["urdf"], path, place)
    for key in GIVEN:
        if filled.get(key) is not None:
            expected = "one of them, since the robot file gives the joints"
            raise BadInput(place(key), f"`{key}:` together with `urdf:`", expected, code="SPEC005")
    bodies = tree.bodies
    filled["coordinates"] = {b.joint: {"velocity": f"v_{b.joint}", "unit": _position_unit(b)} for b in bodies}
    filled["inputs"] = {f"w_{b.joint}": {"unit": _force_unit(b)} for b in bodies}
    filled["force"] = list(filled["inputs"])
    if filled.get("friction") is None:
        filled["friction"] = {"contacts": [_contact(b) for b in bodies]}
        known = _damping_tolerance(document["urdf"])
        damped = [
            {"kind": "viscous", "on": b.joint, "parameters": {"b": b.damping}} | known for b in bodies if b.damping
        ]
        filled["effects"] = damped + list(filled.get("effects") or [])
    friction = filled["friction"]
    if isinstance(friction, Mapping) and friction.get("distribution") is None:
        identity = [[int(i == j) for j in range(len(bodies))] for i in range(len(bodies))]
        filled["friction"] = {**friction, "distribution": identity}
    return filled, tree


def _read(section: Any, path: Path, place: Callable[[str], Place]) -> KinematicTree:
    parts = section if isinstance(section, Mapping) else {"file": section}
    for key in parts:
        refuse_unknown(key, PARTS, place(f"urdf.{key}"), "unknown key", ", ".join(PARTS), code="SPEC004")
    file, at = parts.get("file"), place("urdf.file" if isinstance(section, Mapping) else "urdf")
    if not isinstance(file, str) or not file.strip() or "\0" in file:
        expected = "the path of a robot description, relative to the spec"
        raise BadInput(at, f"`{file}` as a file", expected, code="SPEC006")
    tree = read_kinematic_tree(path.parent / file, at, _gravity(parts, place))
    return replace(tree, tolerance=_tolerance(parts, place), base_parameters=_base_parameters(parts, place))


def _gravity(parts: Mapping[str, Any], place: Callable[[str], Place]) -> tuple[Fraction, ...]:
    gravity = parts.get("gravity")
    if gravity is None and "gravity" not in parts:
        return STANDARD_GRAVITY
    if not isinstance(gravity, list) or len(gravity) != 3:
        expected = "three numbers in m/s^2, such as [0, 0, -9.81]"
        raise BadInput(place("urdf.gravity"), f"`{gravity}`", expected, code="SPEC006")
    return tuple(Fraction(str(exact_number(str(g), place(f"urdf.gravity[{k}]")))) for k, g in enumerate(gravity))


def _tolerance(parts: Mapping[str, Any], place: Callable[[str], Place]) -> LinkTolerance | None:
    given = parts.get("tolerance")
    if given is None:
        return None
    expected = "`mass`, `centre_of_mass`, `inertia` and `damping`, or some of them, each with a share such as 20 %"
    if not isinstance(given, Mapping) or not given:
        raise BadInput(place("urdf.tolerance"), f"`{given}`", expected, code="SPEC006")
    for key in given:
        refuse_unknown(key, TOLERANCES, place(f"urdf.tolerance.{key}"), "unknown key", expected, code="SPEC004")
    shares = {key: read_share(str(v), place(f"urdf.tolerance.{key}")) for key, v in given.items()}
    links = {key: share for key, share in shares.items() if key != DAMPING}
    return LinkTolerance(**links) if links else None


def _damping_tolerance(section: Any) -> dict[str, str]:
    """The tolerance of joint damping as an entry of the viscous effects; empty if none is given."""
    given = section.get("tolerance") if isinstance(section, Mapping) else None
    return {"tolerance": str(given[DAMPING])} if given and DAMPING in given else {}


def _base_parameters(parts: Mapping[str, Any], place: Callable[[str], Place]) -> tuple[tuple[str, Fraction], ...]:
    given = parts.get("base_parameters")
    if given is None:
        return ()
    if not isinstance(given, Mapping):
        expected = "names with numbers, as a diagnosis writes them"
        raise BadInput(place("urdf.base_parameters"), f"`{given}`", expected, code="SPEC006")
    found = []
    for name, value in given.items():
        at = place(f"urdf.base_parameters.{name}")
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise BadInput(at, f"`{value}`", "a number in SI units", code="SPEC006")
        found.append((str(name), Fraction(str(exact_number(str(value), at)))))
    return tuple(found)


def _contact(body: MovingBody) -> dict[str, Any]:
    return {"name": body.joint, "law": "coulomb", "unit": _force_unit(body), "a": body.friction}


def _position_unit(body: MovingBody) -> str:
    return "rad" if body.kind == "revolute" else "m"


def _force_unit(body: MovingBody) -> str:
    return "N*m" if body.kind == "revolute" else "N"
