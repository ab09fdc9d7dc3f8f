"""What ``stiction derive`` prints where a spec is silent or an expression is long."""

from __future__ import annotations

import json

import pytest

from tests.slow_cases import slow_except

from .command import SPECS, stiction

CRANK = """\
name: crank
coordinates:
  phi: {velocity: omega, unit: rad}
inputs:
  tau: {unit: N*m}
parameters:
  J: {value: 0.002, unit: kg*m^2}
  m: {value: 0.8, unit: kg}
  r: {value: 30, unit: mm}
  L: {value: 120, unit: mm}
constraints:
  bodies:
    wheel: {inertia: J, angle: phi}
    slider: {mass: m, x: r*cos(phi) + sqrt(L**2 - r**2*sin(phi)**2)}
force: [tau]
friction:
  contacts:
    - {name: guide, bodies: [slider, ground], law: coulomb, a: 4, unit: N}
observer:
  kind: cfo
  velocity: estimated
  gains: {K_F: 50, K_v: 200}
  sample_time: 0.001
envelope:
  phi: [0.5, 2.6]
"""


def test_a_range_that_is_assumed_is_said(tmp_path):
    text = (SPECS / "two_link_arm.yaml").read_text()
    (tmp_path / "arm.yaml").write_text(text.replace("  theta2: [-3.1416, 3.1416]\n", ""))
    assert "no range for theta2 (-3.142 to 3.142 assumed here)" in stiction("derive", str(tmp_path / "arm.yaml")).out
    assert "no range" not in stiction("derive", str(SPECS / "two_link_arm.yaml")).out


def test_the_range_of_a_speed_that_is_assumed_is_said(tmp_path):
    text = (SPECS / "one_mass.yaml").read_text().replace("  v: [-5, 5]\n", "").replace("  - w\n", "  - w - d*v**2\n")
    text = text.replace("parameters:\n", "parameters:\n  d: {value: 2, unit: kg/m}\n")
    (tmp_path / "drag.yaml").write_text(text)
    assert "no range for v (-1 to 1 assumed here)" in stiction("derive", str(tmp_path / "drag.yaml")).out


def test_a_long_coefficient_is_printed_in_full_and_once() -> None:
    """It was "an expression of 153 operations", and so was the condition on it."""
    arm = str(SPECS / "two_link_arm.yaml")
    polynomial = json.loads(stiction("derive", arm, "--json").out)["characteristic_polynomial"]
    lines = stiction("derive", arm).out.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("  c2 = "))
    end = next(k for k, line in enumerate(lines) if line.startswith("  c1 = "))
    written = " ".join(line.strip() for line in lines[at:end])
    assert written == f"c2 = {polynomial[2]}" and max(map(len, lines[at:end])) < 120
    assert [line.split()[:3] for line in lines[end:] if line.startswith("  c2 ")] == [["c2", ">", "0"]]


@pytest.mark.parametrize("velocity", slow_except(["estimated", "measured"], ["measured"]))
def test_long_entries_are_counted_and_short_ones_written(tmp_path, velocity):
    """With a measured velocity one condition is a polynomial of degree 35, which SymPy had not factored after 169 s."""
    text = CRANK
    if velocity == "measured":
        text = text.replace("velocity: estimated", "velocity: measured").replace("K_F: 50, K_v: 200", "K_F: 50")
    (tmp_path / "crank.yaml").write_text(text)
    out = stiction("derive", str(tmp_path / "crank.yaml")).out
    assert "operations: printed by --json)" in out
    assert max(map(len, out.splitlines())) < 300


def test_a_condition_is_named_once():
    out = stiction("derive", str(SPECS / "thesis" / "two_mass_gto.yaml")).out
    assert "  -K_2_x1   > 0    holds (-K_2_x1 = " in out


def test_a_matrix_too_wide_for_a_page_is_printed_as_equations() -> None:
    """A row of the matrix of sixteen masses had 767 characters, of which most are zeros and blanks."""
    chain = str(SPECS / "chain.yaml")
    printed, content = stiction("derive", chain).out, json.loads(stiction("derive", chain, "--json").out)
    assert max(map(len, printed.partition("Psi e between")[2].partition("with slip signs")[0].splitlines())) <= 112
    errors = [error["name"] for error in content["error"]]
    lines = printed.replace("\n        ", " ").splitlines()
    for error, row in zip(errors, content["psi"], strict=True):
        terms = [f"({entry})*{other}" for entry, other in zip(row, errors, strict=True) if entry != "0"]
        assert f"  {error}' = {' + '.join(terms)}" in lines
