"""Chains of numbered masses, in each form that gives another shape of M and of loops."""

from __future__ import annotations

import re

HEAD = """\
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
TAIL = """\
observer:
  kind: {kind}
  velocity: estimated
  gains: {gains}
  sample_time: 0.001
"""
CONTACTS = """\
friction:
  {distribution}contacts:
    - {{name: ground1..{n}, {bodies}law: {law}, unit: N}}
"""
SPRINGS = """\
force:
  - k*(x2 - x1) + c*(v2 - v1) + w
  - k*(x1..{b} - 2*x2..{a} + x3..{n}) + c*(v1..{b} - 2*v2..{a} + v3..{n})
  - k*(x{a} - x{n}) + c*(v{a} - v{n})
"""
GCFO = "{K_F: 20, K_v: 30}"
COULOMB = "coulomb, a: 0.5"


def chain(
    n: int, damped: bool = True, kind: str = "gcfo", gains: str = GCFO, law: str = COULOMB, more: str = ""
) -> str:
    """Masses on springs and dampers, each on the ground: M is diagonal."""
    bodies = f"topology:\n  bodies:\n    body1..{n}: {{mass: m, x: x1..{n}}}\n"
    contacts = CONTACTS.format(distribution="", n=n, bodies=f"bodies: [body1..{n}, ground], ", law=law)
    springs = SPRINGS.format(a=n - 1, b=n - 2, n=n)
    springs = springs if damped else re.sub(r" \+ c\*\([^)]*\)", "", springs)
    return HEAD.format(n=n) + bodies + springs + contacts + more + TAIL.format(kind=kind, gains=gains)


def coupled(n: int, inertia: str = "j") -> str:
    """Flywheels between neighbours, which turn as these come apart: M is tridiagonal; ``inertia`` may hold x1..n-1."""
    energies = f"  kinetic: [m*v1..{n}**2/2, {inertia}*(v1..{n - 1} - v2..{n})**2/2]\n"
    energies += f"  potential: [k*(x1..{n - 1} - x2..{n})**2/2]\n"
    rows = [", ".join("1" if i == j else "0" for j in range(n)) for i in range(n)]
    distribution = "distribution:\n" + "".join(f"    - [{row}]\n" for row in rows) + "  "
    contacts = CONTACTS.format(distribution=distribution, n=n, bodies="", law=COULOMB)
    force = "force:\n  - w\n" + "  - 0\n" * (n - 1)
    return HEAD.format(n=n) + "lagrangian:\n" + energies + force + contacts + TAIL.format(kind="gcfo", gains=GCFO)
