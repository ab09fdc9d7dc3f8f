"""One machine said in several ways: the specs of the thesis' examples with their equation of motion put otherwise."""

from __future__ import annotations

import re
from pathlib import Path

from codegen.mechanics import System, build_system
from codegen.spec import Spec, parse_spec

SPECS = Path(__file__).resolve().parents[2] / "specs"

TWO_MASS_TOPOLOGY = """\
topology:
  bodies:
    top: {mass: m1, x: x1}
    bottom: {mass: m2, x: x2}
force:
  - -(eta2 + eta3)*x1 + eta3*x2
  - eta3*x1 - (eta1 + eta3)*x2 + w
friction:
  contacts:
    - {name: between, bodies: [top, bottom], law: coulomb, a: 10, unit: N}
    - {name: ground, bodies: [bottom, ground], law: coulomb, a: 20, unit: N}
"""

ARM_CONSTRAINTS = """\
constraints:
  bodies:
    upper: {mass: m1, inertia: I1, x: b1*cos(theta1), y: b1*sin(theta1), angle: theta1}
    fore:
      mass: m2
      inertia: I2
      x: l1*cos(theta1) + b2*cos(theta1 + theta2)
      y: l1*sin(theta1) + b2*sin(theta1 + theta2)
      angle: theta1 + theta2
  force:
    upper: {y: -m1*gravity}
    fore: {y: -m2*gravity}
  equations:
    - upper_x - b1*cos(upper_angle)
    - upper_y - b1*sin(upper_angle)
    - fore_x - l1*cos(upper_angle) - b2*cos(fore_angle)
    - fore_y - l1*sin(upper_angle) - b2*sin(fore_angle)
force: [w1, w2]
friction:
  contacts:
    - {name: shoulder, bodies: upper, along: angle, law: coulomb, a: 0.001, unit: N*m}
    - {name: elbow, bodies: [fore, upper], along: angle, law: coulomb, a: 0.005, unit: N*m}
"""

CART_CONSTRAINTS = """\
name: cart
coordinates: {s: {velocity: sd, unit: m}, q: {velocity: qd, unit: rad}}
inputs: {w: {unit: N}}
parameters:
  mc: {value: 3, unit: kg}
  mb: {value: 0.7, unit: kg}
  J: {value: 0.02, unit: kg*m^2}
  l: {value: 0.4, unit: m}
  gravity: {value: 9.81, unit: m/s^2}
  d: {value: 0.3, unit: N*s/m}
constraints:
  bodies:
    cart: {mass: mc, x: s}
    bob: {mass: mb, inertia: J, x: s + l*sin(q), y: -l*cos(q), angle: q}
  force:
    cart: {x: w - d*cart_vx}
    bob: {y: -mb*gravity, x: -d*bob_vx*bob_x/l}
friction:
  contacts:
    - {name: rail, bodies: cart, a: 2, unit: N}
    - {name: wall, bodies: bob, along: y, a: 0.5, unit: N}
envelope: {q: [-1, 1]}
"""


def swapped(spec: str, form: str) -> str:
    """A shipped spec's text with the sections of its equation of motion replaced by ``form``."""
    text = (SPECS / f"{spec}.yaml").read_text()
    kept = re.split(r"(?m)^(?=[a-z_]+:)", text)
    gone = ("mass_matrix:", "lagrangian:", "force:", "friction:")
    return "".join(part for part in kept if not part.startswith(gone)) + form


def read(text: str) -> tuple[Spec, System]:
    """The spec of a text and its system."""
    spec = parse_spec(text, Path("form.yaml"))
    return spec, build_system(spec)
