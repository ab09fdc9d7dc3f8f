"""Free-run simulation over short segments of a log in compiled C (multiple shooting), with parameters as arguments."""

from __future__ import annotations

import ctypes
from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise, zip_longest
from threading import Lock
from typing import Any, Protocol

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.compiler import loaded
from codegen.base.parallel import in_background
from codegen.base.text import render
from codegen.diagnosis.fit.record import Indices, Record
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.solve import factorised
from codegen.mechanics.system import TIME, ContactFriction, System
from codegen.simulate.contact import REST, SWEEPS
from codegen.simulate.dynamic_contact import INSIDE, LawTerms, has_states, state_terms, values_at
from codegen.simulate.plant import levels_at, smooth_forces
from codegen.spec.functions import Sgn

FAR = 1e300
"""Limit of a state without limits."""


def law_terms(contact: ContactFriction) -> LawTerms | None:
    """The terms of a contact's law; None without states, or for Dahl's form."""
    if not has_states(contact) or contact.law.bristle_stiffness(contact.law_parameters) != 0:
        return None
    return state_terms(contact)


def all_law_terms(system: System) -> list[tuple[int, LawTerms]]:
    """(contact, terms) of all contacts with terms."""
    found = ((c, law_terms(contact)) for c, contact in enumerate(system.contacts))
    return [(c, terms) for c, terms in found if terms is not None]


def owners(system: System) -> list[int]:
    """The contact of each state, in order."""
    return [c for c, terms in all_law_terms(system) for _ in terms.states]


def law_function(name: str, system: System, free: Sequence[sympy.Symbol], states: int) -> Any:
    """CasADi function (slip, y, p) → (force, ∂force/∂u, ∂force/∂y, rates, ∂rates/∂u, ∂rates/∂y), all dense.

    The first two have one entry a contact, the others one for each of ``states`` y, also those this system lacks.
    """
    count = len(system.contacts)
    slip, y, p = casadi.SX.sym("slip", count), casadi.SX.sym("y", states), casadi.SX.sym("p", len(free))
    numbers = symbol_values(system.values, (free, p))
    force, push, rate = casadi.SX(count, 1), casadi.SX(states, 1), casadi.SX(states, 1)
    fixed = {s: v for s, v in system.values.items() if s not in free}
    k = 0
    for c, terms in all_law_terms(system):
        force[c], *rates = values_at(terms, system.contacts[c], slip[c], y[k : k + len(terms.states)], numbers, fixed)
        for one in rates:
            rate[k], push[k] = one, force[c]
            k += 1
    by_slip = casadi.vertcat(*[casadi.jacobian(force[c], slip[c]) for c in range(count)])
    by_state = casadi.vertcat(*[casadi.jacobian(push[i], y[i]) for i in range(states)])
    driven = casadi.vertcat(*[casadi.sum2(casadi.jacobian(rate[i], slip)) for i in range(states)])
    decay = casadi.vertcat(*[casadi.jacobian(rate[i], y[i]) for i in range(states)])
    outputs = [force, by_slip, by_state, rate, driven, decay]
    return casadi.Function(name, [slip, y, p], [casadi.densify(o) for o in outputs], {"cse": True})


def hidden_states(system: System) -> int:
    """Number of states of a free run besides positions and velocities."""
    return 2 * len(system.transmissions) + sum(len(contact.law.states) for contact in system.contacts)


