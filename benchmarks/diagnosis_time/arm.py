"""An arm of seven joints from its robot file, whose elbow has a cogging that the spec lacks: 25 s at 200 Hz."""

from __future__ import annotations

import shutil
from pathlib import Path

import stiction
from codegen.base.resources import resource_folder

SPEC = "name: arm7\nurdf: {file: seven_joint_arm.urdf}\n"
LACKING = """effects:
  - {kind: cogging, on: [elbow_pitch], parameters: {amplitude: 2.0, period: 0.35, phase: 0.4}}
simulation:
  duration: 25
  sample_time: 0.005
  reference:
    shoulder_yaw: "0.9*sin(0.9*t) + 0.3*sin(2.3*t)"
    shoulder_pitch: "0.7*sin(1.1*t + 1) + 0.3*sin(2.9*t)"
    arm_roll: "0.9*sin(0.8*t + 2) + 0.3*sin(3.1*t)"
    elbow_pitch: "0.8*sin(1.3*t) + 0.25*sin(3.7*t + 1)"
    forearm_roll: "1.0*sin(1.0*t + 0.5) + 0.3*sin(4.1*t)"
    wrist_pitch: "0.8*sin(1.4*t + 1.5) + 0.3*sin(4.7*t)"
    hand_roll: "1.2*sin(1.2*t + 2.5) + 0.3*sin(4.3*t)"
"""
JOINTS = ("shoulder_yaw", "shoulder_pitch", "arm_roll", "elbow_pitch", "forearm_roll", "wrist_pitch", "hand_roll")
DAMPING = (12, 60, 5, 9, 1.2, 2, 0.12)


def _mapping(key: str, values: dict[str, float]) -> str:
    return f"  {key}: {{{', '.join(f'{name}: {value:g}' for name, value in values.items())}}}\n"


def simulated_arm(folder: Path) -> tuple[Path, Path]:
    """The spec without the effect and the log of the machine with it, written into a folder."""
    shutil.copy(resource_folder("specs") / "seven_joint_arm.urdf", folder / "seven_joint_arm.urdf")
    gains = {f"w_{name}": d for name, d in zip(JOINTS, DAMPING, strict=True)}
    loop = _mapping("velocity_gain", gains) + _mapping("position_gain", {n: 20 * d for n, d in gains.items()})
    loop += _mapping("position_noise", dict.fromkeys(JOINTS, 1e-5))
    spec, log = folder / "arm.yaml", folder / "log.csv"
    (folder / "plant.yaml").write_text(SPEC + LACKING + loop)
    spec.write_text(SPEC)
    if not log.exists():
        stiction.simulate(folder / "plant.yaml", log)
    return spec, log
