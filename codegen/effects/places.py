"""Places of effects: the coordinates of a contact or an input, which decide which effects are twins."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import sympy

from codegen.mechanics.system import System


def pairs(system: System) -> list[tuple[int, int]]:
    """Every pair of coordinates, the first before the second."""
    return list(combinations(range(system.degrees_of_freedom), 2))


def contact_coordinate(system: System, contact: int) -> int:
    """The coordinate that a contact acts on most, by the size of its column of U."""
    return _largest(system, system.distribution[:, contact])


def driven_coordinate(system: System, index: int) -> int:
    """The coordinate that an input drives most, by the size of ∂g/∂w."""
    return _largest(system, (row.diff(system.inputs[index]) for row in system.force))


def _largest(system: System, entries: Iterable[sympy.Expr]) -> int:
    """Index of the largest entry; one that varies with the state counts as 1."""
    numbers = [sympy.sympify(e).subs(system.values) for e in entries]
    sizes = [abs(float(e)) if e.is_number else 1.0 for e in numbers]
    return sizes.index(max(sizes))


def coupled_or_varying(system: System, coordinate: int) -> bool:
    """Whether a coordinate's inertia is coupled to others or depends on position."""
    row = system.mass_matrix[coordinate, :]
    coupled = any(row[j] != 0 for j in range(row.cols) if j != coordinate)
    return coupled or bool(row[coordinate].has(*system.positions))


def drives(system: System, index: int) -> bool:
    """Whether an input acts on the machine."""
    return bool(system.force.has(system.inputs[index]))


def drive_force(system: System, contact: int) -> sympy.Expr:
    """L: force of the inputs along a contact, U' (g(w) − g(0)) / U'U; on one coordinate the drive force on it."""
    column = system.distribution[:, contact]
    driven = system.force - system.force.subs(dict.fromkeys(system.inputs, 0))
    return sympy.expand(column.dot(driven) / column.dot(column))


def pair_contacts(system: System, first: int, second: int) -> list[int]:
    """Every contact between these two coordinates: its slip is ±(v₁ − v₂)."""
    unit = sympy.zeros(system.degrees_of_freedom, 1)
    unit[first], unit[second] = 1, -1
    columns = [system.distribution[:, c] for c in range(len(system.contacts))]
    return [c for c, column in enumerate(columns) if column in (unit, -unit)]


def lone_coordinate(system: System, contact: int) -> int | None:
    """The coordinate whose unit vector is this contact's column of U, or None."""
    column = system.distribution[:, contact]
    touched = [i for i, entry in enumerate(column) if entry != 0]
    return touched[0] if len(touched) == 1 and abs(column[touched[0]]) == 1 else None


def sole_drive(system: System, coordinate: int) -> int | None:
    """The input that is the only declared force on this coordinate and acts nowhere else, or None.

    Then gain·w = M a + λ and w = (M/gain) a + λ/gain are the same motion.
    """
    if coupled_or_varying(system, coordinate):
        return None
    force = system.force[coordinate]
    acting = [k for k, w in enumerate(system.inputs) if force.has(w)]
    if len(acting) != 1 or force.subs(system.inputs[acting[0]], 0) != 0:
        return None
    elsewhere = any(f.has(system.inputs[acting[0]]) for i, f in enumerate(system.force) if i != coordinate)
    moved = force.has(*system.positions, *system.velocities)
    return None if elsewhere or moved or _shares_a_contact(system, coordinate) else acting[0]


def _shares_a_contact(system: System, coordinate: int) -> bool:
    """Whether a contact acts on this coordinate and on another: its level then cannot take up a gain."""
    touching = [k for k in range(len(system.contacts)) if system.distribution[coordinate, k] != 0]
    return any(lone_coordinate(system, k) is None for k in touching)


def lone_contacts(system: System, coordinate: int) -> list[int]:
    """Every contact that acts on this coordinate alone."""
    return [k for k in range(len(system.contacts)) if lone_coordinate(system, k) == coordinate]
