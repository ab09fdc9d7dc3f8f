"""A position that is logged in a multiple of what the spec means: told, and told from an input of another scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, MASS, TEXT, write_csv

from codegen.logs import Finding, preflight, read_log
from codegen.spec.reader import parse_spec

DAMPING = 8.0
DAMPED = TEXT.replace("force: [w]", "force: [w - b*v]").replace(
    "parameters:\n", f"parameters:\n  b: {{value: {DAMPING}, unit: N*s/m}}\n"
)
SMOOTH = DAMPED[: DAMPED.index("friction:")] + "friction: {distribution: [[]], contacts: []}\n"


def told(
    folder: Path,
    k: float = 1.0,
    c: float = 1.0,
    mass: float = MASS,
    level: float = LEVEL,
    text: str = DAMPED,
    about: str = "scale: {w: 1}",
    cogging: float = 0.0,
) -> dict[str, Finding]:
    """What is found in a log whose position is k times too large and whose input is c times too small."""
    t = np.arange(10000) / 500
    waves = [(0.1, 3.1, 0.0), (0.02, 12.0, 0.4)]
    x, a = (sum(b * (-(o**2)) ** n * np.sin(o * t + p) for b, o, p in waves) for n in (0, 1))
    v = sum(b * o * np.cos(o * t + p) for b, o, p in waves)
    force = mass * a + (DAMPING * v if "b*v" in text else 0.0) + level * np.sign(v)
    force = force + cogging * np.sin(2 * np.pi * x / 0.02)
    spec, described = parse_spec(text, Path("slider.yaml")), folder / "about.yaml"
    described.write_text(f"{about}\n")
    path = write_csv(folder / "a.csv", {"t": t, "x": k * x, "w": force / c}, fmt="%.12g")
    return {f.topic: f for f in preflight(read_log(path, spec, description=described), spec)}


@pytest.mark.parametrize("k", [5.0, 0.2, 1.0])
def test_a_position_off_by_a_factor_is_told_with_the_line_that_mends_it(tmp_path: Path, k: float) -> None:
    """A gantry's motor turns, five times, were diagnosed as an input gain of 5 and a delay."""
    found = told(tmp_path, k)
    assert ("scale of x" in found) is (k != 1.0)
    if k == 1.0:
        return
    one = found["scale of x"]
    assert one.severity == "problem" and one.figures["factor"] == pytest.approx(k, rel=0.03)
    assert "in meta.yaml" in one.words and f"{k:.2g} times the declared friction" in one.words.replace("5.1", "5")
    line = one.words.partition("`")[2].partition("`")[0]
    assert line.startswith("scale: {x: ")
    assert "scale of x" not in told(tmp_path, k, about=line)
    assert "problem" not in {f.severity for f in told(tmp_path, k, about=line).values()}


def test_a_gear_of_the_spec_is_named(tmp_path: Path) -> None:
    words = told(tmp_path, 5.0, text=DAMPED.replace("parameters:\n", "parameters:\n  n: {value: 5}\n"))[
        "scale of x"
    ].words
    assert "the parameter n has this value" in words and "`scale: {x: 0.2}`" in words


def test_what_friction_does_not_tell_apart_is_said(tmp_path: Path) -> None:
    """A level is known to a factor of three; without one, nothing tells a position from an input."""
    for found in (told(tmp_path, 2.0), told(tmp_path, 5.0, level=0.0, text=SMOOTH)):
        one = found["scale of x"]
        k = one.figures["factor"]
        assert one.severity == "warning" and "cannot tell that from" in one.words
        assert f"w is {k:.3g} times too small" in one.words and "scale: {w: " in one.words


def test_a_factor_is_told_beside_a_force_that_no_model_holds(tmp_path: Path) -> None:
    """Of a gantry cogging left more than a tenth of the misfit, and a factor of two was not told."""
    one = told(tmp_path, 2.0, cogging=2.0)["scale of x"]
    assert one.severity == "warning" and 0.1 < one.figures["misfit_scaled"] / one.figures["misfit"] < 0.25
    assert one.figures["factor"] == pytest.approx(2.0, rel=0.1)


def test_a_heavier_mass_alone_is_a_rival_where_nothing_is_damped(tmp_path: Path) -> None:
    one = told(tmp_path, 2.0, text=TEXT)["scale of x"]
    assert one.severity == "warning" and "the declared inertia is 2" in one.words


def test_other_errors_are_no_scale_of_the_position(tmp_path: Path) -> None:
    """An input five times too small leaves the levels as they are; so does a mass of 0.4 kg leave the damping."""
    found = told(tmp_path, c=5.0)
    assert "scale of x" not in found
    assert (
        found["sign and scale of w"].severity == "problem"
        and "`scale: {w: 4.998}`" in found["sign and scale of w"].words
    )
    assert "scale of x" not in told(tmp_path, mass=0.4)
    assert "scale of x" not in told(tmp_path, level=0.3 * LEVEL)


WINCH = """name: winch
coordinates: {th: {velocity: om, unit: rad}}
inputs: {u: {unit: N*m}}
parameters:
  J: {value: 0.035, unit: kg*m^2}
  m: {value: 20, unit: kg}
  r0: {value: 0.05, unit: m}
  d: {value: 0.00095, unit: m/rad}
  g: {value: 9.81, unit: m/s^2}
mass_matrix: [[J + m*(r0 - d*th)**2]]
force: [u + m*g*(r0 - d*th) + m*d*(r0 - d*th)*om**2]
friction: {distribution: [[1]], contacts: [{name: drum, a: 1.5, unit: N*m}]}
envelope: {th: [0, 12], om: [-8, 8]}
"""


