"""What mujoco.sysid is told of a declared axis, what is read back, and the page of ratios."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.practice.cases import PRACTICE
from benchmarks.rivals.__main__ import page, ratios
from benchmarks.rivals.axis import FACTOR, FRICTION_FACTOR, axis_of
from benchmarks.rivals.logs import RIGHT, WRONG, Pair, pairs
from benchmarks.rivals.runs import Answer, Compared, Errors
from codegen.effects import CATALOGUE
from codegen.effects.declare import system_of
from codegen.mechanics import System, build_system
from codegen.spec import read_spec

ROOT = Path(__file__).resolve().parents[2]
PENDULUM = """\
name: pendulum_arm
coordinates: {q: {velocity: v, unit: rad}}
inputs: {tau: {unit: N*m}}
parameters:
  J: {value: 0.06, unit: kg*m^2}
  m: {value: 0.4, unit: kg}
  l: {value: 0.3, unit: m}
  g: {value: 9.81, unit: m/s^2}
mass_matrix: [[J]]
force: [tau - m*g*l*sin(q)]
friction:
  distribution: [[1]]
  contacts: [{name: Fb, law: coulomb, a: 0.18, unit: N*m}]
"""


def pendulum(folder: Path) -> System:
    file = folder / "spec.yaml"
    file.write_text(PENDULUM)
    return build_system(read_spec(file))


def test_a_pendulum_is_told_by_its_moment_and_comes_back_as_its_mass(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    axis = axis_of(system, "pendulum_arm")
    assert axis is not None
    told = axis.task(system)
    moment = 0.4 * 9.81 * 0.3
    assert (told["joint"], told["gravity"], told["gain"]) == ("hinge", "hanging", 1.0)
    assert told["quantities"]["moment"]["value"] == pytest.approx(moment)
    assert told["quantities"]["inertia"]["bounds"] == pytest.approx([0.06 / FACTOR, 0.06 * FACTOR])
    assert told["quantities"]["level"]["bounds"] == pytest.approx([0.0, FRICTION_FACTOR * 0.18])
    assert told["quantities"]["damping"] == {"value": 0.0, "bounds": None}
    found = {"inertia": 0.05, "moment": 1.1 * moment, "level": FRICTION_FACTOR * 0.18}
    assert axis.refitted(found) == pytest.approx({"J": 0.05, "m": 0.44, "Fb_a": FRICTION_FACTOR * 0.18})
    assert axis.at_bound(system, found) == ("Fb_a",)


def test_the_offset_of_emps_acts_against_the_motor() -> None:
    system = build_system(read_spec(ROOT / "specs" / "emps.yaml"))
    axis = axis_of(system, "emps")
    assert axis is not None
    told = axis.task(system)["quantities"]["offset"]
    assert told["value"] == pytest.approx(3.1648) and told["bounds"] == pytest.approx([-20.3935, 20.3935])
    assert axis.refitted({"inertia": 95.0, "damping": 200.0, "offset": 2.0, "level": 20.0})["offset"] == -2.0


def test_the_axis_has_every_term_of_the_declared_model(tmp_path: Path) -> None:
    """Damping too, where the spec has it: the peer was once told of a pendulum without its viscous friction."""
    damped = PENDULUM.replace("sin(q)]", "sin(q) - b*v]").replace(
        "mass_matrix", "  b: {value: 0.07, unit: N*m*s/rad}\nmass_matrix"
    )
    (tmp_path / "damped.yaml").write_text(damped)
    files = [tmp_path / "damped.yaml"]
    if PRACTICE.is_dir():
        files += [pair.spec_file for pair in pairs(len(CATALOGUE))]
    for file in files:
        spec = read_spec(file)
        system = system_of(spec)
        axis = axis_of(system, spec.name)
        assert axis is not None
        task = axis.task(system)
        told = {name: float(one["value"]) for name, one in task["quantities"].items()}
        (x,), (v,), (w,) = system.positions, system.velocities, system.inputs
        for q, speed, u in np.random.default_rng(1).uniform(-2, 2, (5, 3)):
            at = {x: q, v: speed, w: u, **system.values}
            turn = {"none": 0.0, "hanging": np.sin(q), "level": np.cos(q)}[task["gravity"]]
            theirs = task["gain"] * u + told["offset"] - told["damping"] * speed - told["moment"] * turn
            contact = system.contacts[0]
            friction = contact.force.subs({contact.slip: speed}).subs(system.values)
            ours = float(system.force[0].subs(at)) - float(friction)
            assert ours == pytest.approx(theirs - told["level"] * np.sign(speed)), file
        assert float(system.mass_matrix[0, 0].subs(system.values)) == pytest.approx(told["inertia"])


def test_other_specs_have_no_axis() -> None:
    system = build_system(read_spec(ROOT / "specs" / "two_mass.yaml"))
    assert axis_of(system, "two_mass") is None


def row(group: str, title: str, mujoco: float, ours: float) -> tuple[Pair, Compared]:
    pair = Pair(group, title, "spring" if group == WRONG else "", Path("spec.yaml"), [], [], None)
    answer = Answer({"m": 1.0}, ("m",) if group == WRONG else (), 1.0, 0.5, 4.0, "4.0.0")
    one = Errors(mujoco, 10 * mujoco)
    own = Errors(ours, 10 * ours)
    named = ("spring",) if group == WRONG else ()
    verdict = "effect" if named else "none"
    return pair, Compared(
        declared=Errors(2 * mujoco, 1.0),
        mujoco=one,
        refit=one,
        pysindy=Errors(own.force, None),
        augmented=own,
        verdict=verdict,
        named=named,
        answer=answer,
        terms=("x",),
        code="abc",
    )


def test_ratios_are_to_the_augmented_model_and_a_model_without_motion_has_none() -> None:
    rows = [row(WRONG, f"standard/case_{k}", mujoco, 0.02) for k, mujoco in enumerate((0.04, 0.1, 0.2))]
    force, position = ratios(rows, lambda e: e.force), ratios(rows, lambda e: e.position)
    assert force["mujoco"] == pytest.approx((5.0, 10.0)) and force["pysindy"] == pytest.approx((1.0, 1.0))
    assert position["mujoco"] == pytest.approx((5.0, 10.0)) and position["pysindy"] is None


def test_the_page_tells_the_wrong_structure_from_the_right_one() -> None:
    right = row(RIGHT, "standard/case_9", 0.02, 0.02)
    text = page([row(WRONG, "standard/case_1", 0.1, 0.02), right])
    assert "## Structure wrong" in text and "## Structure right" in text and "## Real log" not in text
    assert "| standard/case_1 | spring | effect: spring | 20 | 10 | 10 | 2 | 2 |" in text
    assert "| standard/case_1 | 1 | 1 | 1 | 0.2 | m |" in text
    assert "| standard/case_9 | – | none | 4 | 2 | 2 | 2 | 2 |" in text
    assert "| structure right | 2.00 (2) | 1.00 (1) | 1.00 (1) | 1.00 (1) |" in text
    diverged = replace(right[1], mujoco=Errors(0.02, float("inf")))
    assert "inf" in page([(right[0], diverged)])