class Structures:
    """Bristle stiffnesses, states of friction laws, and loads behind springs, as functions of the values of symbols."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        laws = [terms for _, terms in all_law_terms(system)]
        limits = [limit for terms in laws for limit in terms.limits]
        rest = [value for terms in laws for value in terms.rest]
        low = [-FAR if low is None else INSIDE * low for low, _ in limits]
        high = [FAR if high is None else INSIDE * high for _, high in limits]
        stiffness = [c.law.bristle_stiffness(c.law_parameters) for c in system.contacts]
        loads = [(t.load_fraction, t.stiffness, t.damping, t.gap, t.limit) for t in system.transmissions]
        self._split = tuple(t.coordinate for t in system.transmissions)
        ends = np.cumsum([0, len(stiffness), len(rest), len(rest), len(rest), 5 * len(loads)])
        self._parts = [slice(start, stop) for start, stop in pairwise(ends)]
        expressions = [*stiffness, *rest, *low, *high, *(e for load in loads for e in load)]
        self._numbers = numpy_function(expressions, symbols, system.values)

    def at(self, numbers: Array) -> Structure:
        values = np.array([float(v) for v in self._numbers(*numbers)])
        sigma, rest, low, high, coupling = (values[part] for part in self._parts)
        return Structure(tuple(sigma), self._split, coupling.reshape(-1, 5), np.stack([low, high]), rest)


FLAGS = ("-fno-math-errno", "-fno-trapping-math")
PLAIN, UNROLLED = ("-O1",), ("-O3", "-fno-tree-vectorize")
"""Compiler flags: for one coordinate with one contact or a few runs, and for many runs of more, whose loops are worth
unrolling. The results are bit-identical at every level; with gcc 12, -O2 takes up to twice the time a step."""
FEW = 3
"""Number of models up to which loops are unrolled even for one coordinate with one contact: up to a third less time a
step, for at most 0.1 s of the compiler."""
LANES = 4
"""Runs that the compiled loops advance in turn, so that the processor does not wait for the last step of one."""
MOST_APART = 40
"""Most models of one coordinate with one contact in a library that has the loops over time for each model apart, with
its equations within them: up to four times as fast without sines, for a tenth of a second of the compiler a model."""
_REST = 1e-12
"""Slip speed that counts as standstill where no level jumps there, in slip unit/s."""
WARM_S = 1.0
FOLLOWED = 12
"""Cached results of ``Shooter.hidden``: those of a fit's values and of the steps of some of these, in two threads."""
OBSERVER = 4.0
"""Double pole of the observer of start states, over the inverse length of a segment: a wrong force then moves the
observed state less than the segment's own free run. Faster ones come nearer to the measured motion, with its noise."""


@dataclass(frozen=True)
class Structure:
    """Numeric structure of a model besides M, g and U λ.

    Attributes:
        sigma: one a contact; above 0 the stiffness of Dahl's law in place of the set-valued law.
        split: coordinates that share their inertia with a load. coupling: (loads, 5) its share, stiffness, damping,
            gap, limit.
        limits: (2, states) of the states of other laws. rest: (states,) without load.
    """

    sigma: tuple[float, ...]
    split: tuple[int, ...]
    coupling: Array
    limits: Array
    rest: Array

    @property
    def has_states(self) -> bool:
        """Whether a free run has states besides positions and velocities."""
        return bool(self.split or len(self.rest) or max(self.sigma, default=0.0) > 0)

    @property
    def key(self) -> Hashable:
        """The numbers that act on bristles and on states of laws."""
        return self.sigma, self.limits.tobytes(), self.rest.tobytes()


@dataclass(frozen=True, eq=False)
class Values:
    """Values of a compiled model: p of its free symbols, its structure, and (N substeps, m) effective inputs."""

    p: Array
    structure: Structure
    drive: Array


class FreeRun(Protocol):
    """Positions of free runs from start states and, where given, corrections of the start states of loads."""

    def __call__(self, states: Array, loads: Array | None = None, /) -> Array: ...


