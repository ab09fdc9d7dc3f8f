"""Robot files for the tests, and their matrices as systems give them in numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi
import numpy as np

from codegen.mechanics import System, build_system
from codegen.mechanics.casadi_form import to_casadi
from codegen.spec import parse_spec

SPECS = Path(__file__).parents[2] / "specs"
SEVEN = SPECS / "seven_joint_arm.urdf"

# A planar two-link arm in the vertical plane; angles grow against gravity, the second relative to the first.
TWO_LINKS = """<?xml version="1.0"?>
<robot name="two_links">
  <link name="base"/>
  <joint name="q 1" type="continuous">
    <parent link="base"/> <child link="upper"/> <axis xyz="0 -2 0"/>
  </joint>
  <link name="upper">
    <inertial>
      <origin xyz="0.3 0 0"/> <mass value="2"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/>
    </inertial>
  </link>
  <joint name="q-2" type="revolute">
    <origin xyz="0.5 0 0"/> <parent link="upper"/> <child link="lower"/> <axis xyz="0 -1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
    <dynamics damping="0.4" friction="0.7"/>
  </joint>
  <link name="lower">
    <inertial>
      <origin xyz="0.2 0 0"/> <mass value="1"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.12"/>
    </inertial>
  </link>
</robot>
"""

# A tree: a slide that carries two branches, one of them over a fixed link, with axes and frames askew.
TREE = """<robot name="tree">
  <link name="floor"/>
  <link name="cart">
    <inertial> <origin xyz="0.1 0 -0.2" rpy="0.3 0.1 -0.4"/> <mass value="3"/>
      <inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.2" iyz="0.03" izz="0.25"/> </inertial>
  </link>
  <joint name="slide" type="prismatic">
    <origin xyz="0.2 -0.1 0.3" rpy="0.2 -0.5 0.9"/> <parent link="floor"/> <child link="cart"/> <axis xyz="1 2 -1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <link name="left">
    <inertial> <origin xyz="0 0.2 0.1"/> <mass value="1.5"/>
      <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.03"/> </inertial>
  </link>
  <joint name="turn_left" type="continuous">
    <origin xyz="0.3 0.1 0" rpy="1.1 0.4 -0.3"/> <parent link="cart"/> <child link="left"/> <axis xyz="0.3 -1 0.5"/>
  </joint>
  <link name="bracket">
    <inertial> <origin xyz="0 0 0.1" rpy="0.5 0 0"/> <mass value="0.4"/>
      <inertia ixx="0.004" ixy="0" ixz="0.001" iyy="0.005" iyz="0" izz="0.006"/> </inertial>
  </link>
  <joint name="bolted" type="fixed">
    <origin xyz="-0.2 0 0.4" rpy="0.7 0.2 0.1"/> <parent link="cart"/> <child link="bracket"/>
  </joint>
  <link name="right">
    <inertial> <origin xyz="0.15 0 0"/> <mass value="0.9"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0.002" izz="0.02"/> </inertial>
  </link>
  <joint name="turn_right" type="continuous">
    <origin xyz="0 0.1 0.2" rpy="-0.4 0.8 0.6"/> <parent link="bracket"/> <child link="right"/> <axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def robot_system(folder: Path, urdf: str, more: str = "") -> System:
    """The system of a spec beside a robot file of this text."""
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    spec = parse_spec(f"name: robot\nurdf: robot.urdf\n{more}", folder / "robot.yaml")
    return build_system(spec)


def numbers(system: System, matrix: Any, x: Any, v: Any, w: Any = None) -> Any:
    """A matrix of the system at a motion."""
    n = system.degrees_of_freedom
    moving = (*system.positions, *system.velocities, *system.inputs)
    values = [*x, *v, *(np.zeros(n) if w is None else w)]
    names = {s: casadi.SX(float(a)) for s, a in system.values.items()}
    names |= {s: casadi.SX(float(a)) for s, a in zip(moving, values, strict=True)}
    return np.array(casadi.DM(casadi.densify(to_casadi(matrix, names))))
