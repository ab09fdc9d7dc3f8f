"""Diagnosis of an arm that a robot file gives: what its <dynamics> says is written out, and the loop closes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mechanics.robots import TWO_LINKS

import stiction
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.augment import augmented_text
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import build_system
from codegen.spec import parse_spec, read_spec
from tests.diagnosis.stage import among, log_of, system_of

ARM = """name: arm
urdf: arm.urdf   # two links
observer: {kind: gto, velocity: estimated, gains: {K_2: [-40, -20], K_v: 100}, sample_time: 0.001}
envelope: {q_1: [-3, 3], q_2: [-3, 3], v_q_1: [-3, 3], v_q_2: [-3, 3]}
log: {cutoff_hz: 20}
"""
LACKING = """friction:
  contacts:
    - {name: q_1, law: coulomb, a: 0.4, unit: N*m}
    - {name: q_2, law: coulomb, a: 0.7, unit: N*m}
effects:
  - {kind: viscous, on: [q_2], parameters: {b: 0.4}}
  - {kind: cogging, on: [q_1], parameters: {amplitude: 0.6, period: 0.5, phase: 0.3}}
simulation:
  duration: 40
  sample_time: 0.002
  reference: {q_1: "0.9*sin(1.3*t) - 1.2", q_2: "0.8*sin(2.1*t) + 0.3*sin(5*t)"}
  position_gain: {w_q_1: 300, w_q_2: 120}
  velocity_gain: {w_q_1: 40, w_q_2: 12}
  position_noise: {q_1: 1e-5, q_2: 1e-5}
"""

PENDULUM = """<robot name="pendulum">
  <link name="base"/>
  <joint name="q" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 -1 0"/></joint>
  <link name="rod">
    <inertial><origin xyz="%s"/><mass value="2"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
  </link>
</robot>
"""
SWING = """name: pendulum
urdf: {file: rod.urdf, tolerance: {centre_of_mass: 20 %}}
friction: {contacts: [{name: q, law: coulomb, a: 0.4, unit: N*m}]}
simulation:
  duration: 12
  sample_time: 0.004
  reference: {q: "0.9*sin(1.3*t) + 0.5*sin(3.1*t) - 1.2"}
  position_gain: {w_q: 300}
  velocity_gain: {w_q: 40}
  position_noise: {q: 1e-5}
"""


def test_what_the_robot_file_says_of_friction_is_written_out(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    spec = parse_spec(ARM, tmp_path / "arm.yaml")
    system = add_declared_effects(build_system(spec), spec)
    text = augmented_text(spec, [FoundEffect("offset", "q_1", {"f0": 0.25}, {"f0": "N*m"})], {"q_2_a": 0.75}, system)
    assert "# two links" in text
    written = parse_spec(text, tmp_path / "spec.yaml")
    again = add_declared_effects(build_system(written), written)
    assert (again.mass_matrix, again.force.shape) == (system.mass_matrix, system.force.shape)
    values = {s.name: float(v) for s, v in again.values.items()}
    expected = {s.name: float(v) for s, v in system.values.items()} | {"q_2_a": 0.75, "offset_q_1_f0": 0.25}
    assert values == expected


@pytest.mark.slow
def test_the_loop_closes_on_a_robot_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    (tmp_path / "arm.yaml").write_text(ARM)
    (tmp_path / "plant.yaml").write_text(ARM + LACKING)
    stiction.simulate(tmp_path / "plant.yaml", tmp_path / "log.csv")
    result = stiction.diagnose(tmp_path / "arm.yaml", tmp_path / "log.csv", out=tmp_path / "out")
    (effect,) = result.diagnosis.effects
    assert (effect.kind, effect.on) == ("cogging", "q_1")
    assert effect.parameters["amplitude"] == pytest.approx(0.6, rel=0.03)
    assert effect.parameters["period"] == pytest.approx(0.5, rel=0.01)
    assert read_spec(tmp_path / "out" / "spec.yaml").robot is not None


def test_a_moment_that_is_zero_in_the_robot_file_is_refitted_and_told(tmp_path: Path) -> None:
    """The centre of mass is 20 mm beside the rod's axis; a tolerance has no share of a declared zero.

    An interval whose ends print alike is left out.
    """
    folders = {"plant": "0.3 0 0.02", "declared": "0.28 0 0"}
    specs = {}
    for name, centre in folders.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "rod.urdf").write_text(PENDULUM % centre)
        specs[name] = parse_spec(SWING, tmp_path / name / "pendulum.yaml")
    log = log_of(specs["plant"], tmp_path, "log.csv")
    with among("offset"):
        found, _ = diagnose_log(specs["declared"], system_of(specs["declared"]), log, None)
    assert found.verdict == "none"
    (told,) = [fact for fact in found.statement.facts if "is written in place of 0 kg*m" in fact.words]
    assert "q_my = 0.0" in told.words and "within its tolerance of 0.112 kg*m." in told.words
    about_values = [fact for fact in found.statement.facts if "is written in place of" in fact.words]
    ends = [re.search(r": (\S+) to (\S+) kg", fact.detail) for fact in about_values if fact.detail]
    assert len(ends) == len(about_values)
    assert all(end is not None and end[1] != end[2] for end in ends)  # also of q_mx, which is known to five digits
