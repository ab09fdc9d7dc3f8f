"""Arms of seven joints, our own and the Panda: against Pinocchio in C++ and CasADi."""

from __future__ import annotations

import os
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from benchmarks.casadi_peer import casadi_peer
from benchmarks.compare import Candidate, compare
from benchmarks.model import Model, load
from benchmarks.peer import Missing
from benchmarks.pinocchio_peer import pinocchio_peer
from benchmarks.plain_c import our_peer
from benchmarks.result import OURS, Entry, Goal, Row, Table, ratio, where_it_goes
from benchmarks.text import render
from codegen.resources import resource_folder

PINOCCHIO, CASADI = "Pinocchio, C++", "CasADi, `cse`, LDLᵀ written out"
PANDA = "share/example-robot-data/robots/panda_description/urdf/panda.urdf"
FOLDER = "EXAMPLE_ROBOT_DATA"


def candidates(model: Model, robot: Path) -> list[Candidate]:
    return [
        (OURS, lambda: our_peer(model)),
        (PINOCCHIO, lambda: pinocchio_peer(model, robot, PINOCCHIO)),
        (CASADI, lambda: casadi_peer(model, CASADI, "ldl", cse=True)),
    ]


def panda_file() -> Path:
    """The Panda of the package example-robot-data, installed or in the folder that EXAMPLE_ROBOT_DATA names.

    Raises:
        Missing: where it is not here.
    """
    for folder in (os.environ.get(FOLDER, ""), *sys.path):
        for place in (Path(folder) / "cmeel.prefix" / PANDA, Path(folder) / PANDA):
            if folder and place.exists():
                return place
    raise Missing(f"the package `example-robot-data` is not installed, nor in a folder that {FOLDER} names")


def seven_joints(source: Path, target: Path) -> None:
    """The robot file with the fingers' joints fixed and without shapes."""
    tree = ElementTree.parse(source)
    for joint in tree.getroot().iter("joint"):
        if joint.get("type") == "prismatic":
            joint.set("type", "fixed")
            for tag in ("axis", "limit", "dynamics", "mimic", "safety_controller"):
                for element in joint.findall(tag):
                    joint.remove(element)
    for link in tree.getroot().iter("link"):
        for element in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(element)
    tree.write(target, encoding="utf-8", xml_declaration=True)


def panda(folder: Path) -> tuple[Model, Path]:
    """The Panda's model with the observer of our own arm, and its robot file.

    Raises:
        Missing: where the Panda is not here.
    """
    robot = folder / "panda.urdf"
    seven_joints(panda_file(), robot)
    spec = folder / "panda.yaml"
    spec.write_text(render("panda.yaml.j2", robot=robot.name), encoding="utf-8")
    return load(spec), robot


def row() -> Row:
    own = load("seven_joint_arm")
    found = compare(candidates(own, resource_folder("specs") / "seven_joint_arm.urdf"), own.rows())
    goals = [Goal("our own arm: at most 0.15 × Pinocchio", ratio(found, PINOCCHIO), 0.15)]
    notes = [where_it_goes(found[0]), where_it_goes(found[1])]
    tables: list[Table] = []
    try:
        with tempfile.TemporaryDirectory() as name:
            model, robot = panda(Path(name))
            others = compare(candidates(model, robot), model.rows())
        goals.append(Goal("Panda: at most 0.15 × Pinocchio", ratio(others, PINOCCHIO), 0.15))
        notes += [f"Panda: {where_it_goes(others[0])}"]
        found += [_renamed(entry) for entry in others]
    except Missing as missing:
        goals.append(Goal("Panda: at most 0.15 × Pinocchio", None, 0.15))
        notes.append(f"Panda: {missing}.")
    return Row(
        "Arms of seven joints, GTO with velocity observer, one step",
        "Pinocchio: the same step in C++ against the headers of its wheel (-O3): `crba`, `nonLinearEffects`, Eigen's "
        "`LDLT`, and the observer around them; its library is compiled as its makers did. Our own arm has general "
        "frames; the Panda is that of `example-robot-data` with its fingers fixed.",
        tuple(found),
        tuple(goals),
        tuple(notes),
        tuple(tables),
    )


def _renamed(entry: Entry) -> Entry:
    return Entry(f"Panda: {entry.name}", entry.count, entry.times, entry.difference, entry.note)
