"""Small machines as specs."""

from __future__ import annotations

from pathlib import Path

from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec

ONE_MASS = """
name: one_mass
coordinates:
  x: {{velocity: v, unit: m}}
inputs:
  w: {{unit: N}}
parameters:
  m: {{value: {m}, unit: kg}}
  k: {{value: {k}, unit: N/m}}
  b: {{value: {b}, unit: N*s/m}}
mass_matrix: [[m]]
force: [w - k*x - b*v]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, law: coulomb, a: {a}, unit: N}}
"""

TWO_MASS = """
name: two_mass
coordinates:
  x1: {{velocity: v1, unit: m}}
  x2: {{velocity: v2, unit: m}}
inputs:
  w: {{unit: N}}
parameters:
  m1: {{value: 1, unit: kg}}
  m2: {{value: 2, unit: kg}}
  k1: {{value: 40, unit: N/m}}
  k2: {{value: 60, unit: N/m}}
mass_matrix: [[m1, 0], [0, m2]]
force: [-k1*x1, w - k2*x2]
friction:
  distribution: [[1, 0], [-1, 1]]
  contacts:
    - {{name: between, law: coulomb, a: {between}, unit: N}}
    - {{name: ground, law: coulomb, a: {ground}, unit: N}}
"""

ARM = """
name: arm
coordinates:
  q1: {{velocity: p1, unit: rad}}
  q2: {{velocity: p2, unit: rad}}
inputs:
  u1: {{unit: N*m}}
  u2: {{unit: N*m}}
parameters:
  A: {{value: 0.05, unit: kg*m^2}}
  B: {{value: 0.02, unit: kg*m^2}}
  C: {{value: 0.015, unit: kg*m^2}}
  G: {{value: 0.3, unit: N*m}}
mass_matrix:
  - [A + 2*C*cos(q2), B + C*cos(q2)]
  - [B + C*cos(q2), B]
force:
  - u1 + C*sin(q2)*(2*p1*p2 + p2**2) - G*cos(q1)
  - u2 - C*sin(q2)*p1**2
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {{name: shoulder, law: coulomb, a: {a}, unit: N*m}}
    - {{name: elbow, law: coulomb, a: {a}, unit: N*m}}
"""


def machine(text: str) -> tuple[Spec, System]:
    """The spec and its system with declared effects."""
    spec = parse_spec(text, Path("machine.yaml"))
    return spec, add_declared_effects(build_system(spec), spec)


def one_mass(m: float = 2, a: float = 3, k: float = 0, b: float = 0, more: str = "") -> tuple[Spec, System]:
    return machine(ONE_MASS.format(m=m, a=a, k=k, b=b) + more)


def two_mass(between: float = 2, ground: float = 5, more: str = "") -> tuple[Spec, System]:
    return machine(TWO_MASS.format(between=between, ground=ground) + more)


def arm(a: float = 0, more: str = "") -> tuple[Spec, System]:
    return machine(ARM.format(a=a) + more)
