"""Which coordinate a contact acts on alone, and the other way round: it decides which effects are twins."""

from __future__ import annotations

from codegen.mechanics.system import System


def lone_coordinate(system: System, contact: int) -> int | None:
    """The coordinate whose unit vector is this contact's column of U, or None."""
    column = system.distribution[:, contact]
    touched = [i for i, entry in enumerate(column) if entry != 0]
    return touched[0] if len(touched) == 1 and abs(column[touched[0]]) == 1 else None


def lone_contacts(system: System, coordinate: int) -> list[int]:
    """Every contact that acts on this coordinate alone."""
    return [k for k in range(len(system.contacts)) if lone_coordinate(system, k) == coordinate]
