"""Free-run simulation of an arm joint by joint, with the measured motion of all other joints imposed.

The rigid-body forces of an arm are smooth and expensive. Along the measured motion they are computed once at every
sample; a free run of one joint stays near that motion, so a linearisation in the joint's own position and speed
suffices:

    M_ii x_i'' = f_i(t) + k_i(t) (x_i − x̂_i) + d_i(t) (v_i − v̂_i) + e_i

with e_i the inputs, effects and friction of joint i without approximation, and f_i the row's force less Σ_j M_ij
x̂_j''. M_ii does not depend on x_i in a tree of joints. An unexplained force stays at its joint, and a log that moves
one joint is a log of that joint alone.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.record import Record
from codegen.diagnosis.shooting import Shooter, Structure, owners, terms_of
from codegen.diagnosis.signals import central_difference
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.computed import ComputedEntry
from codegen.mechanics.system import Matrix, System

Array = NDArray[np.float64]

_NAMES = ("mass", "force", "stiffness", "damping", "position", "speed")
SIGNALS = tuple(sympy.Symbol(f"imposed_{name}", real=True) for name in _NAMES)
MASS, FORCE, STIFFNESS, DAMPING, POSITION, SPEED = SIGNALS
KEPT = 4
"""Records whose terms are kept in memory."""


def is_separable(system: System) -> bool:
    """Whether joints can be run one at a time: computed rigid-body terms, and equally many contacts on each joint."""
    n = system.degrees_of_freedom
    touched = [[i for i in range(n) if system.distribution[i, c] != 0] for c in range(len(system.contacts))]
    counts = [touched.count([i]) for i in range(n)]
    alone = all(len(rows) == 1 for rows in touched) and len(set(counts)) == 1
    return n > 1 and alone and not system.sensor_errors and bool(system.mass_matrix.atoms(ComputedEntry))


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint as a system with one coordinate.

    Attributes:
        index: of its coordinate. contacts: indices of its contacts.
        inputs: those of the arm that act here; others: positions and speeds of other joints that its effects use.
        system: its inputs are ``inputs``, SIGNALS and ``others``, in this order.
    """

    index: int
    contacts: tuple[int, ...]
    inputs: tuple[sympy.Symbol, ...]
    others: tuple[sympy.Symbol, ...]
    system: System


def joint_of(system: System, index: int) -> Joint:
    """One joint of a separable system, with the system's effects there."""
    contacts = tuple(c for c in range(len(system.contacts)) if system.distribution[index, c] != 0)
    x, v = system.positions[index], system.velocities[index]
    force = _written(system.force[index]) + FORCE + STIFFNESS * (x - POSITION) + DAMPING * (v - SPEED)
    mass = _written(system.mass_matrix[index, index]) + MASS
    own = [system.contacts[c] for c in contacts]
    used = set().union(force.free_symbols, mass.free_symbols)
    used |= set().union(*(c.extra_level.free_symbols | c.extra_force.free_symbols for c in own))
    inputs = tuple(w for w in system.inputs if w in used)
    others = tuple(s for s in (*system.positions, *system.velocities) if s in used - {x, v})
    return Joint(
        index,
        contacts,
        inputs,
        others,
        replace(
            system,
            positions=(x,),
            velocities=(v,),
            inputs=(*inputs, *SIGNALS, *others),
            position_units=(system.position_units[index],),
            input_units=("1",) * (len(inputs) + len(SIGNALS) + len(others)),
            mass_matrix=Matrix([[mass]]),
            force=Matrix([force]),
            distribution=Matrix([[system.distribution[index, c] for c in contacts]]),
            contacts=tuple(own),
            actuators={},
            transmissions=(),
        ),
    )


def _written(expression: sympy.Expr) -> sympy.Expr:
    """The terms of a sum that the spec states, without those computed from the arm's bodies."""
    return sympy.Add(*[term for term in sympy.Add.make_args(expression) if not term.has(ComputedEntry)])


def _computed(expression: sympy.Expr) -> sympy.Expr:
    return sympy.Add(*[term for term in sympy.Add.make_args(expression) if term.has(ComputedEntry)])


