"""M(x) and h(x, v) of robot files, against Pinocchio, a closed form, energy, and finite differences."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import sympy

from codegen.mechanics.system import System
from codegen.spec.model import symbol
from mechanics.robots import SEVEN, TREE, TWO_LINKS, numbers, robot_system

SEVEN_TEXT = SEVEN.read_text(encoding="utf-8")
STILL = TREE.replace('"prismatic"', '"continuous"')


def panda() -> str:
    """The Panda of ``example-robot-data``; its fingers' mimic taken out, since Pinocchio too then moves both."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed (131 MB)")
    (path,) = (f for f in files if f.match("panda_description/urdf/panda.urdf"))
    text = Path(str(path.locate())).read_text(encoding="utf-8")
    return "\n".join(line for line in text.splitlines() if "<mimic" not in line)


@pytest.mark.parametrize(
    "text", [SEVEN_TEXT, TREE, STILL, TWO_LINKS, panda], ids=["seven", "tree", "turns", "two", "panda"]
)
def test_mass_matrix_and_bias_force_are_those_of_pinocchio(text, tmp_path: Path) -> None:
    text = text() if callable(text) else text
    system = robot_system(tmp_path, text)
    model = pin.buildModelFromXML(text)
    data, n = model.createData(), system.degrees_of_freedom
    labels = {name.replace(" ", "_").replace("-", "_"): name for name in model.names}
    joints = [model.joints[model.getJointId(labels[x.name])] for x in system.positions]
    at = [j.idx_v for j in joints]
    generator = np.random.default_rng(11)
    for _ in range(40):
        x, v = generator.uniform(-3, 3, n), generator.normal(size=n)
        theirs, rates = pin.neutral(model), np.zeros(n)
        for joint, position, velocity in zip(joints, x, v, strict=True):
            circle = joint.nq == 2  # Pinocchio keeps a joint without limits as a point of the unit circle
            theirs[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(position), np.sin(position)] if circle else position
            rates[joint.idx_v] = velocity
        upper = np.triu(pin.crba(model, data, theirs))
        mass = (upper + np.triu(upper, 1).T)[np.ix_(at, at)]
        bias = pin.nonLinearEffects(model, data, theirs, rates)[at]
        assert np.abs(numbers(system, system.mass_matrix, x, v) - mass).max() < 1e-10
        assert np.abs(-numbers(system, system.force, x, v).ravel() - bias).max() < 1e-10


