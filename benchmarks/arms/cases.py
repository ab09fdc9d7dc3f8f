"""The cases: an arm, its drives, and what its spec lacks; made once into folders as practice cases have them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from benchmarks.arms.drive import Drives, record
from benchmarks.arms.plant import Extra, Plant, extra
from benchmarks.arms.robots import ROBOTS, Joint, built, urdf
from benchmarks.text import render
from codegen.base.files import write_atomically

SMALL, MIDDLE = Drives("pd", 500, 500, 20), Drives("pd", 1000, 250, 24)
SIX, SEVEN = Drives("cascade", 1000, 200, 25), Drives("pd", 200, 200, 25)
FOREIGN, PAYLOAD = "push", "payload"
"""A force from outside, and a load at the last link; neither is an effect of the catalogue."""


@dataclass(frozen=True)
class ArmCase:
    """One case; its seed decides the machine's figures, both references and the noise.

    Attributes:
        robot: of ``ROBOTS``. kind: an effect of the catalogue, ``FOREIGN``, ``PAYLOAD`` or nothing.
        on: joint of the effect. parameters: of the effect, SI.
    """

    robot: str
    drives: Drives
    seed: int
    kind: str = ""
    on: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"{self.robot}_{self.kind or 'none'}"

    @property
    def joints(self) -> int:
        return len(ROBOTS[self.robot])

    @property
    def in_catalogue(self) -> bool:
        return self.kind not in ("", FOREIGN, PAYLOAD)

    @property
    def group(self) -> str:
        """As in the practice logs; a payload makes declared values wrong, and no effect is missing."""
        return "single" if self.in_catalogue else "foreign" if self.kind == FOREIGN else "none"


CASES = (
    ArmCase("planar_2r", SMALL, 11),
    ArmCase("planar_2r", SMALL, 12, "cogging", "q2", {"amplitude": 0.25, "period": 0.35, "phase": 0.5}),
    ArmCase("anthropomorphic_3r", SMALL, 13, "stribeck", "shoulder", {"delta": 1.5, "v_s": 0.12}),
    ArmCase("anthropomorphic_3r", SMALL, 14, PAYLOAD, "elbow", {"mass": 2.0}),
    ArmCase("scara_4", MIDDLE, 15, "spring", "lift", {"k": 60.0}),
    ArmCase("scara_4", MIDDLE, 16, FOREIGN, "forearm", {"peak": 6.0, "width": 0.6, "every": 7.3}),
    ArmCase("six_joints", SIX, 17),
    ArmCase("six_joints", SIX, 18, "load_dependent_friction", "a2", {"mu": 0.06}),
    ArmCase("six_joints", SIX, 19, "offset", "a5", {"f0": 0.5}),
    ArmCase("six_joints", SIX, 20, "input_gain", "a3", {"gain": 0.85}),
    ArmCase("seven_joints", SEVEN, 21, "cogging", "e4", {"amplitude": 0.8, "period": 0.39, "phase": -1.0}),
    ArmCase("seven_joints", SEVEN, 22, "viscous_asymmetry", "w6", {"d_b": 0.12}),
    ArmCase("seven_joints", SEVEN, 23, "friction_drift", "s2", {"delta": 1.4, "T": 8.0}),
)


def made(case: ArmCase, folder: Path) -> Path:
    """The folder of a case below another: arm.urdf, spec.yaml, train.csv, test.csv and truth.json, made on demand."""
    target, entry = folder / case.name, _truth(case)
    kept = target / "truth.json"
    if kept.is_file() and json.loads(kept.read_text()) == entry:
        return target
    target.mkdir(parents=True, exist_ok=True)
    sheet = ROBOTS[case.robot]
    write_atomically(target / "arm.urdf", urdf(case.robot, sheet))
    write_atomically(target / "spec.yaml", render("arm.yaml.j2", name=case.robot, joints=sheet))
    names = [joint.name for joint in sheet]
    head = ",".join(["t", *names, *(f"w_{name}" for name in names)])
    for k, log in enumerate(("train", "test")):
        rows = record(_plant(case, sheet), sheet, case.drives, 2 * case.seed + k)
        lines = (",".join(f"{value:.10g}" for value in row) for row in rows)
        write_atomically(target / f"{log}.csv", "\n".join([head, *lines]) + "\n")
    write_atomically(kept, json.dumps(entry, indent=1) + "\n")
    return target


def _plant(case: ArmCase, sheet: tuple[Joint, ...]) -> Plant:
    joints = built(sheet, case.seed)
    at = [joint.name for joint in sheet].index(case.on) if case.on else 0
    if case.kind == PAYLOAD:
        joints = (*joints[:at], _loaded(joints[at], case.parameters["mass"]), *joints[at + 1 :])
    added = extra(case.kind, case.parameters) if case.kind and case.kind != PAYLOAD else Extra()
    return Plant(joints, added, at)


def _loaded(joint: Joint, mass: float) -> Joint:
    """The link with a point mass at twice the distance of its centre; products of inertia are left out."""
    total = joint.mass + mass
    centre = np.array(joint.centre)
    moved = (joint.mass * centre + mass * 2 * centre) / total
    between = joint.mass * mass / total
    inertia = np.array(joint.inertia) + between * (centre @ centre - centre**2)
    return replace(joint, mass=total, centre=tuple(map(float, moved)), inertia=tuple(map(float, inertia)))


def _truth(case: ArmCase) -> dict[str, object]:
    """The truth of a case, in the fields of a practice case, with the arm and its seed."""
    entry = {"kind": case.kind, "on": case.on, "parameters": dict(case.parameters)}
    return {
        "group": case.group,
        "robot": case.robot,
        "seed": case.seed,
        "effects": [entry] if case.in_catalogue else [],
        "equivalents": [[]] if case.in_catalogue else [],
        "foreign": entry if case.kind == FOREIGN else None,
        "payload": entry if case.kind == PAYLOAD else None,
    }