@dataclass(frozen=True, eq=False)
class MotionTerms:
    """Rigid-body terms along one measured motion, all (N, n) over samples and joints.

    Attributes:
        force, mass: at the declared values; force_slopes, mass_slopes: (N, n, P) by the free parameters.
        stiffness, damping: slopes of the force by the joint's own position and speed.
    """

    positions: Array
    velocities: Array
    force: Array
    mass: Array
    force_slopes: Array
    mass_slopes: Array
    stiffness: Array
    damping: Array
    _held: dict[tuple[int, int], Array] = field(default_factory=dict)

    def loads(self, joint: int, off: Array) -> tuple[Array, Array]:
        """(N,) mass and force of a joint, with the free parameters ``off`` their declared values."""
        mass, force = self.mass[:, joint], self.force[:, joint]
        if not off.any():
            return mass, force
        return mass + self.mass_slopes[:, joint] @ off, force + self.force_slopes[:, joint] @ off

    def held(self, joint: int, substeps: int) -> Array:
        """(N substeps, 4) signals that no parameter changes: stiffness, damping, position and speed."""
        if (joint, substeps) not in self._held:
            rows = (self.stiffness, self.damping, self.positions, self.velocities)
            self._held[joint, substeps] = np.column_stack([between(r[:, joint], substeps) for r in rows])
        return self._held[joint, substeps]

    @cached_property
    def felt(self) -> NDArray[np.bool_]:
        """(n, P) whether a free parameter changes a joint's mass or force."""
        return np.asarray((self.force_slopes != 0).any(axis=0) | (self.mass_slopes != 0).any(axis=0))


@dataclass(eq=False)
class RigidTerms:
    """The computed rigid-body terms of a system, evaluated along records.

    Attributes:
        parameters: free symbols in the computed terms.
    """

    system: System
    parameters: tuple[sympy.Symbol, ...]
    _kept: list[tuple[Array, MotionTerms]] = field(default_factory=list)

    @property
    def declared(self) -> Array:
        return np.array([float(self.system.values[s]) for s in self.parameters])

    def along(self, record: Record) -> MotionTerms:
        """The terms along a record's smoothed motion; terms of recent motions are kept."""
        for positions, along in self._kept:
            if positions is record.positions:
                return along
        made = self._along(record)
        self._kept = [*self._kept[1 - KEPT :], (record.positions, made)]
        return made

    def _along(self, record: Record) -> MotionTerms:
        system, n = self.system, self.system.degrees_of_freedom
        acceleration = central_difference(record.velocities, record.sample_time)
        x, v, a = (casadi.SX.sym(name, n) for name in "xva")
        p = casadi.SX.sym("p", len(self.parameters))
        names: dict[sympy.Symbol, Any] = {s: casadi.SX(float(value)) for s, value in system.values.items()}
        names |= {s: p[k] for k, s in enumerate(self.parameters)}
        names |= {s: x[i] for i, s in enumerate(system.positions)} | {s: v[i] for i, s in enumerate(system.velocities)}
        names |= {s: a[i] for i, s in enumerate(system.accelerations)}
        terms = to_casadi(Matrix([*_forces(system), *_masses(system)]), names)
        force, mass = casadi.densify(terms[:n]), casadi.densify(terms[n:])
        slopes = [casadi.densify(casadi.vec(casadi.jacobian(value, p))) for value in (force, mass)]
        own = [casadi.vertcat(*[casadi.jacobian(force[i], s[i]) for i in range(n)]) for s in (x, v)]
        outputs = [force, mass, *(casadi.densify(o) for o in own), *slopes]
        function = casadi.Function("along", [x, v, a, p], outputs)
        count, free = len(record.positions), len(self.parameters)
        at = np.repeat(self.declared[:, None], count, axis=1)
        raw = function.map(count)(record.positions.T, record.velocities.T, acceleration.T, at)
        plain = [np.ascontiguousarray(np.array(r).T) for r in raw]
        by_parameter = [np.ascontiguousarray(r.reshape(count, free, n).transpose(0, 2, 1)) for r in plain[4:]]
        return MotionTerms(
            record.positions,
            record.velocities,
            plain[0],
            plain[1],
            by_parameter[0],
            by_parameter[1],
            plain[2],
            plain[3],
        )


def _forces(system: System) -> list[sympy.Expr]:
    """The computed force on each joint less the inertia coupling of the other joints' accelerations."""
    n, mass = system.degrees_of_freedom, system.mass_matrix
    taken = [
        sympy.Add(*[mass[i, j] * a for j, a in enumerate(system.accelerations) if j != i and mass[i, j] != 0])
        for i in range(n)
    ]
    return [_computed(system.force[i]) - taken[i] for i in range(n)]


def _masses(system: System) -> list[sympy.Expr]:
    return [_computed(system.mass_matrix[i, i]) for i in range(system.degrees_of_freedom)]


