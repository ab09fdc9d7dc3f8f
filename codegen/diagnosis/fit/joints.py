"""Free-run simulation of an arm joint by joint, with the measured motion of all other joints imposed.

    M_ii x_i'' = f_i(t) + k_i(t) (x_i − x̂_i) + d_i(t) (v_i − v̂_i) + e_i

with x̂ and v̂ the measured motion. e_i, the inputs, effects and friction of joint i, is computed without approximation.
f_i is the rigid-body force less Σ_j M_ij x̂_j'' (j ≠ i) on the measured motion, and k_i and d_i are its derivatives with
respect to the joint's own position and speed there. M_ii does not depend on x_i in a tree of joints. The other joints
follow the measured motion, so a force that the model lacks moves its own joint only.
"""

from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.identity_cache import identity_cache
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.shooting import FreeRun, Shooter, Structure, Values, has_bristles, owners, terms_of
from codegen.diagnosis.fit.signals import central_difference
from codegen.mechanics.casadi_form import over_rows, symbol_values, to_casadi
from codegen.mechanics.computed import ComputedEntry, by_computed
from codegen.mechanics.system import Matrix, System

_NAMES = ("mass", "force", "stiffness", "damping", "position", "speed")
SIGNALS = tuple(sympy.Symbol(f"imposed_{name}", real=True) for name in _NAMES)
MASS, FORCE, STIFFNESS, DAMPING, POSITION, SPEED = SIGNALS
LOADS = 2
"""The first two of ``SIGNALS``, mass and force, depend on parameters of the links; the others do not."""
KEPT = 4
"""Records whose terms are kept in memory."""
DRIVES = 16
"""Results of ``JointShooter._driven`` that are kept in memory."""
REMEMBERED = 80_000_000
"""Bytes of runs that are kept in memory: most steps of a fit change one joint, and reuse the runs of the others."""


def is_separable(system: System) -> bool:
    """Whether joints can be simulated one at a time: computed rigid-body terms, and equally many contacts per joint."""
    n = system.degrees_of_freedom
    touched = [[i for i in range(n) if system.distribution[i, c] != 0] for c in range(len(system.contacts))]
    counts = [touched.count([i]) for i in range(n)]
    alone = all(len(rows) == 1 for rows in touched) and len(set(counts)) == 1
    return n > 1 and alone and not system.sensor_errors and bool(system.mass_matrix.atoms(ComputedEntry))


