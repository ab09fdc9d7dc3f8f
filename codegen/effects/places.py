"""Which coordinates contacts and inputs act on: this decides where an effect applies and which are equivalent.

Effects are equivalent ("twins") where they give the same equation of motion and differ only in the names of the forces.
This depends on how many contacts and inputs act on a coordinate.
"""

from itertools import combinations

import sympy

from codegen.mechanics.system import System


def pairs(system: System) -> list[tuple[int, int]]:
    """Every pair of coordinates (i, j) with i < j."""
    return list(combinations(range(system.degrees_of_freedom), 2))


def coupled_or_varying(system: System, coordinate: int) -> bool:
    """Whether a coordinate's row of M has off-diagonal entries, or its inertia depends on position."""
    row = system.mass_matrix[coordinate, :]
    coupled = any(row[j] != 0 for j in range(row.cols) if j != coordinate)
    return coupled or bool(row[coordinate].has(*system.positions))


def drive_force(system: System, contact: int) -> sympy.Expr:
    """Force of the inputs in the direction of a contact: d'(g(w) − g(0)) / d'd, with d the contact's column of U.

    For a contact that acts on one coordinate alone this is the drive force on that coordinate.
    """
    column = system.distribution[:, contact]
    return sympy.expand(column.dot(system.drive_force) / column.dot(column))


def drive_on(system: System, coordinate: int) -> sympy.Expr:
    """Force of the inputs on a coordinate: g(w) − g(0)."""
    return sympy.expand(system.drive_force[coordinate])


def damping(system: System, contact: int) -> sympy.Expr:
    """Derivative at rest of the force along a contact by its slip velocity: d' ∂g/∂v d/(d'd)², at most 0."""
    column = system.distribution[:, contact]
    touched = [i for i, entry in enumerate(column) if entry != 0]
    rest = dict.fromkeys((*system.velocities, *system.inputs), 0)
    slopes = (column[i] * system.force[i].diff(system.v[k]).subs(rest) * column[k] for i in touched for k in touched)
    return sympy.expand(sum(slopes) / column.dot(column) ** 2)


def pair_contacts(system: System, first: int, second: int) -> list[int]:
    """Every contact between these two coordinates, that is, with slip velocity ±(v₁ − v₂)."""
    unit = sympy.zeros(system.degrees_of_freedom, 1)
    unit[first], unit[second] = 1, -1
    columns = [system.distribution[:, c] for c in range(len(system.contacts))]
    return [c for c, column in enumerate(columns) if column in (unit, -unit)]


def lone_coordinate(system: System, contact: int) -> int | None:
    """The only coordinate on which a contact acts, if its column of U is ± a unit vector; else None."""
    column = system.distribution[:, contact]
    touched = [i for i, entry in enumerate(column) if entry != 0]
    return touched[0] if len(touched) == 1 and abs(column[touched[0]]) == 1 else None


def sole_drive(system: System, coordinate: int) -> int | None:
    """The input that is the only declared force on this coordinate and acts on no other; None if there is none.

    With constant, uncoupled inertia the equation of motion is then gain·w = M a + λ. A gain on the input is
    indistinguishable from M and the friction levels divided by it.
    """
    if coupled_or_varying(system, coordinate):
        return None
    force = system.force[coordinate]
    acting = [k for k, w in enumerate(system.inputs) if force.has(w)]
    if len(acting) != 1 or force.subs(system.inputs[acting[0]], 0) != 0:
        return None
    elsewhere = any(f.has(system.inputs[acting[0]]) for i, f in enumerate(system.force) if i != coordinate)
    varying = force.has(*system.positions, *system.velocities)
    # With a contact that acts on another coordinate too, a gain is not equivalent to another friction level.
    touching = [k for k in range(len(system.contacts)) if system.distribution[coordinate, k] != 0]
    shared = any(lone_coordinate(system, k) is None for k in touching)
    return None if elsewhere or varying or shared else acting[0]


def lone_contacts(system: System, coordinate: int) -> list[int]:
    """The contacts that act on this coordinate and on no other."""
    return [k for k in range(len(system.contacts)) if lone_coordinate(system, k) == coordinate]
