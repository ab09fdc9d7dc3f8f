"""Time-stepping simulation of a System with set-valued friction (stick and slip), as CasADi functions.

The contacts of a step have set-valued laws (``contact.py``), laws with states (``dynamic_contact.py``), smooth parts.
"""

from collections.abc import Sequence
from math import ceil
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.solve import factorised
from codegen.mechanics.system import TIME, ContactFriction, System, with_loads
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


_ROUNDING = 64 * float(np.finfo(np.float64).eps)
"""A velocity after a step is a rounding error if it is below this share of the terms whose sum it is."""


class Plant:
    """The time stepper of a System; its parameters are numbers in the CasADi functions.

    One step of length h is the midpoint scheme of Moreau (1988), as predictor and corrector:

        x_m = x + h/2 v,    M(x_m)(v⁺ − v) = h (g(x_m, v_m, w, t_m) − U λ),    x⁺ = x_m + h/2 v⁺

    The predictor takes v_m = v, the corrector v_m = (v + v⁺)/2 with the predictor's v⁺: smooth motion is second-order
    accurate. Velocity-dependent forces are explicit: h must be below 2/rate of the fastest damping. Laws with states
    are integrated in the same step by an L-stable scheme of second order, for any stiffness.

    The state is the column (x, v, x_load, v_load, q, z): n positions and n velocities; positions, then velocities, of
    the loads behind springs; q, the set-valued forces of the last substep, from which the solver for the next one
    starts; z, the states of the laws that have any. ``t`` in an expression is the time from the start of the run, s.

    Attributes:
        substeps: steps in one sample.
        state_size: 2 n + 2 loads + set-valued forces + states.
        sample: CasADi function (state, drive column) → (state one sample later, contact forces λ in the first substep).
            A drive column is (t, h, w of substep 1, …, w of the last substep).
    """

    def __init__(self, system: System, substeps: int = 10) -> None:
        self.system, self.substeps = system, substeps
        full = with_loads(system)
        self.contacts = PlantContacts(full)
        self.state_size = 2 * full.degrees_of_freedom + self.contacts.memory_size
        self._step = _step_function(self.contacts, system.degrees_of_freedom)
        self.sample = self._sample_function()

    def start(self, positions: Array, velocities: Array) -> Array:
        """The initial state (state_size,) at positions and velocities (n,), with unloaded springs and friction."""
        loaded = [t.coordinate for t in self.system.transmissions]
        forces, z = np.zeros(len(self.contacts.set_valued)), self.contacts.dynamic.rest
        return np.concatenate([positions, velocities, positions[loaded], velocities[loaded], forces, z])

    def _sample_function(self) -> Any:
        """The function ``sample``: all substeps of one sample."""
        m, k = len(self.system.inputs), self.substeps
        state, drive = casadi.MX.sym("state", self.state_size), casadi.MX.sym("drive", 2 + m * k)
        times = drive[0] + drive[1] * casadi.DM(range(k)).T
        inputs, lengths = casadi.reshape(drive[2:], m, k), casadi.repmat(drive[1], 1, k)
        states, forces = self._step.mapaccum("substeps", k, 1)(state, inputs, times, lengths)
        return casadi.Function("sample", [state, drive], [states[:, -1], forces[:, 0]])