def test_degrees_are_named_where_the_mass_depends_on_the_angle(tmp_path: Path) -> None:
    """Degrees that are read as rad make the drum's radius, so its inertia, wrong, too: a factor of 1450 was named."""
    t = np.arange(8000) / 1000
    waves = [(3.4, 0.82, 0.0), (1.3, 2.95, 0.4)]
    th, a = (sum(b * (-(o**2)) ** n * np.sin(o * t + p) for b, o, p in waves) + 6 * (1 - n) for n in (0, 1))
    om = sum(b * o * np.cos(o * t + p) for b, o, p in waves)
    r = 0.05 - 0.00095 * th
    u = (0.035 + 20 * r**2) * a - 20 * 9.81 * r - 20 * 0.00095 * r * om**2 + 1.5 * np.sign(om)
    spec, about = parse_spec(WINCH, Path("winch.yaml")), tmp_path / "about.yaml"
    path = write_csv(tmp_path / "a.csv", {"t": t, "th": np.degrees(th), "u": u}, fmt="%.12g")
    about.write_text("units: {th: rad}\n")
    found = {f.topic: f for f in preflight(read_log(path, spec, description=about), spec)}
    assert "is th in deg?" in found["scale of th"].words and "`units: {th: deg}`" in found["scale of th"].words
    assert found["scale of th"].severity == "problem"
    about.write_text("units: {th: deg}\n")
    again = preflight(read_log(path, spec, description=about), spec)
    assert not [f for f in again if f.severity == "problem" or f.topic == "scale of th"]


ARM = """name: arm
coordinates: {q1: {velocity: v1, unit: rad}, q2: {velocity: v2, unit: rad}}
inputs: {T1: {unit: N*m}, T2: {unit: N*m}}
parameters:
  J1: {value: 0.4, unit: kg*m^2}
  J2: {value: 0.1, unit: kg*m^2}
  G: {value: 2.0, unit: N*m}
mass_matrix: [[J1 + J2*cos(q2)**2, 0], [0, J2]]
force: [T1 + J2*sin(2*q2)*v1*v2, T2 - J2*sin(2*q2)*v1**2/2 - G*cos(q2)]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: pan, law: coulomb, a: 0.3, unit: N*m}
    - {name: tilt, law: coulomb, a: 0.2, unit: N*m}
"""

WAVES = [[(0.5, 3.1, 0.0), (0.1, 9.0, 0.4)], [(0.4, 2.3, 1.0), (0.15, 7.0, 0.2)]]
"""Amplitude, rad/s and phase of the sines of each joint."""


@pytest.mark.parametrize("in_degrees", [(True, True), (True, False), (False, True)])
def test_angles_in_degrees_are_named_all_together(in_degrees: tuple[bool, bool], tmp_path: Path) -> None:
    """A user's pan-tilt with both angles in degrees was told to have 36.6 times the force, and no unit."""
    t = np.arange(10000) / 500
    q, v, a = (
        np.array([sum(b * part(o, o * t + p) for b, o, p in waves) for waves in WAVES])
        for part in (lambda o, w: np.sin(w), lambda o, w: o * np.cos(w), lambda o, w: -(o**2) * np.sin(w))
    )
    T1 = (0.4 + 0.1 * np.cos(q[1]) ** 2) * a[0] - 0.1 * np.sin(2 * q[1]) * v[0] * v[1] + 0.3 * np.sign(v[0])
    T2 = 0.1 * a[1] + 0.05 * np.sin(2 * q[1]) * v[0] ** 2 + 2.0 * np.cos(q[1]) + 0.2 * np.sign(v[1])
    logged = [np.degrees(x) if deg else x for x, deg in zip(q, in_degrees, strict=True)]
    path = write_csv(tmp_path / "a.csv", {"t": t, "q1": logged[0], "q2": logged[1], "T1": T1, "T2": T2}, fmt="%.12g")
    spec = parse_spec(ARM, Path("arm.yaml"))
    names = [name for name, deg in zip(("q1", "q2"), in_degrees, strict=True) if deg]
    units = "units: {" + ", ".join(f"{name}: deg" for name in names) + "}"
    one = {f.topic: f for f in preflight(read_log(path, spec), spec)}[f"scale of {' and '.join(names)}"]
    assert one.severity == "problem" and f"`{units}`" in one.words
    described = tmp_path / "about.yaml"
    described.write_text(f"{units}\n")
    again = preflight(read_log(path, spec, description=described), spec)
    assert not [f for f in again if f.severity == "problem"]


def test_a_coordinate_far_outside_its_envelope_is_told_once_whatever_the_number_of_inputs(tmp_path: Path) -> None:
    """`The scale of x1 seems off` stood there for the first input, and again for the second."""
    text = (Path(__file__).parents[2] / "specs" / "two_mass.yaml").read_text("utf-8")
    for old, new in {
        "  w: {unit: N}": "  w: {unit: N}\n  u: {unit: N}",
        "eta3*x2\n": "eta3*x2 + u\n",
        "envelope:": "envelope:\n  x1: [-1e-6, 1e-6]",
    }.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    t, random = np.arange(8000) * 1e-3, np.random.default_rng(730072)
    forces = 20 * np.array([np.convolve(random.normal(size=8000), np.ones(50) / 7, "same") for _ in range(2)])
    columns = {"t": t, "x1": np.sin(3 * t), "x2": 0.5 * np.sin(4 * t), "w": forces[0], "u": forces[1]}
    spec = parse_spec(text, tmp_path / "two.yaml")
    log = read_log(write_csv(tmp_path / "a.csv", columns), spec)
    found = [f for f in preflight(log, spec) if f.topic == "scale of x1"]
    assert len(found) == 1 and "x1 reaches" in found[0].words
