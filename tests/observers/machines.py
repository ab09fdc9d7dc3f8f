"""Machines twice: as a spec's text, and as NumPy functions written by hand from the same mechanics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.spec import Spec, parse_spec

ONE_MASS = """
name: one_mass
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters:
  m: {value: 1.7, unit: kg}
  b: {value: 0.4, unit: N*s/m}
  k: {value: 30, unit: N/m}
mass_matrix: [[m]]
force: ["w - b*v - k*x"]
friction:
  distribution: [[1]]
  contacts: [{name: rail, law: coulomb, a: 5, unit: N}]
"""

TWO_MASS = """
name: two_mass
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w: {unit: N}}
parameters:
  m1: {value: 10, unit: kg}
  m2: {value: 50, unit: kg}
  eta1: {value: 100, unit: N/m}
  eta2: {value: 50, unit: N/m}
  eta3: {value: 20, unit: N/m}
  c: {value: 3, unit: N*s/m}
mass_matrix: [[m1, 0], [0, m2]]
force: ["-(eta2 + eta3)*x1 + eta3*x2 - c*(v1 - v2)", "eta3*x1 - (eta1 + eta3)*x2 + c*(v1 - v2) + w"]
friction:
  distribution: [[1, 0], [-1, 1]]
  contacts:
    - {name: between, law: coulomb, a: 10, unit: N}
    - {name: ground, law: coulomb, a: 20, unit: N}
"""

ARM = """
name: arm
coordinates: {th1: {velocity: om1, unit: rad}, th2: {velocity: om2, unit: rad}}
inputs: {u1: {unit: N*m}, u2: {unit: N*m}}
parameters:
  m1: {value: 0.77, unit: kg}
  m2: {value: 0.27, unit: kg}
  l1: {value: 0.2, unit: m}
  b1: {value: 0.04, unit: m}
  b2: {value: 0.065, unit: m}
  I1: {value: 0.0086, unit: kg*m^2}
  I2: {value: 0.0013, unit: kg*m^2}
  g: {value: 9.8, unit: m/s^2}
mass_matrix:
  - [I1 + I2 + m1*b1**2 + m2*(l1**2 + b2**2) + 2*m2*l1*b2*cos(th2), I2 + m2*b2**2 + m2*l1*b2*cos(th2)]
  - [I2 + m2*b2**2 + m2*l1*b2*cos(th2), I2 + m2*b2**2]
force:
  - u1 + m2*l1*b2*(2*om1 + om2)*om2*sin(th2) - g*((m1*b1 + m2*l1)*cos(th1) + m2*b2*cos(th1 + th2))
  - u2 - m2*l1*b2*om1**2*sin(th2) - g*m2*b2*cos(th1 + th2)
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: shoulder, law: coulomb, a: 0.07, unit: N*m}
    - {name: elbow, law: coulomb, a: 0.025, unit: N*m}
