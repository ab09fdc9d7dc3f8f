"""Free-run simulation of an arm joint by joint, by the interface of ``Shooter``; the others' motion is imposed."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from threading import Lock

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.imposed import Joint, MotionTerms, RigidTerms, columns_of, joint_of
from codegen.diagnosis.law_states import owners
from codegen.diagnosis.shooting import Record, Shooter, Structure, terms_of
from codegen.mechanics.system import System

Array = NDArray[np.float64]

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