class Shooter:
    """Compiled free-run simulations of several systems."""

    def __init__(
        self,
        systems: Sequence[System],
        free: Sequence[Sequence[sympy.Symbol]],
        loads: int | None = None,
        driven: Sequence[int] | None = None,
        seldom: bool = False,
        jumps: bool | None = None,
        at_once: bool = True,
    ) -> None:
        """Compile the systems into one library, in a thread: the first run waits for it.

        Args:
            free: for each system the symbols that are arguments, in order.
            driven: how many of each system's inputs belong to actuators; the others are imposed signals.
            seldom: whether only a few runs follow, which take less time than unrolling the loops.
            at_once: False compiles at the first run.
        """
        self.inputs, self.contacts = max(len(s.inputs) for s in systems), len(systems[0].contacts)
        self.coordinates = systems[0].degrees_of_freedom
        self.loads = max(len(s.transmissions) for s in systems) if loads is None else loads
        self.states = max(len(owners(s)) for s in systems)
        self._equations, self._acting = list(zip(systems, free, strict=True)), dict[int, list[int] | None]()
        inputs = driven or [len(s.inputs) for s in systems]
        jumps = any(map(level_jumps, systems)) if jumps is None else jumps
        source = shooting_source(systems, free, self.loads, self.states, inputs, jumps)
        plain = seldom or (is_plain(systems[0]) and len(systems) > FEW)
        flags = PLAIN if plain else UNROLLED
        self._compiled = in_background(_library, source, flags) if at_once else cache(partial(_library, source, flags))

    def runs(
        self, model: int, values: Sequence[Values], record: Record, substeps: int, observed: bool = False
    ) -> list[FreeRun]:
        """For each of the values, the free run of every segment from start states (S, 2n): positions (S, L, n).

        A second argument of a run, (S, 2 loads), is added to the positions and velocities of the loads at the start.

        Args:
            observed: whether the start states of a model with loads are those of an observer of the smoothed positions,
                to which ``states`` less those of the record are added. Its motor, unlike the filtered one, has impacts.

        Raises:
            BadInput: where there is no C compiler.
        """
        if observed and values[0].structure.split:
            gain = OBSERVER / (record.length * record.sample_time)
            hidden, found = self._followed(model, values, record, substeps, gain)
            shifts = found - record.states
        else:
            hidden, shifts = self.hidden(model, values, record, substeps), np.zeros(len(values))
        starts = zip(values, hidden, shifts, strict=True)
        return [self._run(model, one, record, substeps, *start) for one, *start in starts]

    def _run(self, model: int, values: Values, record: Record, substeps: int, hidden: Array, shift: Array) -> FreeRun:
        """The free run of a model from these hidden states, and start states less ``shift``."""
        arrays, split = self._plant(values)

        def run(states: Array, loads: Array | None = None) -> Array:
            out = np.empty((len(record.start), record.length, self.coordinates))
            states, begun = np.ascontiguousarray(states + shift), hidden
            if loads is not None:
                begun = hidden.copy()
                begun[:, -2 * self.loads :] += loads
            self._compiled().shoot(
                model, len(values.structure.split), *map(_address, arrays[:2]), _address(split, _INDEX),
                *map(_address, arrays[2:]), len(record.start), _address(record.start, _INDEX), record.length,
                substeps, record.sample_time, _address(values.drive), _address(states), _address(begun), _address(out),
            )  # fmt: skip
            return out

        return run

    def hidden(self, model: int, values: Sequence[Values], record: Record, substeps: int) -> Array:
        """States at the start of each segment, simulated along the measured motion for each of R values of a model.

        Those without loads are kept for all values that do not act on them: for a slope, a fit changes one value.

        Returns:
            (R, S, contacts + states + 2 loads) states that are not logged: bristle deflections, states of laws,
            positions of the loads, their velocities.
        """
        if model not in self._acting:
            self._acting[model] = arguments_of_states(*self._equations[model])
        acting = self._acting[model]
        if acting is None:
            return self._followed(model, values, record, substeps)[0]
        same = id(self), model, id(record), substeps
        keys = [(*same, one.structure.key, np.asarray(one.p, dtype=float)[acting].tobytes()) for one in values]
        with _lock:
            known = {key: _kept[key] for key in keys if key in _kept}
        missing = {key: one for key, one in zip(keys, values, strict=True) if key not in known}
        if missing:
            found = self._followed(model, list(missing.values()), record, substeps)[0]
            known |= {key: (self, record, one) for key, one in zip(missing, found, strict=True)}
        with _lock:
            for key, one in known.items():
                _kept[key] = one
                _kept.move_to_end(key)
            while len(_kept) > FOLLOWED:
                _kept.popitem(last=False)
        return np.stack([known[key][2] for key in keys])

    def _followed(
        self, model: int, values: Sequence[Values], record: Record, substeps: int, gain: float = 0.0
    ) -> tuple[Array, Array]:
        """The states of ``hidden``, and (R, S, 2n) observed positions and velocities; ``LANES`` are simulated at once.

        Args:
            gain: above 0, positions and velocities are those of an observer with a double pole at −``gain`` 1/s, if the
                model has loads.
        """
        states = np.zeros((len(values), len(record.start), 2 * self.coordinates))
        hidden = np.zeros((len(values), len(record.start), self.contacts + self.states + 2 * self.loads))
        if any(one.structure.has_states for one in values):
            x, v = np.ascontiguousarray(record.positions), np.ascontiguousarray(record.velocities)
            begun = _begun(record, values[0].structure)
            for k in range(0, len(values), LANES):
                some = slice(k, k + LANES)
                plants, drives = [self._plant(one) for one in values[some]], [one.drive for one in values[some]]
                arrays = [_addresses(column) for column in zip(*(own for own, _ in plants), strict=True)]
                split, pointers = plants[0][1], _addresses(drives)
                self._compiled().follow(
                    model, len(values[0].structure.split), len(drives), *map(_pointer, arrays[:2]),
                    _address(split, _INDEX), *map(_pointer, arrays[2:]), substeps, record.sample_time, _address(x),
                    _address(v), _pointer(pointers), len(record.start), _address(record.start, _INDEX),
                    _address(begun, _INDEX), gain, _address(states[some]), _address(hidden[some]),
                )  # fmt: skip
        return hidden, states

    def _plant(self, values: Values) -> tuple[tuple[Array, Array, Array, Array], Indices]:
        """Arguments of the C functions: p, sigma, couplings of loads, states of laws; coordinates with a load."""
        structure = values.structure
        idle = np.zeros(self.states - len(structure.rest))
        states = np.concatenate([structure.rest, idle, structure.limits[0], idle, structure.limits[1], idle, [0.0]])
        p, sigma = np.append(np.asarray(values.p, dtype=float), 0.0), np.array([*structure.sigma, 0.0])
        return (p, sigma, np.append(structure.coupling.ravel(), 0.0), states), np.array([*structure.split, 0], np.int32)