def _step_function(contacts: PlantContacts, motors: int) -> Any:
    """CasADi function (state, w, t, h) → (state, λ) of one step.

    Args:
        contacts: the contacts of the system that has the loads behind springs as further coordinates.
        motors: number of coordinates without these loads; they come first.
    """
    system = contacts.system
    n = system.degrees_of_freedom
    state = casadi.SX.sym("state", 2 * n + contacts.memory_size)
    at_x = [*range(motors), *range(2 * motors, motors + n)]
    at_v = [*range(motors, 2 * motors), *range(motors + n, 2 * n)]
    w, t, h = casadi.SX.sym("w", len(system.inputs)), casadi.SX.sym("t"), casadi.SX.sym("h")
    x, v, memory = state[at_x], state[at_v], state[2 * n :]
    middle = x + h / 2 * v
    names = symbol_values(system.values, (system.positions, middle), (system.inputs, w)) | {TIME: t + h / 2}
    mass, U = to_casadi(system.mass_matrix, names), to_casadi(system.distribution, names)
    factors = factorised(mass)
    compliance = factors.solve_columns(U)
    mobility = casadi.mtimes(U.T, compliance) if system.contacts else casadi.SX(0, 0)

    def end_velocity(velocity: Any, guess: Any) -> tuple[Any, Any, Any]:
        """(v⁺, new memory of the contacts, contact forces λ), with the smooth forces evaluated at ``velocity``.

        Args:
            velocity: v_m.
            guess: memory from which the solver of the contact forces starts.
        """
        here = names | {s: velocity[i] for i, s in enumerate(system.velocities)}
        force = to_casadi(system.force, here)
        if not system.contacts:
            return v + h * factors.solve(force), guess, guess
        slip = casadi.mtimes(U.T, velocity)
        smooth, levels = smooth_forces(system.contacts, slip, here), contacts.levels(slip, here)
        free = factors.solve(force - casadi.mtimes(U, smooth))
        slip_before, free_slip_rate = casadi.mtimes(U.T, v), casadi.mtimes(U.T, free)
        found, new_memory = contacts.forces(guess, slip_before, free_slip_rate, mobility, levels, h)
        return _next_velocity(v, h, free, compliance, found), new_memory, found + smooth

    predicted, predicted_memory, _ = end_velocity(v, memory)
    after, new_memory, force = end_velocity((v + predicted) / 2, contacts.guess(memory, predicted_memory))
    motion = casadi.SX(2 * n, 1)
    motion[at_x], motion[at_v] = middle + h / 2 * after, after
    result = casadi.densify(casadi.vertcat(motion, new_memory))
    return casadi.Function("step", [state, w, t, h], [result, casadi.densify(force)], {"cse": True})


def _next_velocity(v: Any, h: Any, free: Any, compliance: Any, forces: Any) -> Any:
    """v⁺ = v + h (free − M⁻¹U λ), with zeros in place of rounding errors, so that a contact at rest stays at rest.

    Args:
        free: acceleration without the set-valued forces.
        compliance: M⁻¹U.
        forces: λ, the set-valued ones.
    """
    after = v + h * (free - casadi.mtimes(compliance, forces))
    size = casadi.fabs(v) + h * (casadi.fabs(free) + casadi.mtimes(casadi.fabs(compliance), casadi.fabs(forces)))
    return casadi.if_else(casadi.fabs(after) / size <= _ROUNDING, 0, after)


LONGEST_SUBSTEP = 1e-4
"""Longest substep, s."""
STEP_OF_PRESLIDING = 0.05
"""Longest substep times the rate of a bristle or spring: its natural frequency, or c/m of its damper."""
MOST_SUBSTEPS = 1000
"""Most substeps in a sample."""


def substeps_of(system: System, period: float, position: Array) -> int:
    """Number of substeps in a sample, from 1 to ``MOST_SUBSTEPS``.

    A substep is at most ``LONGEST_SUBSTEP``, and at most ``STEP_OF_PRESLIDING``/ω for each law with states and each
    load behind a spring, where ω = √(k/m) is the natural frequency of the bristle or spring; for a spring with a damper
    also at most ``STEP_OF_PRESLIDING``/(c/m). Position and velocity then agree with an exact integration to 1e-5 of
    their size.

    Args:
        period: sample time, s.
        position: (n,) at which M and U are evaluated.
    """
    longest = LONGEST_SUBSTEP
    dynamic = DynamicContacts(system)
    if dynamic.contacts:
        names = symbol_values({**system.values, **dict(zip(system.positions, position, strict=True))})
        mass, U = (np.asarray(casadi.evalf(to_casadi(m, names))) for m in (system.mass_matrix, system.distribution))
        mobility = np.diag(U.T @ np.linalg.solve(mass, U))[list(dynamic.contacts)]
        rate = float(np.sqrt(np.max(mobility * np.maximum(dynamic.stiffness, 0))))
        longest = min(longest, STEP_OF_PRESLIDING / rate) if rate > 0 else longest
    for t in system.transmissions:
        inertia = system.mass_matrix[t.coordinate, t.coordinate] * t.load_fraction * (1 - t.load_fraction)
        stiffness, damping = (float((s / inertia).subs(system.values)) for s in (t.stiffness, t.damping))
        longest = min(longest, STEP_OF_PRESLIDING / max(stiffness**0.5, damping))
    return min(max(1, ceil(period / longest - 1e-9)), MOST_SUBSTEPS)