@dataclass(frozen=True, eq=False)
class Joint:
    """One joint as a system with one coordinate.

    Attributes:
        inputs: inputs of the arm that act on this joint.
        others: positions and speeds of other joints that its effects use.
        system: with the inputs ``inputs``, SIGNALS and ``others``, in this order.
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
    force = by_computed(system.force[index])[1] + FORCE + STIFFNESS * (x - POSITION) + DAMPING * (v - SPEED)
    mass = by_computed(system.mass_matrix[index, index])[1] + MASS
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
            effect_forces={0: system.effect_forces.get(index, sympy.S.Zero)},
        ),
    )


@dataclass(frozen=True, eq=False)
class MotionTerms:
    """Rigid-body terms along one measured motion, (N, n) over samples and joints.

    Attributes:
        loads_declared: (n, N, 2) mass and force of each joint at the declared values.
        dependent: (n, P) whether a joint's mass or force depends on a free parameter.
        slopes: for each joint, (p, 2 N) derivatives of its mass and force, in turn for each sample, by the p
            parameters on which they depend.
        stiffness, damping: derivatives of the force with respect to the joint's own position and speed.
    """

    positions: Array
    velocities: Array
    loads_declared: Array
    dependent: NDArray[np.bool_]
    slopes: tuple[Array, ...]
    stiffness: Array
    damping: Array

    def loads(self, joint: int, off: Array) -> Array:
        """(N, 2) mass and force of a joint where the free parameters exceed their declared values by ``off``, (P,)."""
        declared: Array = self.loads_declared[joint]
        own = off[self.dependent[joint]]
        if not own.any():
            return declared
        moved, slopes = own != 0, self.slopes[joint]  # a single one where a derivative is computed
        own, slopes = (own, slopes) if moved.all() else (own[moved], slopes[moved])
        return np.asarray(declared + (own @ slopes).reshape(declared.shape))

    def without_parameters(self, joint: int) -> list[Array]:
        """Signals that do not depend on parameters: stiffness, damping, position and speed."""
        return [r[:, joint] for r in (self.stiffness, self.damping, self.positions, self.velocities)]


@dataclass(frozen=True, eq=False)
class RigidTerms:
    """The computed rigid-body terms of a system along records, and the free symbols in them."""

    system: System
    parameters: tuple[sympy.Symbol, ...]

    @cached_property
    def declared(self) -> Array:
        return np.array([float(self.system.values[s]) for s in self.parameters])

    @identity_cache(KEPT)
    def along(self, positions: Array, velocities: Array, sample_time: float) -> MotionTerms:
        """The terms along a smoothed motion, positions and velocities (N, n)."""
        system, n = self.system, self.system.degrees_of_freedom
        acceleration = central_difference(velocities, sample_time)
        x, v, a = (casadi.SX.sym(name, n) for name in "xva")
        p = casadi.SX.sym("p", len(self.parameters))
        columns = (system.positions, x), (system.velocities, v), (system.accelerations, a), (self.parameters, p)
        terms = to_casadi(_computed_terms(system), symbol_values(system.values, *columns))
        force, mass = casadi.densify(terms[:n]), casadi.densify(terms[n:])
        slopes = [casadi.densify(casadi.vec(casadi.jacobian(value, p))) for value in (mass, force)]
        own = [casadi.vertcat(*[casadi.jacobian(force[i], s[i]) for i in range(n)]) for s in (x, v)]
        values = casadi.Function(
            "values", [casadi.vertcat(x, v, a, p)], [casadi.densify(casadi.vertcat(mass, force, *own))]
        )
        changes = casadi.Function("changes", [casadi.vertcat(x, v, a, p)], [casadi.vertcat(*slopes)])
        count, free = len(positions), len(self.parameters)
        at = np.hstack([positions, velocities, acceleration, np.tile(self.declared, (count, 1))])
        plain = over_rows(values, at).reshape(count, 4, n)
        by_parameter = over_rows(changes, at).reshape(count, 2, free, n)
        dependent = (by_parameter != 0).any(axis=(0, 1)).T
        chosen = [
            by_parameter[:, :, own, i].transpose(2, 0, 1).reshape(-1, 2 * count) for i, own in enumerate(dependent)
        ]
        declared = np.ascontiguousarray(plain[:, :2].transpose(2, 0, 1))
        return MotionTerms(positions, velocities, declared, dependent, tuple(chosen), plain[:, 2], plain[:, 3])


def _computed_terms(system: System) -> Matrix:
    """(2n, 1) the computed force on each joint less the inertia coupling of the others' accelerations, and its mass."""
    mass = system.mass_matrix
    forces = []
    for i in range(system.degrees_of_freedom):
        taken = [mass[i, j] * a for j, a in enumerate(system.accelerations) if j != i and mass[i, j] != 0]
        forces.append(by_computed(system.force[i])[0] - sympy.Add(*taken))
    return Matrix([*forces, *(by_computed(mass[i, i])[0] for i in range(system.degrees_of_freedom))])


def rigid_terms(system: System, symbols: Sequence[sympy.Symbol]) -> RigidTerms:
    """The rigid-body terms of a separable system, with those of ``symbols`` on which they depend."""
    own = _computed_terms(system)
    return RigidTerms(system, tuple(s for s in symbols if own.has(s)))


