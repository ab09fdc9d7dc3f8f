"""Machines as specs for tests: written ones, those on springs with numbers to choose, chains, and any M, B and U."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import sympy

from codegen.effects.declare import system_of
from codegen.mechanics import System
from codegen.spec import Spec, parse_spec

# Written out; ``tests.observers.by_hand`` has each in NumPy too.

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

TEXTS = {"one_mass": ONE_MASS, "two_mass": TWO_MASS, "arm": ARM, "cart": CART}

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

# With numbers to choose.

SPRING_MASS = """
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

TWO_SPRINGS = """
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

TWO_LINKS = """
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
AXIS = """
name: axis
coordinates:
  x: {{velocity: v, unit: {unit}}}
inputs:
  w: {{unit: "{force}"}}
parameters:
  m: {{value: 2, unit: "{inertia}"}}
  k: {{value: 30, unit: "{force}/{unit}"}}
mass_matrix: [[m]]
force: [w - k*x]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, unit: "{force}", {law}}}
effects: {effects}
envelope:
  x: [-1, 1]
  v: [-2, 2]
  w: [-12, 12]
simulation:
  duration: 2
  sample_time: 0.002
  inputs: {{w: 14*sin(2*pi*0.5*t) + 6*sin(2*pi*1.7*t)}}
"""

COULOMB = "law: coulomb, a: 3"

# Numbered masses, in each form that gives another shape of M and of loops.

CHAIN_HEAD = """\
name: chain
coordinates:
  x1..{n}: {{velocity: v1..{n}, unit: m}}
inputs:
  w: {{unit: N}}
parameters:
  m: {{value: 1.5, unit: kg}}
  j: {{value: 0.4, unit: kg}}
  k: {{value: 90, unit: N/m}}
  c: {{value: 0.7, unit: N*s/m}}
  q: {{value: 0.2, unit: kg/m^2}}
"""
CHAIN_TAIL = """\
observer:
  kind: {kind}
  velocity: estimated
  gains: {gains}
  sample_time: 0.001
"""
CHAIN_CONTACTS = """\
friction:
  {distribution}contacts:
    - {{name: ground1..{n}, {bodies}law: {law}, unit: N}}
"""
CHAIN_SPRINGS = """\
force:
  - k*(x2 - x1) + c*(v2 - v1) + w
  - k*(x1..{b} - 2*x2..{a} + x3..{n}) + c*(v1..{b} - 2*v2..{a} + v3..{n})
  - k*(x{a} - x{n}) + c*(v{a} - v{n})
"""
GCFO = "{K_F: 20, K_v: 30}"
HALF = "coulomb, a: 0.5"


@cache
def bare_machine(name: str, effects: bool = False) -> System:
    """A machine's system, built once a process; its declared effects are ``EFFECTS``."""
    spec = parse_spec(TEXTS[name] + (EFFECTS[name] if effects else ""), Path(f"{name}.yaml"))
    return system_of(spec)


def machine(name: str, observer: str = "", envelope: str = "", effects: bool = False) -> tuple[Spec, System]:
    """A machine's spec and system; ``observer`` and ``envelope`` are YAML of these sections."""
    text = TEXTS[name] + (EFFECTS[name] if effects else "")
    text += f"observer: {observer}\n" if observer else ""
    text += f"envelope: {envelope}\n" if envelope else ""
    return parse_spec(text, Path(f"{name}.yaml")), bare_machine(name, effects)


def read(text: str) -> Spec:
    """The spec of a text."""
    return parse_spec(text, Path("machine.yaml"))


def read_machine(text: str) -> tuple[Spec, System]:
    """The spec and its system with declared effects."""
    spec = read(text)
    return spec, system_of(spec)


def one_mass(m: float = 2, a: float = 3, k: float = 0, b: float = 0, more: str = "") -> tuple[Spec, System]:
    return read_machine(SPRING_MASS.format(m=m, a=a, k=k, b=b) + more)


def two_mass(between: float = 2, ground: float = 5, more: str = "") -> tuple[Spec, System]:
    return read_machine(TWO_SPRINGS.format(between=between, ground=ground) + more)


def arm(a: float = 0, more: str = "") -> tuple[Spec, System]:
    return read_machine(TWO_LINKS.format(a=a) + more)


