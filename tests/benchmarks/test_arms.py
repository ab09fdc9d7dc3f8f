"""The simulated arms: their dynamics against a Lagrangian and against the project's, their friction, and the marks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy
from mechanics.robots import numbers

from benchmarks.arms.cases import CASES, PAYLOAD, ArmCase, made
from benchmarks.arms.drive import Drives
from benchmarks.arms.page import Row, is_right, page, row_of
from benchmarks.arms.plant import STEP, Plant, extra
from benchmarks.arms.robots import ROBOTS, built, urdf
from benchmarks.practice.runs import Run
from benchmarks.text import render
from codegen.effects import CATALOGUE
from codegen.effects.effect import Symbols
from codegen.logs import read_log
from codegen.mechanics.system import TIME
from codegen.spec import parse_spec, read_spec
from tests.diagnosis.stage import stage, system_of

GRAVITY = 9.81
NONE, COGGING = CASES[0], CASES[1]
ALSO = {"kind": "cogging", "on": "q2"}
PUSH = next(case for case in CASES if case.group == "foreign")


def test_the_planar_arm_moves_by_its_lagrangian() -> None:
    """M and h from T and V, written down for two links in the vertical plane; rotors turn with their own joint."""
    joints = built(ROBOTS["planar_2r"], 3)
    q, v = (sympy.Matrix(sympy.symbols(f"{letter}1:3")) for letter in "qv")
    turn = [sympy.Matrix([[sympy.cos(a), -sympy.sin(a)], [sympy.sin(a), sympy.cos(a)]]) for a in (q[0], q[0] + q[1])]
    kinetic, potential, origin = sympy.Integer(0), sympy.Integer(0), sympy.zeros(2, 1)
    for k, joint in enumerate(joints):
        origin += turn[k - 1] * sympy.Matrix([joint.origin[0], joint.origin[2]]) if k else sympy.zeros(2, 1)
        centre = origin + turn[k] * sympy.Matrix([joint.centre[0], joint.centre[2]])
        speed, rate = centre.jacobian(q) * v, sum(v[: k + 1])
        kinetic += joint.mass * speed.dot(speed) / 2 + joint.inertia[1] * rate**2 / 2 + joint.rotor * v[k] ** 2 / 2
        potential += joint.mass * GRAVITY * centre[1]
    momentum = sympy.Matrix([kinetic]).jacobian(v).T
    bias = momentum.jacobian(q) * v - sympy.Matrix([kinetic - potential]).jacobian(q).T
    exact = sympy.lambdify([*q, *v], [momentum.jacobian(v), bias])
    plant = Plant(joints)
    for state in np.random.default_rng(1).uniform(-2, 2, (10, 4)):
        plant.start(state[:2])
        plant.data.qvel[:] = state[2:]
        mass, force = plant.dynamics()
        expected = exact(*state)
        np.testing.assert_allclose(mass, expected[0], rtol=1e-9)
        np.testing.assert_allclose(force, expected[1].ravel(), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_data_sheet_is_the_spec(name: str, tmp_path: Path) -> None:
    """M(q) by MuJoCo and by the project agree, so a spec differs from its machine by what was built otherwise alone."""
    joints = ROBOTS[name]
    (tmp_path / "arm.urdf").write_text(urdf(name, joints))
    system = system_of(parse_spec(render("arm.yaml.j2", name=name, joints=joints), tmp_path / "arm.yaml"))
    plant = Plant(joints)
    for q in np.random.default_rng(2).uniform(-1, 1, (3, len(joints))):
        plant.start(q)
        np.testing.assert_allclose(
            plant.dynamics()[0], numbers(system, system.mass_matrix, q, 0 * q), rtol=1e-9, atol=1e-12
        )


def test_an_arm_without_friction_keeps_its_energy() -> None:
    joints = tuple(replace(joint, friction=0.0, damping=0.0) for joint in ROBOTS["seven_joints"])
    plant, n = Plant(joints), 7
    plant.start(np.linspace(-1, 1, n))

    def energy() -> tuple[float, float]:
        mass, speed = plant.dynamics()[0], plant.data.qvel
        heights = plant.data.xipos[1:, 2]
        return float(speed @ mass @ speed / 2), float(plant.model.body_mass[1:] @ heights * GRAVITY)

    start = sum(energy())
    for _ in range(round(0.3 / STEP)):
        plant.step(np.zeros(n))
    moving, high = energy()
    assert moving > 10
    assert moving + high == pytest.approx(start, abs=0.005 * moving)


def test_joints_stick_until_their_level_is_exceeded() -> None:
    joints = ROBOTS["scara_4"]
    plant = Plant(joints)
    plant.start(np.zeros(4))
    below = np.array([0.9, -0.9, 0.9, -0.9]) * [joint.friction for joint in joints]
    gravity = plant.dynamics()[1].copy()
    for _ in range(200):
        plant.step(gravity + below)
    assert abs(plant.data.qvel).max() < 1e-9
    for _ in range(200):
        plant.step(gravity + below * [1, 1, 1.3, 1])
    assert plant.data.qvel[2] == pytest.approx(0.17 * 8 / (1.5 + 0.6 + 2.0) * 200 * STEP, rel=0.2)


@pytest.mark.parametrize("case", [case for case in CASES[2:] if case.in_catalogue], ids=lambda case: case.kind)
def test_an_effect_is_that_of_the_catalogue(case: ArmCase) -> None:
    """Force less level, at a positive velocity, against what the class of the effect adds to a mass on a rail."""
    added, plain = extra(case.kind, case.parameters), system_of(stage())
    parameters: Symbols = {name: sympy.Float(value) for name, value in case.parameters.items()}
    system = CATALOGUE[case.kind].add(plain, 0, parameters)
    at = -0.37, 0.08, 3.1, 2.5
    moving = system.positions[0], system.velocities[0], system.inputs[0], TIME
    values = {**system.values, **dict(zip(moving, at, strict=True))}
    force, before = (one.commanded(one.modelled_force[0]).subs(values) for one in (system, plain))
    assert float(sympy.N(force - before)) == pytest.approx(added.force(*at) - added.level(*at))
    assert added.force(*at) or added.level(*at)


def test_a_case_is_a_folder_that_can_be_diagnosed(tmp_path: Path) -> None:
    case = replace(COGGING, drives=Drives("cascade", 1000, 500, 0.2))
    folder = made(case, tmp_path)
    spec = read_spec(folder / "spec.yaml")
    log = read_log(folder / "train.csv", spec)
    assert log.positions.shape == (100, 2)
    before = (folder / "test.csv").read_bytes()
    assert before != (folder / "train.csv").read_bytes()
    (folder / "truth.json").unlink()
    assert (made(case, tmp_path) / "test.csv").read_bytes() == before


def result(verdict: str, *effects: tuple[str, str]) -> dict[str, object]:
    found = [{"kind": kind, "on": on, "parameters": {"amplitude": 0.3}} for kind, on in effects]
    return {"verdict": verdict, "effects": found, "candidates": []}


def test_marks() -> None:
    assert is_right(NONE, result("none")) and not is_right(NONE, result("unknown"))
    assert is_right(COGGING, result("effect", ("cogging", "q2")))
    assert is_right(COGGING, result("effect", ("cogging_harmonics", "q2")))
    assert not is_right(COGGING, result("effect", ("cogging", "q1")))
    assert not is_right(COGGING, result("effect", ("cogging", "q2"), ("offset", "q1")))
    twin = result("effect") | {"effects": [{"kind": "spring", "on": "q2", "parameters": {}, "also": [ALSO]}]}
    assert is_right(COGGING, twin)
    assert row_of(COGGING, Run("c", 9.0, 1.0, 5, "", "code"), twin).said == "effect: spring on q2 or cogging on q2"
    assert is_right(PUSH, result("unknown")) and not is_right(PUSH, result("effect", ("offset", PUSH.on)))


def test_a_payload_is_wrong_values_of_its_joint() -> None:
    payload = next(case for case in CASES if case.kind == PAYLOAD)

    def wrong(*names: str) -> dict[str, object]:
        return result("none") | {"parameter_errors": [{"name": name} for name in names]}

    assert is_right(payload, wrong(f"{payload.on}_mx"))
    assert not is_right(payload, result("none")) and not is_right(payload, wrong("waist_zz"))
    assert not is_right(NONE, wrong("q1_mx"))
    row = row_of(payload, Run("c", 9.0, 181.0, 5000, "", "code"), wrong("elbow_mx", "elbow_zz"))
    assert row.said == "none: elbow_mx, elbow_zz" and row.right


def test_the_page_says_what_was_found_and_missed() -> None:
    seven = next(case for case in CASES if case.joints == 7)
    run = Run("c", 9.0, 181.0, 5000, "", "code", 0.4, 3.0)
    rows: list[Row] = [
        row_of(COGGING, run, result("effect", ("cogging", "q2"))),
        row_of(seven, replace(run, first_line_s=None), result("unknown")),
    ]
    text = page(rows)
    assert "1 of 2 are right, 11 were not run" in text
    assert "| effect: cogging on q2 | yes | `amplitude` 0.3 (0.25), `period` – (0.35)" in text
    assert "181 s of the processor at most, bar 180 s: **missed**" in text