def put_between(values: Array, substeps: int, target: Array) -> None:
    """Put values (N, k), interpolated linearly to the middle of each substep, into (N substeps, k).

    After the last sample they are constant.
    """
    for column, one in zip(values.T, target.T, strict=True):
        value, rise = np.ascontiguousarray(column), np.diff(column, append=column[-1:])
        for step in range(substeps):  # each for all samples at once; the compiled run itself takes little longer
            one[step::substeps] = value + rise * ((step + 0.5) / substeps)


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
class _Compiled:
    """One joint of one model, and where its compiled code, arguments and states are.

    Attributes:
        place: index of its code; joints with the same equations, by ``key``, share one.
        arguments: indices of its parameters among the model's arguments.
        states: indices of its states of friction laws among the model's.
    """

    joint: Joint
    place: int
    key: Hashable
    arguments: list[int]
    states: list[int]

    def structure(self, of: Structure) -> Structure:
        """The part of a model's structure that belongs to this joint."""
        sigma = tuple(of.sigma[c] for c in self.joint.contacts)
        loads = [k for k, i in enumerate(of.split) if i == self.joint.index]
        limits, rest = of.limits[:, self.states], of.rest[self.states]
        return Structure(sigma, (0,) * len(loads), of.coupling[loads], limits, rest)


