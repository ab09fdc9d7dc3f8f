"""M(x) and h(x, v) of a converted MuJoCo model, against MuJoCo's own at random states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.mechanics.build import build_system
from codegen.spec.mjcf import read_mjcf
from codegen.spec.reader import parse_spec
from mechanics.robots import numbers

mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")

ARM = """<mujoco>
  <compiler angle="radian"/>
  <option gravity="0.5 -0.2 -9.7"/>
  <default><joint damping="0.5"/></default>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="base" pos="0 0 .1" euler=".1 .2 .3">
      <geom type="box" size=".1 .1 .05" mass="1"/>
      <body name="upper" pos="0 0.05 .1" euler="0 1.5707963267948966 0">
        <joint name="shoulder pan" axis="0 .3 1" pos=".02 .01 0" frictionloss=".2" armature=".03" ref=".4"
          range="-1 2"/>
        <geom type="capsule" size=".03" fromto="0 0 0 .3 .05 0" mass="2"/>
        <body name="slider" pos=".3 0 0" quat="1 .2 .1 0">
          <joint name="slide" type="slide" axis="1 0 .2" ref=".05" armature=".5" stiffness="3" springref=".1"/>
          <inertial pos=".05 .01 .02" mass=".7" fullinertia=".01 .012 .013 .001 .002 .0005"/>
          <body name="tool" pos="0 0 .1"><geom type="sphere" size=".05" mass=".3"/></body>
          <body pos="0.1 0 0">
            <joint name="f" axis="0 1 0" pos="0 .1 .02" damping="0"/><geom type="box" size=".02 .03 .04" mass=".2"/>
          </body>
        </body>
      </body>
      <body name="second" pos="0 -.2 0"><joint axis="1 0 0"/><geom type="box" size=".02 .03 .2" mass=".8"/></body>
    </body>
    <body name="cube"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
  </worldbody>
  <actuator>
    <motor joint="shoulder pan" gear="50"/>
    <position name="servo" joint="slide" kp="20" kv="2" gear="3" forcerange="-3 3"/>
  </actuator>
</mujoco>
"""


def test_mass_matrix_and_bias_force_are_those_of_mujoco(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    robot = read_mjcf(tmp_path / "arm.xml")
    gravity = ", ".join(map(repr, robot.gravity))
    (tmp_path / "arm.urdf").write_text(robot.urdf)
    text = f"name: arm\nurdf: {{file: arm.urdf, gravity: [{gravity}]}}\n"
    system = build_system(parse_spec(text, tmp_path / "arm.yaml"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, n = mujoco.MjData(model), len(robot.joints)
    assert [j.joint for j in robot.joints] == ["shoulder_pan", "slide", "f", "joint_3"]
    at = [[j.joint for j in robot.joints].index(x.name) for x in system.positions]
    armature = np.diag([j.armature for j in robot.joints])
    generator = np.random.default_rng(3)
    for _ in range(40):
        x, v = generator.uniform(-3, 3, n), generator.normal(size=n)
        data.qpos[:n], data.qvel[:n] = x, v
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        ours = numbers(system, system.mass_matrix, x[at], v[at])
        assert np.abs(ours - (mass[:n, :n] - armature)[np.ix_(at, at)]).max() < 1e-12
        assert np.abs(-numbers(system, system.force, x[at], v[at]).ravel() - data.qfrc_bias[at]).max() < 1e-11


def test_what_a_robot_file_does_not_hold(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    robot = read_mjcf(tmp_path / "arm.xml")
    first, second = robot.joints[:2]
    assert (first.joint, first.armature, first.limits) == ("shoulder_pan", 0.03, (-1.0, 2.0))
    assert (second.joint, second.stiffness, second.rest) == ("slide", 3.0, 0.1)
    assert '<joint name="shoulder pan" type="continuous">' in robot.urdf
    assert '<joint name="slide" type="prismatic">' in robot.urdf
    assert 'damping="0.5" friction="0.2"' in robot.urdf
    said = "\n".join(robot.remarks)
    assert "actuator actuator_0 on shoulder pan: w_shoulder_pan = 50*ctrl" in said
    assert "actuator servo on slide: w_slide = 60*ctrl -180*slide -18*v_slide, force within -3.0 3.0" in said
    assert "free body cube: left out" in said and "contacts between bodies" in said and "forces at the limits" in said


BODY = '<body name="a">{}<geom type="sphere" size=".1"/></body>'
REFUSED = {
    "no XML": ("no XML", "arm.xml"),
    "no joint": (BODY.format(""), "no hinge or slide joint"),
    "a ball": (BODY.format('<joint type="ball"/>'), "joint joint_0: a ball joint"),
    "two": (BODY.format('<joint axis="1 0 0"/><joint/>'), "body a: 2 joints on one body"),
    "floating": (BODY.format("<freejoint/>" + BODY.replace('"a"', '"b"').format("<joint/>")), "on a floating base"),
    "a wrong word": ("\n" + BODY.format('<joint armatur="1"/>'), "arm.xml:2: "),
    "an absent file": ('<include file="../none.xml"/>', "arm.xml"),
    "a loop of files": ('<include file="arm.xml"/>', "arm.xml"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(tmp_path: Path, case: str) -> None:
    inner, words = REFUSED[case]
    (tmp_path / "arm.xml").write_text(f"<mujoco><worldbody>{inner}</worldbody></mujoco>")
    with pytest.raises(BadInput) as told:
        read_mjcf(tmp_path / "arm.xml")
    assert words in str(told.value) and "\n" not in str(told.value)