def _begun(record: Record, structure: Structure) -> Indices:
    """(S,) sample from which states are simulated anew to each start; −1: on from the start before.

    Those of a model with loads begin anew after each gap of the log, and for few segments a short time before each.
    """
    begun = np.full(len(record.start), -1, dtype=np.int32)
    if structure.split:
        resumed = np.array([0, *record.resumed], dtype=np.int32)
        last = resumed[np.searchsorted(resumed, record.start, "right") - 1]
        begun = np.where(np.diff(last, prepend=-1) > 0, last, begun)
        warm = max(record.length, round(WARM_S / record.sample_time))
        if len(record.start) * warm < len(record.positions):
            begun = np.maximum(record.start - warm, last)
    begun[:1] = np.maximum(begun[:1], 0)
    return begun


_kept: OrderedDict[Hashable, tuple[Shooter, Record, Array]] = OrderedDict()
"""Results of ``Shooter.hidden``, with the objects whose identity is in their key."""
_lock = Lock()


_REAL, _INDEX = np.dtype(np.float64), np.dtype(np.int32)


def _addresses(arrays: Sequence[Array]) -> NDArray[np.uintp]:
    """The addresses of arrays, which must live until a C function that is given them returns."""
    return np.array([_address(one) for one in arrays], dtype=np.uintp)


def _pointer(addresses: NDArray[np.uintp]) -> int:
    """The address of an array of addresses."""
    return _address(addresses, addresses.dtype)


