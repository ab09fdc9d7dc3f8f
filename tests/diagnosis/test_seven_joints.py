"""A seven-joint arm from its robot file, 25 s at 200 Hz: the effect that one joint lacks, in three minutes of CPU."""

from __future__ import annotations

import resource
import shutil
from pathlib import Path

import pytest
from mechanics.robots import SEVEN

import stiction

SPEC = "name: arm7\nurdf: {file: seven_joint_arm.urdf%s}\n"
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
LONGEST_S = 180


def _mapping(key: str, values: dict[str, float]) -> str:
    return f"  {key}: {{{', '.join(f'{name}: {value:g}' for name, value in values.items())}}}\n"


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


@pytest.mark.slow
def test_the_joint_that_lacks_an_effect_is_found_in_three_minutes(tmp_path: Path) -> None:
    shutil.copy(SEVEN, tmp_path / "seven_joint_arm.urdf")
    gains = {f"w_{name}": d for name, d in zip(JOINTS, DAMPING, strict=True)}
    loop = _mapping("velocity_gain", gains) + _mapping("position_gain", {n: 20 * d for n, d in gains.items()})
    loop += _mapping("position_noise", dict.fromkeys(JOINTS, 1e-5))
    (tmp_path / "plant.yaml").write_text(SPEC % "" + LACKING + loop)
    (tmp_path / "arm.yaml").write_text(SPEC % "")
    stiction.simulate(tmp_path / "plant.yaml", tmp_path / "log.csv")
    told: list[tuple[str, float]] = []
    before = _cpu()
    result = stiction.diagnose(
        tmp_path / "arm.yaml",
        tmp_path / "log.csv",
        out=tmp_path / "out",
        progress=lambda station, share: told.append((station, share)),
    )
    assert _cpu() - before < LONGEST_S
    (effect,) = result.diagnosis.effects
    assert (effect.kind, effect.on) == ("cogging", "elbow_pitch")
    assert effect.parameters["amplitude"] == pytest.approx(2.0, rel=0.02)
    assert effect.parameters["period"] == pytest.approx(0.35, rel=0.002)
    assert len(told) > 50