def rigid_terms(system: System, moved: Sequence[sympy.Symbol]) -> RigidTerms:
    """The rigid-body terms of a separable system, with those of ``moved`` on which they depend."""
    own = Matrix([*_forces(system), *_masses(system)])
    return RigidTerms(system, tuple(s for s in moved if own.has(s)))


def columns_of(
    joint: Joint, system: System, drive: Array, along: MotionTerms, off: Array, substeps: int, width: int
) -> Array:
    """(N substeps, width) inputs of a joint: its actuators, then the imposed signals at the middle of each step.

    Args:
        drive: (N substeps, inputs of the arm), effective.
        width: the columns behind those of this joint are zero.
    """
    columns = np.zeros((len(drive), width))
    first = len(joint.inputs)
    columns[:, :first] = drive[:, [system.inputs.index(w) for w in joint.inputs]]
    mass, force = along.loads(joint.index, off)
    columns[:, first] = between(mass, substeps)
    columns[:, first + 1] = between(force, substeps)
    columns[:, first + 2 : first + len(SIGNALS)] = along.held(joint.index, substeps)
    motion: Mapping[sympy.Symbol, Array] = dict(zip(system.positions, along.positions.T, strict=True)) | dict(
        zip(system.velocities, along.velocities.T, strict=True)
    )
    for k, s in enumerate(joint.others):
        columns[:, first + len(SIGNALS) + k] = between(motion[s], substeps)
    return columns


def between(values: Array, substeps: int) -> Array:
    """(N substeps,) values (N,) interpolated linearly to the middle of each substep, constant after the last sample."""
    share = (np.arange(substeps) + 0.5) / substeps
    rise = np.diff(values, append=values[-1:])
    return np.asarray((values[:, None] + rise[:, None] * share).ravel())


REMEMBERED = 120_000_000
"""Bytes of runs that are kept in memory: most changes in a fit need a new run of one joint only."""


@dataclass(eq=False)
class Memory:
    """Cache of results by their arguments; the oldest are dropped first."""

    size: int = 0
    _found: OrderedDict[Hashable, Array] = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    def get(self, key: Hashable) -> Array | None:
        with self._lock:
            if key in self._found:
                self._found.move_to_end(key)
                return self._found[key]
        return None

    def put(self, key: Hashable, value: Array) -> None:
        with self._lock:
            if key not in self._found:
                self.size += value.nbytes
            self._found[key] = value
            while self.size > REMEMBERED and len(self._found) > 1:
                self.size -= self._found.popitem(last=False)[1].nbytes


@dataclass(frozen=True, eq=False)
class _JointModel:
    """One joint of one model.

    Attributes:
        place: index of its code in the library. identity: of the equations from which that code was made.
        own: indices of its arguments among the model's.
    """

    joint: Joint
    place: int
    identity: Hashable
    own: tuple[int, ...]