class JointShooter:
    """Compiled free runs, joint by joint, of several systems that differ in their effects, as by ``Shooter``."""

    def __init__(
        self,
        systems: Sequence[System],
        free: Sequence[Sequence[sympy.Symbol]],
        terms: RigidTerms,
        memory: Memory,
        loads: int = 0,
        jumps: bool | None = None,
        at_once: bool = True,
    ) -> None:
        """Compile; joints with the same equations share their code. ``terms`` are of the system without effects."""
        self.terms, self.memory, self.loads = terms, memory, loads
        distinct: dict[Hashable, tuple[Joint, list[sympy.Symbol]]] = {}
        self._models: list[list[_Compiled]] = []
        self._rigid: list[list[int]] = []
        for system, symbols in zip(systems, free, strict=True):
            model = []
            for i in range(system.degrees_of_freedom):
                joint = joint_of(system, i)
                terms_here = terms_of(joint.system)
                used = set().union(*(term.free_symbols for term in terms_here))
                own = [k for k, s in enumerate(symbols) if s in used]
                arguments = [symbols[k] for k in own]
                key = (i, terms_here, has_bristles(joint.system), *arguments)
                distinct.setdefault(key, (joint, arguments))
                states = [k for k, contact in enumerate(owners(system)) if contact in joint.contacts]
                model.append(_Compiled(joint, list(distinct).index(key), key, own, states))
            self._models.append(model)
            self._rigid.append([list(symbols).index(s) for s in terms.parameters])
        joints, called = zip(*distinct.values(), strict=True)
        driven = [len(j.inputs) for j in joints]
        self._shooter = Shooter([j.system for j in joints], called, loads, driven, jumps=jumps, at_once=at_once)

    def run_of(self, model: int, values: Values, record: Record, substeps: int, measured: Record) -> FreeRun:
        """Positions (S, L, n) of every segment, as by ``Shooter.runs``; as measured for joints that are not compared.

        Args:
            record: its motion is followed by states that are not logged.
            measured: the record with the motion as measured, which is imposed on the other joints and about which the
                rigid-body force is linearised. If sensor errors are fitted, the motion of ``record`` depends on their
                parameters, and the terms along it would be computed for each value.
        """
        n, structure, drive = len(self._models[model]), values.structure, values.drive
        along = self.terms.along(measured.positions, measured.velocities, measured.sample_time)
        p = np.asarray(values.p, dtype=float)
        off = p[self._rigid[model]] - self.terms.declared

        def run(states: Array, loads: Array | None = None) -> Array:
            assert loads is None  # for arms, start states of loads behind springs are not corrected
            out = np.asarray(record.measured[record.start[:, None] + np.arange(record.length)])
            for one in self._models[model]:
                i = one.joint.index
                if record.joints is not None and i not in record.joints:
                    continue
                here, there = one.structure(structure), np.ascontiguousarray(states[:, [i, n + i]])
                own, dependent = p[one.arguments], off[along.dependent[i]]
                arrays = own, dependent, here.coupling, here.limits, here.rest, record.start, there
                where = (along, record.length, substeps, here.sigma, here.split, self._driven(drive, one.joint)[1])
                followed = () if record is measured else _content_of(record, i)
                key = (one.key, *where, *followed, *(array.tobytes() for array in arrays))
                found = self.memory.get(key)
                if found is None:
                    alone = _record_of(record, i)
                    columns = self._columns(one.joint, drive, along, off, substeps)
                    (free_run,) = self._shooter.runs(one.place, [Values(own, here, columns)], alone, substeps)
                    found = free_run(there)[..., 0]
                    self.memory.put(key, found)
                out[..., i] = found
            return out

        return run

    def depends_on(self, model: int, k: int, record: Record) -> bool:
        """Whether the free runs of the compared joints may depend on argument ``k`` of a model."""
        if k not in self._rigid[model]:
            return True
        along = self.terms.along(record.positions, record.velocities, record.sample_time)
        compared = [c for c in self._models[model] if record.joints is None or c.joint.index in record.joints]
        dependent = along.dependent[:, self._rigid[model].index(k)]
        return any(dependent[c.joint.index] or k in c.arguments for c in compared)

    def _columns(self, joint: Joint, drive: Array, along: MotionTerms, off: Array, substeps: int) -> Array:
        """(N substeps, m) inputs of a joint, effective, then the imposed signals at the middle of each step.

        Remembered, since most runs of a fit change neither inputs nor links.
        """
        i, (inputs, content) = joint.index, self._driven(drive, joint)
        place = along, i, substeps, joint.others, self._shooter.inputs, content
        key = "columns", *place, off[along.dependent[i]].tobytes()
        found = self.memory.get(key)
        if found is None:
            found = self._without_loads(joint, inputs, along, substeps, ("held", *place)).copy()
            start = inputs.shape[1]
            put_between(along.loads(i, off), substeps, found[:, start : start + LOADS])
            self.memory.put(key, found)
        return found

    @identity_cache(DRIVES)
    def _driven(self, drive: Array, joint: Joint) -> tuple[Array, int]:
        """(N substeps, inputs of the joint) its effective inputs, and a number for their content."""
        inputs = drive[:, [self.terms.system.inputs.index(w) for w in joint.inputs]]
        return inputs, hash(inputs.tobytes())

    def _without_loads(self, joint: Joint, inputs: Array, along: MotionTerms, substeps: int, key: Hashable) -> Array:
        """``_columns`` without the two of mass and force, the only ones that depend on a parameter.

        Remembered by themselves: a fifth of the time of the slopes by the 43 link parameters of a seven-joint arm.
        """
        found = self.memory.get(key)
        if found is None:
            system = self.terms.system
            motion = dict(zip(system.positions, along.positions.T, strict=True))
            motion |= dict(zip(system.velocities, along.velocities.T, strict=True))
            signals = np.column_stack([*along.without_parameters(joint.index), *(motion[s] for s in joint.others)])
            found, start = np.zeros((len(inputs), self._shooter.inputs)), inputs.shape[1]
            found[:, :start] = inputs
            put_between(signals, substeps, found[:, start + LOADS : start + LOADS + signals.shape[1]])
            self.memory.put(key, found)
        return found


@identity_cache(KEPT)
def _content_of(record: Record, i: int) -> tuple[int, ...]:
    """Numbers for the motion of one coordinate in a record."""
    return tuple(hash(values[:, i].tobytes()) for values in (record.positions, record.velocities))


@identity_cache(KEPT)
def _record_of(record: Record, i: int) -> Record:
    """The record of one coordinate."""
    return replace(
        record,
        measured=record.measured[:, [i]],
        positions=record.positions[:, [i]],
        velocities=record.velocities[:, [i]],
        noise=record.noise[[i]],
        joints=None,
        integrated=record.integrated[i : i + 1],
    )