def _address(array: NDArray[Any], kind: np.dtype[Any] = _REAL) -> int:
    """Address of a contiguous array of this type. ``ndpointer`` takes a tenth of the time of a short free run."""
    if array.dtype != kind or not array.flags.c_contiguous:
        raise TypeError(f"an array of {array.dtype}; expected a contiguous one of {kind}")
    return int(array.__array_interface__["data"][0])


def _library(source: str, level: tuple[str, ...]) -> ctypes.CDLL:
    """The compiled and loaded library, with the types of its functions."""
    library = loaded(source, (*level, *FLAGS))
    library.follow.restype = library.shoot.restype = None
    whole, real = ctypes.c_int, ctypes.c_double
    array = ctypes.c_void_p
    plant: list[Any] = [array] * 5
    library.follow.argtypes = [
        whole, whole, whole, *plant, whole, real, array, array, array, whole, array, array, real, array, array,
    ]  # fmt: skip
    library.shoot.argtypes = [whole, whole, *plant, whole, array, whole, whole, real, array, array, array, array]
    return library


def shooting_source(
    systems: Sequence[System],
    free: Sequence[Sequence[sympy.Symbol]],
    loads: int,
    states: int,
    driven: Sequence[int],
    jumps: bool,
) -> str:
    """The C source of all systems' equations and the loops over segments."""
    generator = casadi.CodeGenerator("models", {"with_header": False, "main": False})
    kept = 0
    for k, (system, symbols) in enumerate(zip(systems, free, strict=True)):
        place, model, resting = terms_functions(str(k), system, symbols, loads > 0, jumps)
        for function in (place, model, *([resting] if loads else [])):
            generator.add(function)
        kept = max(kept, model.size1_in(6))
        if states:
            generator.add(law_function(f"laws_{k}", system, symbols, states))
    one, owned = systems[0], [owners(system) for system in systems]
    bristles = [has_bristles(system) for system in systems]
    shared = not is_plain(one) or len(systems) > MOST_APART
    if shared:
        runs = [{"index": 0, "shared": True, "bristles": any(bristles), "states": states}]
    else:
        runs = [
            {"index": k, "shared": False, "bristles": bristles[k], "states": len(own)} for k, own in enumerate(owned)
        ]
    return render(
        "diagnosis/shooting.c.j2",
        coordinates=one.degrees_of_freedom,
        inputs=max(len(s.inputs) for s in systems),
        contacts=len(one.contacts),
        sweeps=SWEEPS,
        lanes=LANES,
        rest=REST if jumps else _REST,
        jumps=jumps,
        models=generator.dump(),
        runs=runs,
        shared=shared,
        names=range(len(systems)),
        driven=driven,
        owners=owned,
        kept=kept,
        loads=loads,
        states=states,
    )


def terms_of(system: System) -> tuple[sympy.Expr, ...]:
    """The compiled expressions of a system; systems with equal ones share code."""
    contacts = [term for c in system.contacts for term in (_set_valued_level(c), c.extra_force)]
    laws = [term for c, terms in all_law_terms(system) for term in (sympy.Integer(c), terms.force, *terms.rates)]
    forces = *system.force, *system.declared_force
    return (*system.mass_matrix, *forces, *system.distribution, *contacts, *laws)


def arguments_of_states(system: System, free: Sequence[sympy.Symbol]) -> list[int] | None:
    """Indices of the arguments that act on bristles and states of laws along a given motion.

    Inertia and smooth forces do not: the motion is given. None if there are no such states, or if loads or inputs act.
    """
    laws = (term for _, terms in all_law_terms(system) for term in (terms.force, *terms.rates))
    terms = *system.distribution, *(_set_valued_level(c) for c in system.contacts), *laws
    acting = set().union(*(sympy.sympify(term).free_symbols for term in terms))
    if not hidden_states(system) or system.transmissions or not acting.isdisjoint(system.inputs):
        return None
    return [k for k, s in enumerate(free) if s in acting]


def is_plain(system: System) -> bool:
    """Whether a system has one coordinate with one contact."""
    return system.degrees_of_freedom == 1 and len(system.contacts) <= 1