"""

# A cart with a pendulum; friction in the pivot, on the rail, and along a rod whose slip depends on the angle.
CART = """
name: cart
coordinates: {q: {velocity: om, unit: rad}, x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters:
  mc: {value: 2, unit: kg}
  mp: {value: 0.5, unit: kg}
  l: {value: 0.4, unit: m}
  g: {value: 9.8, unit: m/s^2}
mass_matrix: [["mp*l**2", "mp*l*cos(q)"], ["mp*l*cos(q)", "mc + mp"]]
force: ["-mp*g*l*sin(q)", "w + mp*l*om**2*sin(q)"]
friction:
  distribution: [[1, 0, "l*cos(q)"], [0, 1, 1]]
  contacts:
    - {name: pivot, law: coulomb, a: 0.3, unit: N*m}
    - {name: rail, law: coulomb, a: 2, unit: N}
    - {name: rod, law: coulomb, a: 1, unit: N}
"""

EFFECTS = {
    "one_mass": """
effects:
  - {kind: viscous, on: rail, parameters: {b: 2.5}}
  - {kind: stribeck, on: rail, parameters: {delta: 4, v_s: 0.3}}
  - {kind: viscous_asymmetry, on: rail, parameters: {d_b: 0.7}}
  - {kind: quadratic_drag, on: x, parameters: {c: 1.3}}
""",
    "two_mass": """
effects:
  - {kind: viscous, on: between, parameters: {b: 6}}
  - {kind: stribeck, on: ground, parameters: {delta: 8, v_s: 0.5}}
  - {kind: viscous_asymmetry, on: between, parameters: {d_b: 2}}
  - {kind: quadratic_drag, on: x2, parameters: {c: 4}}
""",
    "arm": """
effects:
  - {kind: viscous, on: shoulder, parameters: {b: 0.02}}
  - {kind: stribeck, on: elbow, parameters: {delta: 0.03, v_s: 0.6}}
  - {kind: viscous_asymmetry, on: elbow, parameters: {d_b: 0.004}}
  - {kind: quadratic_drag, on: th1, parameters: {c: 0.01}}
""",
    "cart": """
effects:
  - {kind: viscous, on: rod, parameters: {b: 0.9}}
  - {kind: stribeck, on: rail, parameters: {delta: 1.1, v_s: 0.4}}
  - {kind: viscous_asymmetry, on: rod, parameters: {d_b: 0.2}}
  - {kind: quadratic_drag, on: x, parameters: {c: 0.5}}
""",
}


def magnitude(z: Any) -> Any:
    """|z| continued to complex numbers as s·z with s the sign of the real part, so that complex steps pass through."""
    return z * np.sign(np.real(z))


@dataclass(frozen=True)
class Hand:
    """A machine in NumPy. ``known`` are the contact forces of its declared effects, ``drag`` their coordinate forces.

    Every function takes complex numbers.
    """

    mass: Callable[[Any], Any]
    force: Callable[[Any, Any, Any], Any]
    distribution: Callable[[Any], Any]
    known: Callable[[Any], Any]
    drag: Callable[[Any], Any]
    inputs: int

    def total_force(self, x: Any, v: Any, w: Any, effects: bool) -> Any:
        return self.force(x, v, w) + (self.drag(v) if effects else 0)

    def known_friction(self, u: Any, effects: bool) -> Any:
        return self.known(u) if effects else 0 * u


def _stribeck(u: Any, delta: float, v_s: float) -> Any:
    return np.sign(np.real(u)) * delta * np.exp(-((u / v_s) ** 2))


def _arm_mass(x: Any) -> Any:
    m1, m2, l1, b1, b2, i1, i2 = 0.77, 0.27, 0.2, 0.04, 0.065, 0.0086, 0.0013
    c = m2 * l1 * b2 * np.cos(x[1])
    off = i2 + m2 * b2**2 + c
    return np.array([[i1 + i2 + m1 * b1**2 + m2 * (l1**2 + b2**2) + 2 * c, off], [off, i2 + m2 * b2**2]])


def _arm_force(x: Any, v: Any, w: Any) -> Any:
    m1, m2, l1, b1, b2, g = 0.77, 0.27, 0.2, 0.04, 0.065, 9.8
    h = m2 * l1 * b2 * np.sin(x[1])
    far = m2 * b2 * g * np.cos(x[0] + x[1])
    near = g * (m1 * b1 + m2 * l1) * np.cos(x[0])
    return np.array([w[0] + h * (2 * v[0] + v[1]) * v[1] - near - far, w[1] - h * v[0] ** 2 - far])


def _two_mass_force(x: Any, v: Any, w: Any) -> Any:
    slide = 3 * (v[0] - v[1])
    return np.array([-70 * x[0] + 20 * x[1] - slide, 20 * x[0] - 120 * x[1] + slide + w[0]])


HANDS = {
    "one_mass": Hand(
        mass=lambda x: np.array([[1.7]]),
        force=lambda x, v, w: w - 0.4 * v - 30 * x,
        distribution=lambda x: np.array([[1.0]]),
        known=lambda u: 2.5 * u + _stribeck(u, 4, 0.3) + 0.7 * magnitude(u),
        drag=lambda v: -1.3 * v * magnitude(v),
        inputs=1,
    ),
    "two_mass": Hand(
        mass=lambda x: np.diag([10.0, 50.0]),
        force=_two_mass_force,
        distribution=lambda x: np.array([[1.0, 0], [-1, 1]]),
        known=lambda u: np.array([6 * u[0] + 2 * magnitude(u[0]), _stribeck(u[1], 8, 0.5)]),
        drag=lambda v: np.array([0 * v[0], -4 * v[1] * magnitude(v[1])]),
        inputs=1,
    ),
    "arm": Hand(
        mass=_arm_mass,
        force=_arm_force,
        distribution=lambda x: np.eye(2),
        known=lambda u: np.array([0.02 * u[0], _stribeck(u[1], 0.03, 0.6) + 0.004 * magnitude(u[1])]),
        drag=lambda v: np.array([-0.01 * v[0] * magnitude(v[0]), 0 * v[1]]),
        inputs=2,
    ),
    "cart": Hand(
        mass=lambda x: np.array([[0.08, 0.2 * np.cos(x[0])], [0.2 * np.cos(x[0]), 2.5]]),
        force=lambda x, v, w: np.array([-1.96 * np.sin(x[0]), w[0] + 0.2 * v[0] ** 2 * np.sin(x[0])]),
        distribution=lambda x: np.array([[1, 0, 0.4 * np.cos(x[0])], [0, 1, 1]]),
        known=lambda u: np.array([0 * u[0], _stribeck(u[1], 1.1, 0.4), 0.9 * u[2] + 0.2 * magnitude(u[2])]),
        drag=lambda v: np.array([0 * v[0], -0.5 * v[1] * magnitude(v[1])]),
        inputs=1,
    ),
}
TEXTS = {"one_mass": ONE_MASS, "two_mass": TWO_MASS, "arm": ARM, "cart": CART}


@cache
def bare_machine(name: str, effects: bool = False) -> System:
    """A machine's system, built once a process; its declared effects are ``EFFECTS``."""
    spec = parse_spec(TEXTS[name] + (EFFECTS[name] if effects else ""), Path(f"{name}.yaml"))
    return add_declared_effects(build_system(spec), spec)


def machine(name: str, observer: str = "", envelope: str = "", effects: bool = False) -> tuple[Spec, System]:
    """A machine's spec and system; ``observer`` and ``envelope`` are YAML of these sections."""
    text = TEXTS[name] + (EFFECTS[name] if effects else "")
    text += f"observer: {observer}\n" if observer else ""
    text += f"envelope: {envelope}\n" if envelope else ""
    return parse_spec(text, Path(f"{name}.yaml")), bare_machine(name, effects)