def axis(law: str = COULOMB, effects: str = "[]", turns: bool = False) -> tuple[Spec, System]:
    """A mass on a spring (or a turning one), pushed hard enough to slide and to stop."""
    units = ("rad", "N*m", "kg*m^2") if turns else ("m", "N", "kg")
    unit, force, inertia = units
    text = AXIS.format(law=law, effects=effects, unit=unit, force=force, inertia=inertia)
    return read_machine(text)


def effect(kind: str, on: str, **parameters: object) -> str:
    values = ", ".join(f"{name}: {value}" for name, value in parameters.items())
    return f"[{{kind: {kind}, on: {on}, parameters: {{{values}}}}}]"


def chain(n: int, damped: bool = True, kind: str = "gcfo", gains: str = GCFO, law: str = HALF, more: str = "") -> str:
    """Masses on springs and dampers, each on the ground: M is diagonal."""
    bodies = f"topology:\n  bodies:\n    body1..{n}: {{mass: m, x: x1..{n}}}\n"
    contacts = CHAIN_CONTACTS.format(distribution="", n=n, bodies=f"bodies: [body1..{n}, ground], ", law=law)
    springs = CHAIN_SPRINGS.format(a=n - 1, b=n - 2, n=n)
    springs = springs if damped else re.sub(r" \+ c\*\([^)]*\)", "", springs)
    return CHAIN_HEAD.format(n=n) + bodies + springs + contacts + more + CHAIN_TAIL.format(kind=kind, gains=gains)


def coupled(n: int, inertia: str = "j") -> str:
    """Flywheels between neighbours, which turn as these come apart: M is tridiagonal; ``inertia`` may hold x1..n-1."""
    energies = f"  kinetic: [m*v1..{n}**2/2, {inertia}*(v1..{n - 1} - v2..{n})**2/2]\n"
    energies += f"  potential: [k*(x1..{n - 1} - x2..{n})**2/2]\n"
    rows = [", ".join("1" if i == j else "0" for j in range(n)) for i in range(n)]
    distribution = "distribution:\n" + "".join(f"    - [{row}]\n" for row in rows) + "  "
    contacts = CHAIN_CONTACTS.format(distribution=distribution, n=n, bodies="", law=HALF)
    force = "force:\n  - w\n" + "  - 0\n" * (n - 1)
    return (
        CHAIN_HEAD.format(n=n)
        + "lagrangian:\n"
        + energies
        + force
        + contacts
        + CHAIN_TAIL.format(kind="gcfo", gains=GCFO)
    )


def machine_text(M, B, U, cancellation="{}", kind=None, envelope="") -> str:
    """A spec of n coordinates x1…, r inputs w1…, p contacts c1…, all turning; entries are texts or numbers."""
    n, r, p = len(M), len(B[0]), len(U[0])
    kind = kind or ("mgto" if np.linalg.matrix_rank(_numbers(U)) == p else "gto")
    gains = f"{{K_1: {_rows(np.zeros((p, n)))}, K_2: {_rows(-np.ones((p, n)))}}}" if kind == "mgto" else "{K_2: -10}"
    force = [" + ".join(f"({B[i][j]})*w{j + 1}" for j in range(r)) for i in range(n)]
    lines = [
        "name: machine",
        "coordinates:",
        *(f"  x{i + 1}: {{velocity: v{i + 1}, unit: rad}}" for i in range(n)),
        "inputs:",
        *(f"  w{j + 1}: {{unit: N*m}}" for j in range(r)),
        "parameters: {I0: {value: 1, unit: kg*m^2}}",
        "mass_matrix:",
        *(f"  - [{', '.join(f'I0*({e})' for e in row)}]" for row in M),
        "force:",
        *(f"  - {f}" for f in force),
        "friction:",
        f"  distribution: [{', '.join('[' + ', '.join(str(e) for e in row) + ']' for row in U)}]",
        "  contacts:",
        *(f"    - {{name: c{k + 1}, law: coulomb, a: 1, unit: N*m}}" for k in range(p)),
        f"observer: {{kind: {kind}, velocity: measured, gains: {gains}, sample_time: 0.001}}",
        f"envelope: {{{envelope}}}",
        f"cancellation: {cancellation}",
    ]
    return "\n".join(lines) + "\n"


def _numbers(matrix) -> np.ndarray:
    return np.array([[complex(sympy.sympify(e).subs({"x1": 0.3, "x2": -0.4})).real for e in row] for row in matrix])


def _rows(matrix: np.ndarray) -> str:
    return str(matrix.astype(int).tolist())