class JointShooter:
    """Compiled free runs, joint by joint, of several systems that differ in their effects."""

    def __init__(
        self,
        systems: Sequence[System],
        free: Sequence[Sequence[sympy.Symbol]],
        terms: RigidTerms,
        memory: Memory,
        loads: int = 0,
    ) -> None:
        """Compile; joints with the same equations share their code.

        Args:
            terms: of the system without effects.
            loads: most loads behind springs in any run.
        """
        self.terms, self.memory = terms, memory
        self.inputs, self.contacts = len(systems[0].inputs), len(systems[0].contacts)
        self.coordinates = systems[0].degrees_of_freedom
        places: dict[Hashable, int] = {}
        joints: list[Joint] = []
        arguments: list[tuple[sympy.Symbol, ...]] = []
        self._models: list[list[_JointModel]] = []
        self._rigid: list[tuple[int, ...]] = []
        for system, symbols in zip(systems, free, strict=True):
            model = []
            for i in range(self.coordinates):
                joint = joint_of(system, i)
                used = _symbols(joint.system)
                own = tuple(k for k, s in enumerate(symbols) if s in used)
                arguments_here = tuple(symbols[k] for k in own)
                identity = (i, terms_of(joint.system), arguments_here)
                if identity not in places:
                    places[identity] = len(joints)
                    joints.append(joint)
                    arguments.append(arguments_here)
                model.append(_JointModel(joint, places[identity], identity, own))
            self._models.append(model)
            self._rigid.append(tuple(list(symbols).index(s) for s in terms.parameters))
        self._owners = [owners(system) for system in systems]
        self.loads, self._states = loads, max(len(own) for own in self._owners)
        self._shooter = Shooter([j.system for j in joints], arguments, loads, [len(j.inputs) for j in joints])

    def run(
        self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int, states: Array
    ) -> Array:
        """Positions (S, L, n) of every segment, as by ``Shooter.run``; as measured for joints that are not compared."""
        n, along = self.coordinates, self.terms.along(record)
        p = np.asarray(p, dtype=float)
        off = p[list(self._rigid[model])] - self.terms.declared
        out = np.asarray(record.measured[record.start[:, None] + np.arange(record.length)])
        for one in self._models[model]:
            i = one.joint.index
            if record.joints is not None and i not in record.joints:
                continue
            here, there = self._structure_of(model, structure, one.joint), np.ascontiguousarray(states[:, [i, n + i]])
            values = p[list(one.own)]
            felt = off[along.felt[i]].tobytes()
            inputs = self._inputs_key(one.joint, drive)
            where = (id(along), record.start.tobytes(), record.length, substeps)
            key = (one.identity, values.tobytes(), felt, _bytes(here), inputs, where, there.tobytes())
            found = self.memory.get(key)
            if found is None:
                alone = _record_of(record, i)
                columns = self._columns(one.joint, drive, along, off, substeps)
                found = self._shooter.run(one.place, values, here, alone, columns, substeps, there)[..., 0]
                self.memory.put(key, found)
            out[..., i] = found
        return out

    def hidden(self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int) -> Array:
        """(S, contacts + states + 2 loads) as by ``Shooter.hidden``."""
        along = self.terms.along(record)
        off = np.asarray(p, dtype=float)[list(self._rigid[model])] - self.terms.declared
        hidden = np.zeros((len(record.start), self.contacts + self._states + 2 * self.loads))
        loads = self.contacts + self._states
        for one in self._models[model]:
            columns = self._columns(one.joint, drive, along, off, substeps)
            here, alone = self._structure_of(model, structure, one.joint), _record_of(record, one.joint.index)
            found = self._shooter.hidden(one.place, p[list(one.own)], here, alone, columns, substeps)
            bristles, laws, *ends = np.split(
                found, np.cumsum([len(one.joint.contacts), self._shooter.states, self.loads]), axis=1
            )
            hidden[:, list(one.joint.contacts)] = bristles
            own = self._own_states(model, one.joint)
            hidden[:, [self.contacts + k for k in own]] = laws[:, : len(own)]
            for local, k in enumerate(_own_loads(structure, one.joint)):
                hidden[:, loads + k], hidden[:, loads + self.loads + k] = (end[:, local] for end in ends)
        return hidden

    def _own_states(self, model: int, joint: Joint) -> list[int]:
        return [k for k, contact in enumerate(self._owners[model]) if contact in joint.contacts]

    def _structure_of(self, model: int, structure: Structure, joint: Joint) -> Structure:
        """The part of a structure that belongs to one joint."""
        sigma = tuple(structure.sigma[c] for c in joint.contacts)
        loads, states = _own_loads(structure, joint), self._own_states(model, joint)
        return Structure(
            sigma, (0,) * len(loads), structure.coupling[loads], structure.limits[:, states], structure.rest[states]
        )

    def _inputs_key(self, joint: Joint, drive: Array) -> int:
        at = [self.terms.system.inputs.index(w) for w in joint.inputs]
        return hash(drive[:, at].tobytes())

    def _columns(self, joint: Joint, drive: Array, along: MotionTerms, off: Array, substeps: int) -> Array:
        return columns_of(joint, self.terms.system, drive, along, off, substeps, self._shooter.inputs)


def _bytes(structure: Structure) -> Hashable:
    arrays = (structure.coupling, structure.limits, structure.rest)
    return (structure.sigma, structure.split, *(array.tobytes() for array in arrays))


def _own_loads(structure: Structure, joint: Joint) -> list[int]:
    return [k for k, i in enumerate(structure.split) if i == joint.index]


def _symbols(system: System) -> set[sympy.Basic]:
    mass, force, distribution, *others = terms_of(system)
    entries = [*mass, *force, *distribution, *(sympy.sympify(e) for other in others for e in other)]
    return set().union(*(e.free_symbols for e in entries))


def _record_of(record: Record, i: int) -> Record:
    """The record of one coordinate."""
    return Record(
        record.measured[:, [i]],
        record.positions[:, [i]],
        record.velocities[:, [i]],
        record.commands,
        record.sample_time,
        record.time0,
        record.noise[[i]],
        record.start,
        record.length,
    )
