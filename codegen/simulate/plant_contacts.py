"""Contact forces of a plant over one step: set-valued laws, laws with states, and smooth parts of all contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import ContactFriction, System
from codegen.simulate.contact import SWEEPS, Levels, contact_forces, coupled, sweep
from codegen.simulate.dynamic_contact import DynamicContacts, has_states
from codegen.spec.functions import Sgn

_STANDSTILL = 1e-30
"""Added to the magnitude of a slip that is a divisor."""


class PlantContacts:
    """The contacts of a System, each with up to three parts: a set-valued one, one with states, a smooth one.

    A law of zero memory is set-valued. A law with states is integrated; the level that declared effects add to it is a
    further set-valued part: λ = force(u, z) + sgn(u) extra_level + extra_force. Other laws are represented by their
    level in steady sliding; ``refuse_unsimulable`` excludes them from a simulation.

    Attributes:
        set_valued: indices of the contacts with a set-valued part.
        dynamic: the contacts whose laws have states.
        memory_size: size of the memory: set-valued forces of the last substep (initial guess of the next), and states.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.dynamic = DynamicContacts(system)
        contacts = system.contacts
        self.set_valued = tuple(c for c, one in enumerate(contacts) if not has_states(one) or one.extra_level != 0)
        chosen = [contacts[c] for c in self.set_valued]
        self._levels = [one.extra_level if has_states(one) else one.plant_level for one in chosen]
        self._jumps = tuple(level.has(Sgn) for level in self._levels)
        self.memory_size = len(self.set_valued) + len(self.dynamic.rest)

    def forces(self, memory: Any, slip: Any, free: Any, mobility: Any, levels: Levels, step: Any) -> tuple[Any, Any]:
        """Mean contact forces of a step without the smooth part, contacts by 1, and the memory after it.

        Coupled set-valued laws and laws with states are solved alternately (Gauss–Seidel).

        Args:
            memory: before the step, memory_size by 1.
            slip, free, mobility: of all contacts, as in ``contact_forces``.
            levels: of the set-valued parts, see ``levels``.
        """
        lines, chosen = list(self.set_valued), list(self.dynamic.contacts)
        q, z = self._split(memory)
        if not chosen:
            found = contact_forces(slip, free, mobility, levels, step, q)
            return found, found
        total = casadi.SX(len(self.system.contacts), 1)
        among = mobility[chosen, chosen]
        if not lines:
            forces, after = self.dynamic.step(slip[chosen], free[chosen], among, z, step)
            total[chosen] = forces
            return total, after
        own, cross = mobility[lines, lines], mobility[lines, chosen]
        for _ in range(SWEEPS if cross.nnz() or coupled(own) else 1):
            rest = free[chosen] - casadi.mtimes(cross.T, q)
            forces, after = self.dynamic.step(slip[chosen], rest, among, z, step)
            left = free[lines] - casadi.mtimes(cross, forces)
            q = sweep(slip[lines], left, own, levels, step, q)
        for k, c in enumerate(lines):
            total[c] += q[k]
        for k, c in enumerate(chosen):
            total[c] += forces[k]
        return total, casadi.vertcat(q, after)

    def guess(self, memory: Any, found: Any) -> Any:
        """The memory before a step, with the set-valued forces from a first pass through the step."""
        return casadi.vertcat(self._split(found)[0], self._split(memory)[1])

    def _split(self, memory: Any) -> list[Any]:
        """[set-valued forces, states] of a memory."""
        count = len(self.set_valued)
        return list(casadi.vertsplit(memory, [0, count, self.memory_size]))

    def levels(self, slip: Any, names: dict[sympy.Symbol, Any]) -> Levels:
        """Levels of the set-valued parts at slip velocities ``slip``, contacts by 1."""
        contacts = [self.system.contacts[c] for c in self.set_valued]
        columns = levels_at(contacts, self._levels, slip[list(self.set_valued)], names)
        forward, backward, held = (casadi.fmax(0, column) for column in columns)
        return Levels(forward, backward, held, self._jumps)


def levels_at(
    contacts: Sequence[ContactFriction], levels: Sequence[sympy.Expr], slip: Any, names: dict[sympy.Symbol, Any]
) -> list[Any]:
    """[forward, backward, at rest]: levels of contacts, contacts by 1, at the magnitudes of slip velocities."""
    columns: list[list[Any]] = [[], [], []]
    for c, (contact, level) in enumerate(zip(contacts, levels, strict=True)):
        speed = casadi.fabs(slip[c]) + _STANDSTILL
        for column, u in zip(columns, (speed, -speed, casadi.SX(0)), strict=True):
            column.append(to_casadi(level, names | {contact.slip: u}))
    return [casadi.vertcat(*column) for column in columns]


def smooth_forces(contacts: Sequence[ContactFriction], slip: Any, names: dict[sympy.Symbol, Any]) -> Any:
    """Smooth forces that declared effects add to contacts, contacts by 1, at slip velocities ``slip``."""
    return casadi.vertcat(*[to_casadi(c.extra_force, names | {c.slip: slip[k]}) for k, c in enumerate(contacts)])