def has_bristles(system: System) -> bool:
    """Whether a contact has Dahl's law, which the compiled terms do not show."""
    return any(c.law.bristle_stiffness(c.law_parameters) != 0 for c in system.contacts)


def level_jumps(system: System) -> bool:
    """Whether a friction level jumps at standstill."""
    return any(_set_valued_level(contact).has(Sgn) for contact in system.contacts)


def term_symbols(changed: System, system: System) -> set[sympy.Symbol]:
    """Symbols in the compiled expressions of a changed system that differ from the original system's."""
    pairs = zip_longest(terms_of(changed), terms_of(system), fillvalue=sympy.S.Zero)
    return {s for term, own in pairs if term != own for s in term.free_symbols}


def _set_valued_level(contact: ContactFriction) -> sympy.Expr:
    """The level of the set-valued law; for a law with states only the part that effects add to its force."""
    return contact.extra_level if law_terms(contact) is not None else contact.plant_level


def terms_functions(
    name: str, system: System, free: Sequence[sympy.Symbol], loads: bool, jumps: bool
) -> tuple[Any, Any, Any]:
    """Three CasADi functions of a system, all results dense; M is factorised once a step.

        place_NAME (x, w, t, p, share) → (U, M⁻¹U, U'M⁻¹U, inertia of the loads, kept), M less that inertia
        model_NAME (x, v, w, t, p, share, kept, push, bristle) → (M⁻¹(g + push − U (smooth friction + bristle)),
            levels forward and backward, and at rest where they may jump)
        resting_NAME (x, w, t, p) → declared g at v = 0, without the forces of effects

    ``kept`` does not depend on v. Without ``loads``, ``share`` and ``push`` have no effect.
    """
    n = system.degrees_of_freedom
    x, v, w = casadi.SX.sym("x", n), casadi.SX.sym("v", n), casadi.SX.sym("w", len(system.inputs))
    t, p = casadi.SX.sym("t"), casadi.SX.sym("p", len(free))
    share, push = casadi.SX.sym("share", n), casadi.SX.sym("push", n)
    bristle = casadi.SX.sym("bristle", len(system.contacts))
    columns = (system.positions, x), (system.velocities, v), (system.inputs, w), (free, p)
    names = symbol_values(system.values, *columns) | {TIME: t}
    mass, distribution = (to_casadi(m, names) for m in (system.mass_matrix, system.distribution))
    heavy = casadi.diag(mass) * share if loads else casadi.SX.zeros(n)
    factors = factorised(mass - casadi.diag(heavy) if loads else mass, reciprocals=False)
    carried = factors.solve_columns(distribution)
    slip = casadi.mtimes(distribution.T, v)
    levels = levels_at(system.contacts, [_set_valued_level(c) for c in system.contacts], slip, names)
    smooth = smooth_forces(system.contacts, slip, names)
    force = to_casadi(system.force, names, by_angle=True)
    net = force + push if loads else force
    for c in range(len(system.contacts)):
        net = net - distribution[:, c] * (smooth[c] + bristle[c])
    outputs = [factors.solve(net), *(levels if jumps else levels[:2])]
    still = casadi.vertcat(x, w, t, p, share)
    moving, pieces, values = casadi.extract_parametric([casadi.densify(o) for o in outputs], still, {})
    kept = casadi.vertcat(*pieces) if pieces else casadi.SX.sym("kept", 0)
    before = casadi.vertcat(*values) if values else casadi.SX(0, 1)
    found = [distribution, carried, casadi.mtimes(distribution.T, carried), heavy, before]
    place = casadi.Function(f"place_{name}", [x, w, t, p, share], [casadi.densify(f) for f in found], {"cse": True})
    model = casadi.Function(f"model_{name}", [x, v, w, t, p, share, kept, push, bristle], moving)
    rest = to_casadi(system.declared_force, names | dict.fromkeys(system.velocities, casadi.SX(0)), by_angle=True)
    return place, model, casadi.Function(f"resting_{name}", [x, w, t, p], [casadi.densify(rest)])
