"""What ``stiction derive`` prints where a spec is silent or an expression is long."""

from __future__ import annotations

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


def test_long_entries_are_counted_and_short_ones_written(tmp_path):
    (tmp_path / "crank.yaml").write_text(CRANK)
    out = stiction("derive", str(tmp_path / "crank.yaml")).out
    assert "operations; see --json)" in out
    assert max(map(len, out.splitlines())) < 300
    assert "no range for omega (-1 to 1 assumed here)" in out


def test_a_condition_is_named_once():
    out = stiction("derive", str(SPECS / "thesis" / "two_mass_gto.yaml")).out
    assert "  -K_2_x1   > 0    holds (-K_2_x1 = " in out


def test_a_condition_of_high_degree_is_not_factored(tmp_path):
    """A polynomial of degree 35 in eight variables, which SymPy had not factored after 169 s."""
    measured = CRANK.replace("velocity: estimated", "velocity: measured").replace("K_F: 50, K_v: 200", "K_F: 50")
    (tmp_path / "crank.yaml").write_text(measured)
    out = stiction("derive", str(tmp_path / "crank.yaml")).out
    assert "operations; see --json)" in out
