"""Arms of seven joints, our own and the Panda: against Pinocchio in C++ and CasADi."""

from __future__ import annotations

import sysconfig
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.measure.build import Missing
from benchmarks.measure.compare import Candidate, compare
from benchmarks.model import Model, load
from benchmarks.peers.casadi_c import casadi_peer
from benchmarks.peers.pinocchio_cpp import pinocchio_peer
from benchmarks.peers.plain_c import our_peer
from benchmarks.result import OURS, Entry, Goal, Row, ratio, where_it_goes
from benchmarks.text import render
from codegen.base.resources import resource_folder

PINOCCHIO, CASADI = "Pinocchio, C++", "CasADi, `cse`, LDLᵀ written out"
PANDA = "share/example-robot-data/robots/panda_description/urdf/panda.urdf"
OWN = "seven_joint_arm"
LIMIT = 0.15


def candidates(model: Model, robot: Path) -> list[Candidate]:
    return [
        (OURS, lambda: our_peer(model)),
        (PINOCCHIO, lambda: pinocchio_peer(model, robot, PINOCCHIO)),
        (CASADI, lambda: casadi_peer(model, CASADI, "ldl", cse=True)),
    ]


def panda_file() -> Path:
    """The Panda of the package example-robot-data. Raises Missing where it is not installed."""
    place = Path(sysconfig.get_path("purelib")) / "cmeel.prefix" / PANDA
    if not place.exists():
        raise Missing("not installed: `pip install example-robot-data`")
    return place


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

    Raises Missing where the Panda is not here.
    """
    robot = folder / "panda.urdf"
    seven_joints(panda_file(), robot)
    spec = folder / "panda.yaml"
    spec.write_text(render("panda.yaml.j2", robot=robot.name), encoding="utf-8")
    return load(spec), robot


def goals(entries: Sequence[Entry] = ()) -> tuple[Goal, ...]:
    """The goals by instructions and by time; not available without entries."""
    text = "Panda: at most 0.15 × Pinocchio"
    times = {e.name: e.times.median for e in entries if e.times is not None}
    by_time = times[OURS] / times[PINOCCHIO] if {OURS, PINOCCHIO} <= times.keys() else None
    return Goal(text, ratio(entries, PINOCCHIO), LIMIT), Goal(text, by_time, LIMIT, basis="median time")


def row() -> Row:
    own = load(OWN)
    robot = resource_folder("specs") / f"{OWN}.urdf"
    entries = named("our own arm", compare([c for c in candidates(own, robot) if c[0] != PINOCCHIO], own.rows()))
    try:
        with tempfile.TemporaryDirectory() as name:
            model, robot = panda(Path(name))
            found = compare(candidates(model, robot), model.rows())
        entries, reached = named("Panda", found) + entries, goals(found)
    except Missing as missing:
        entries, reached = [*entries, Entry("Panda", note=str(missing))], goals()
    return Row(
        "seven_joint_arm",
        "Arms of seven joints, GTO with velocity observer, one step",
        tuple(entries),
        reached,
        facts={"spent": [where_it_goes(entry) for entry in entries if entry.count is not None][:2]},
    )


def named(arm: str, entries: Sequence[Entry]) -> list[Entry]:
    """Entries with the arm before their names."""
    return [replace(entry, name=f"{arm}: {entry.name}", ours=entry.name == OURS) for entry in entries]
