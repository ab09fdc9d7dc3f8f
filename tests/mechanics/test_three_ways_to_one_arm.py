"""The two-link arm of section 4.8 by its energies and by a robot file: one M and one g."""

from __future__ import annotations

from pathlib import Path

import casadi
import numpy as np

from codegen.mechanics import System, build_system
from codegen.mechanics.casadi_form import to_casadi
from codegen.spec import parse_spec, read_spec

SPECS = Path(__file__).parents[2] / "specs"

LINK = """<link name="{name}"><inertial><origin xyz="{b} 0 0"/><mass value="{m}"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>
<joint name="{joint}" type="continuous"><parent link="{parent}"/><child link="{name}"/>
<origin xyz="{at} 0 0"/><axis xyz="0 -1 0"/></joint>"""


def robot() -> str:
    """Section 4.8's numbers; the arm moves in the plane of gravity, its angles grow against it."""
    first = LINK.format(name="one", b=0.04, m=0.7718, inertia=0.00863, joint="theta1", parent="base", at=0)
    second = LINK.format(name="two", b=0.065, m=0.2713, inertia=0.00132, joint="theta2", parent="one", at=0.205)
    return f'<robot name="arm"><link name="base"/>{first}{second}</robot>'


def numbers(system: System) -> casadi.Function:
    """(x, v, w) → M and g."""
    values = {s: float(v) for s, v in system.values.items()}
    groups = (system.positions, system.velocities, system.inputs)
    columns = [casadi.SX.sym(name, len(group)) for name, group in zip("xvw", groups, strict=True)]
    names = values | {s: c[k] for group, c in zip(groups, columns, strict=True) for k, s in enumerate(group)}
    both = [casadi.densify(to_casadi(m, names)) for m in (system.mass_matrix, system.force)]
    return casadi.Function("arm", columns, both)


def test_the_two_link_arm_is_one_system_by_lagrangian_and_by_urdf(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot())
    text = "name: arm\nurdf: {file: arm.urdf, gravity: [0, 0, -9.8]}\n"
    by_robot = numbers(build_system(parse_spec(text, tmp_path / "arm.yaml")))
    by_energies = numbers(build_system(read_spec(SPECS / "two_link_arm.yaml")))
    generator = np.random.default_rng(3)
    for _ in range(50):
        point = [generator.uniform(-s, s, 2) for s in (np.pi, 20.0, 3.0)]
        for ours, theirs in zip(by_robot(*point), by_energies(*point), strict=True):
            np.testing.assert_allclose(ours.full(), theirs.full(), rtol=0, atol=1e-12)
