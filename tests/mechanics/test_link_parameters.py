"""Base parameters of a robot file: linear in M and h, those of another file in their place, and their tolerance."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.mechanics import System, build_system
from codegen.mechanics.base_parameters import base_values, link_parameters
from codegen.spec import Spec, parse_spec
from codegen.spec.model import symbol
from mechanics.robots import SEVEN, TREE, TWO_LINKS, numbers, robot_system
from tests.expected_errors import refused

SEVEN_TEXT = SEVEN.read_text(encoding="utf-8")


def spec_of(folder: Path, text: str, more: str = "") -> Spec:
    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    return parse_spec(f"name: robot\nurdf: {{file: robot.urdf{more}}}\n", folder / "robot.yaml")


def redrawn(text: str, random: np.random.Generator, mass: float, centre: float, inertia: float) -> str:
    """The robot file with its masses and diagonal inertias drawn anew about those in the text."""

    def scaled(pattern: str, share: float, text: str) -> str:
        return re.sub(pattern, lambda m: f'{m[1]}"{float(m[2]) * (1 + share * random.normal()):.15g}"', text)

    text = scaled(r'(<mass value=)"([^"]+)"', mass, text)
    return scaled(r'(i(?:xx|yy|zz)=)"([^"]+)"', inertia, text)


def at_random(system: System, seed: int) -> list[np.ndarray]:
    random, n = np.random.default_rng(seed), system.degrees_of_freedom
    states = [random.uniform(-2, 2, (2, n)) for _ in range(5)]
    return [numbers(system, m, x, v) for x, v in states for m in (system.mass_matrix, system.force)]


@pytest.mark.parametrize("text", [SEVEN_TEXT, TREE, TWO_LINKS], ids=["seven", "tree", "two"])
def test_the_base_parameters_of_another_file_make_its_motion(text: str, tmp_path: Path) -> None:
    other = redrawn(text, np.random.default_rng(3), 0.05, 0.0, 0.05)
    values = base_values((spec := spec_of(tmp_path, other)), spec.form)
    written = ", ".join(f"{name}: {float(value)!r}" for name, value in values.items())
    expected = at_random(robot_system(tmp_path, other), 7)
    nominal = at_random(robot_system(tmp_path, text), 7)
    replaced = spec_of(tmp_path, text, f", base_parameters: {{{written}}}")
    for got, wanted in zip(at_random(build_system(replaced), 7), expected, strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-11)
    assert max(np.abs(a - b).max() for a, b in zip(nominal, expected, strict=True)) > 1e-3


@pytest.mark.parametrize("text", [SEVEN_TEXT, TREE, TWO_LINKS], ids=["seven", "tree", "two"])
def test_free_base_parameters_change_nothing_at_their_values(text: str, tmp_path: Path) -> None:
    spec = spec_of(tmp_path, text, ", tolerance: {mass: 20 %}")
    free = link_parameters(spec, spec.form)
    system = build_system(spec, free)
    assert {s.name for s in system.values} >= {p.name for p in free}
    assert all(system.mass_matrix.has(symbol(p.name)) or system.force.has(symbol(p.name)) for p in free)
    for got, wanted in zip(at_random(system, 2), at_random(robot_system(tmp_path, text), 2), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-12)


def test_a_seven_joint_arm_has_the_43_of_the_textbook(tmp_path: Path) -> None:
    """Khalil and Dombre, section 9.4: seven each, less six of a first joint that turns about the vertical."""
    spec = spec_of(tmp_path, SEVEN_TEXT, ", tolerance: {mass: 1 %}")
    names = [p.name for p in link_parameters(spec, spec.form)]
    assert len(names) == 43
    assert [n for n in names if n.startswith("shoulder_yaw")] == ["shoulder_yaw_zz"]


@pytest.mark.slow
def test_deviations_are_those_of_files_drawn_at_random(tmp_path: Path) -> None:
    text = TWO_LINKS
    spec = spec_of(tmp_path, text, ", tolerance: {mass: 20 %}")
    free = link_parameters(spec, spec.form)
    said = {p.name: p.deviation for p in free}
    random = np.random.default_rng(1)
    drawn = []
    for _ in range(400):
        other = spec_of(tmp_path, redrawn(text, random, 0.05, 0.0, 0.0))
        drawn.append([float(v) for v in base_values(other, other.form).values()])
    spread = dict(zip(base_values(spec, spec.form), 4 * np.std(drawn, axis=0), strict=True))
    for name, deviation in said.items():
        assert deviation == pytest.approx(spread[name], rel=0.1, abs=1e-9)
    names = list(base_values(spec, spec.form))
    together = 16 * np.cov(np.array(drawn).T)[np.ix_(*2 * [[names.index(p.name) for p in free]])]
    size = np.array([max(p.deviation, 1e-9) for p in free])
    covariance = np.array([[np.sum(a.changes * b.changes) for b in free] for a in free])
    np.testing.assert_allclose(covariance / np.outer(size, size), together / np.outer(size, size), atol=0.2)


def test_what_is_no_tolerance_is_told_at_its_line(tmp_path: Path) -> None:
    for more, words in {
        ", tolerance: 20 %": "`20 %`; expected a mapping with centre_of_mass, damping, inertia, mass",
        ", tolerance: {masses: 20 %}": "unknown key `masses`",
        ", tolerance: {mass: much}": "urdf.tolerance.mass",
        ", tolerance: {mass: -1 %}": "expected a share such as 1% or 0.01",
        ", base_parameters: [1]": "a list of 1; expected a mapping",
        ", base_parameters: {q_1_mx: yes}": "urdf.base_parameters.q_1_mx",
    }.items():
        with pytest.raises(BadInput) as error:
            spec_of(tmp_path, TWO_LINKS, more)
        assert words in str(error.value) and str(error.value).startswith(f"{tmp_path / 'robot.yaml'}:2")
    with refused("SPEC008 `q_1_mm`"):
        build_system(spec_of(tmp_path, TWO_LINKS, ", base_parameters: {q_1_mm: 1}"))