def test_two_links_have_the_textbook_matrices(tmp_path: Path) -> None:
    """M, Coriolis and gravity of the planar arm in closed form, and the input enters as it is."""
    system = robot_system(tmp_path, TWO_LINKS)
    assert [x.name for x in system.positions] == ["q_1", "q_2"]
    assert [x.name for x in system.velocities] == ["v_q_1", "v_q_2"]
    m1, m2, l1, c1, c2, i1, i2, g = 2, 1, 0.5, 0.3, 0.2, 0.2, 0.05, 9.81
    for x, v, w in np.random.default_rng(2).uniform(-2, 2, (20, 3, 2)):
        cosine, sine = np.cos(x[1]), np.sin(x[1])
        coupling = i2 + m2 * (c2**2 + l1 * c2 * cosine)
        m11 = i1 + m1 * c1**2 + m2 * l1**2 + 2 * m2 * l1 * c2 * cosine + i2 + m2 * c2**2
        mass = [[m11, coupling], [coupling, i2 + m2 * c2**2]]
        second = m2 * c2 * g * np.cos(x[0] + x[1])
        first = (m1 * c1 + m2 * l1) * g * np.cos(x[0]) + second
        k = m2 * l1 * c2 * sine
        bias = np.array([-k * (2 * v[0] * v[1] + v[1] ** 2) + first, k * v[0] ** 2 + second])
        np.testing.assert_allclose(numbers(system, system.mass_matrix, x, v), mass, rtol=1e-13)
        np.testing.assert_allclose(numbers(system, system.force, x, v, w).ravel(), w - bias, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("text", [SEVEN_TEXT, TREE], ids=["seven", "tree"])
def test_without_gravity_the_joints_power_is_the_rate_of_the_kinetic_energy(text: str, tmp_path: Path) -> None:
    """d/dt(v'Mv/2) = v'w on M v' = w − h: holds only if h fits this M."""
    (tmp_path / "robot.urdf").write_text(text, encoding="utf-8")
    system = _weightless(tmp_path, text)
    n, step = system.degrees_of_freedom, 1e-6
    for x, v in np.random.default_rng(4).uniform(-1.5, 1.5, (10, 2, n)):
        ahead, behind = (numbers(system, system.mass_matrix, x + s * step * v, v) for s in (1, -1))
        power = -v @ numbers(system, system.force, x, v).ravel()
        assert power == pytest.approx(v @ (ahead - behind) @ v / (4 * step), abs=1e-7)


def _weightless(folder: Path, text: str) -> System:
    from codegen.mechanics import build_system
    from codegen.spec import parse_spec

    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    line = "urdf: {file: robot.urdf, gravity: [0, 0, 0]}"
    return build_system(parse_spec(f"name: robot\n{line}\n", folder / "robot.yaml"))


def test_derivatives_are_those_of_finite_differences(tmp_path: Path) -> None:
    """∂h/∂v and ∂h/∂x, after substitution too, and the second derivative."""
    system = robot_system(tmp_path, SEVEN_TEXT)
    n, step = system.degrees_of_freedom, 1e-6
    error = symbol("e")
    x, v = np.random.default_rng(5).uniform(-1, 1, (2, n))
    for k in range(n):
        nudge = np.eye(n)[k] * step
        for matrix, s in ((system.force, system.velocities[k]), (system.force, system.positions[k])):
            dx, dv = (nudge, 0 * nudge) if s in system.positions else (0 * nudge, nudge)
            slope = numbers(system, matrix.diff(s), x, v).ravel()
            ends = [numbers(system, matrix, x + sign * dx, v + sign * dv).ravel() for sign in (1, -1)]
            np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * step), atol=2e-8)
        shifted = system.force.subs(system.velocities[k], system.velocities[k] - 2 * error)
        slope = numbers(system, shifted.diff(error).subs(error, 0), x, v)
        np.testing.assert_allclose(
            slope, -2 * numbers(system, system.force.diff(system.velocities[k]), x, v), rtol=1e-12
        )
    twice = system.force.diff(system.velocities[1]).diff(system.velocities[2])
    nudge = np.eye(n)[2] * step
    first = system.force.diff(system.velocities[1])
    ends = [numbers(system, first, x, v + sign * nudge).ravel() for sign in (1, -1)]
    np.testing.assert_allclose(numbers(system, twice, x, v).ravel(), (ends[0] - ends[1]) / (2 * step), atol=2e-8)


def test_what_does_not_vary_is_a_number(tmp_path: Path) -> None:
    """M never depends on the first joint; a gantry's M is constant and exact."""
    arm = robot_system(tmp_path, SEVEN_TEXT)
    assert arm.positions[0] not in arm.mass_matrix.free_symbols
    assert set(arm.positions[1:]) == arm.mass_matrix.free_symbols
    gantry = robot_system(
        tmp_path,
        TWO_LINKS.replace('"continuous"', '"prismatic"')
        .replace('"revolute"', '"prismatic"')
        .replace("0 -1 0", "1 0 0"),
    )
    assert gantry.mass_matrix == sympy.ImmutableMatrix([[3, 0], [0, 1]])
    assert list(gantry.force) == list(gantry.inputs)


def test_equal_robots_are_equal_systems(tmp_path: Path) -> None:
    """Two readings give equal and equally ordered expressions; another mass gives others."""
    one, two = (robot_system(tmp_path, SEVEN_TEXT) for _ in range(2))
    assert one.mass_matrix == two.mass_matrix and one.force == two.force
    assert hash(one.force) == hash(two.force) and str(one.force) == str(two.force)
    other = robot_system(tmp_path, SEVEN_TEXT.replace('<mass value="0.8"/>', '<mass value="0.9"/>'))
    assert one.mass_matrix != other.mass_matrix


def test_entries_of_one_computation_share_its_graph(tmp_path: Path) -> None:
    """∂h/∂v of seven joints: 49 entries cost little more than one evaluation, not 49 of them."""
    import casadi

    from codegen.mechanics.casadi_form import to_casadi

    system = robot_system(tmp_path, SEVEN_TEXT)
    names = {s: casadi.SX.sym(s.name) for s in (*system.positions, *system.velocities, *system.inputs)}
    whole = to_casadi(system.force.jacobian(system.v), names)
    row = to_casadi(system.force[:1, :].jacobian(system.v), names)
    count = [casadi.Function("f", list(names.values()), [part]).n_instructions() for part in (whole, row)]
    assert count[0] < 4 * count[1]
