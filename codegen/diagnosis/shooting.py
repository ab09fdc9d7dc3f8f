"""Free-run simulation over short segments of a log in compiled C (multiple shooting), with parameters as arguments."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import zip_longest
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.compiler import compile_shared, load_library
from codegen.base.text import render
from codegen.diagnosis.law_states import all_law_terms, law_function, law_terms, owners
from codegen.diagnosis.parallel import in_background
from codegen.mechanics.casadi_form import symbol_values, to_casadi
from codegen.mechanics.solve import factorised
from codegen.mechanics.system import TIME, ContactFriction, System
from codegen.simulate.contact import REST, SWEEPS
from codegen.simulate.plant_contacts import set_valued_level
from codegen.spec.functions import Sgn

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

FLAGS = ("-fno-math-errno", "-fno-trapping-math")
OF_ONE, OF_MANY = ("-O1",), ("-O3", "-fno-tree-vectorize")
"""Compiler flags for one coordinate with one contact, and for more, whose loops are worth unrolling. The results are
bit-identical at every level; with gcc 12, -O2 takes up to twice the time a step."""
KEPT_LIBRARIES = 32
KEPT = 40
"""Averages of the residual that are kept for each segment."""
_AT_REST = 1e-30
_REST = 1e-12
"""Slip speed that counts as standstill where no level jumps there, in slip unit/s."""
WARM_S = 1.0
STEPS_PER_PERIOD = 50
"""Time steps in a period of the coarse cutoff."""


@dataclass(frozen=True, eq=False)
class Record:
    """The data of a log that free-run simulation needs.

    Attributes:
        measured: (N, n) raw positions. positions, velocities: (N, n) smoothed, for start states.
        commands: (N, m), held from t_k to t_(k+1).
        sample_time: s. time0: of the first row since the log began, s.
        noise: (n,) standard deviation of the measured positions' noise.
        start: (S,) first samples of the segments. length: samples of each.
        joints: for an arm that is run joint by joint, the joints that are compared; each segment of each joint is then
            a row of its own, the joints of a segment in turn. None where the coordinates of a segment are compared
            together.
    """

    measured: Array
    positions: Array
    velocities: Array
    commands: Array
    sample_time: float
    time0: float
    noise: Array
    start: Indices
    length: int
    joints: tuple[int, ...] | None = None

    @cached_property
    def targets(self) -> Array:
        """(S, L, n) measured positions of each segment, or (S joints, L, 1)."""
        return self.by_row(np.asarray(self.measured[self.start[:, None] + np.arange(self.length)]))

    def by_row(self, positions: Array) -> Array:
        """Positions (S, L, n) in the rows that are compared."""
        if self.joints is None:
            return positions
        chosen = positions[..., list(self.joints)].transpose(0, 2, 1)
        return np.ascontiguousarray(chosen.reshape(-1, chosen.shape[2], 1))

    def of_segments(self, offsets: Array) -> Array:
        """Start-state offsets of the rows as (S, 2n)."""
        if self.joints is None:
            return offsets
        n, at = self.measured.shape[1], list(self.joints)
        rows = offsets.reshape(len(self.start), len(at), 2)
        states = np.zeros((len(self.start), 2 * n))
        states[:, at], states[:, [n + i for i in at]] = rows[..., 0], rows[..., 1]
        return states

    def of_starts(self, values: Array) -> Array:
        """(n,) values for the rows, (1, n) or (S joints, 1)."""
        return values[None] if self.joints is None else np.tile(values[list(self.joints)], len(self.start))[:, None]

    @cached_property
    def top_speed(self) -> Array:
        """(n,) 95 % speeds."""
        return np.asarray(np.quantile(np.abs(self.velocities), 0.95, axis=0))

    @property
    def group(self) -> int:
        """Samples whose mean error is one residual of a fit."""
        return max(1, self.length // KEPT)

    @cached_property
    def mean_targets(self) -> Array:
        """The targets as by ``means``."""
        return self.means(self.targets)

    def means(self, positions: Array) -> Array:
        """Means of positions (S, L, n) over groups of samples, (S, L // group, n)."""
        group, (rows, length, n) = self.group, positions.shape
        kept = length // group
        cut = positions[:, : kept * group]
        with np.errstate(over="ignore", invalid="ignore"):  # a run may diverge
            # A product of matrices takes a tenth of the time of numpy's mean over an axis inside, but spreads a NaN.
            found = cut.reshape(rows * kept, group * n) @ np.tile(np.eye(n) / group, (group, 1))
            if not np.isfinite(found).all():
                return np.asarray(cut.reshape(rows, kept, group, n).mean(axis=2))
        return np.asarray(found.reshape(rows, kept, n))

    @property
    def at_rest(self) -> Array:
        """Offsets of zero for all rows."""
        n = self.measured.shape[1]
        return np.zeros((len(self.start), 2 * n) if self.joints is None else (len(self.start) * len(self.joints), 2))

    @cached_property
    def states(self) -> Array:
        """(S, 2n) smoothed states at the starts."""
        return np.hstack([self.positions[self.start], self.velocities[self.start]])


@dataclass(frozen=True)
class Structure:
    """Numeric structure of a model besides M, g and U λ.

    Attributes:
        sigma: one a contact; above 0 the stiffness of Dahl's law in place of the set-valued law.
        split: the coordinates whose inertia is shared with a load.
        coupling: (loads, 4) load's share of the inertia, stiffness, damping and gap of the spring.
        limits: (2, states) lower and upper limits of the states of other laws. rest: (states,) without load.
    """

    sigma: tuple[float, ...]
    split: tuple[int, ...]
    coupling: Array
    limits: Array
    rest: Array


class Shooter:
    """Compiled free-run simulations of several systems.

    Attributes:
        free: for each system the symbols that are arguments, in order.
        loads: most loads of any run. states: most states of friction laws.
    """

    def __init__(
        self,
        systems: Sequence[System],
        free: Sequence[Sequence[sympy.Symbol]],
        loads: int | None = None,
        driven: Sequence[int] | None = None,
    ) -> None:
        """Compile the systems into one library, in a thread: the first run waits for it.

        Args:
            loads: most loads behind springs in any run; by default the most of ``systems``.
            driven: how many of each system's inputs belong to actuators; the others are imposed signals. By default
                all.
        """
        self.free = [tuple(symbols) for symbols in free]
        self.inputs, self.contacts = max(len(s.inputs) for s in systems), len(systems[0].contacts)
        self.coordinates = systems[0].degrees_of_freedom
        self.loads = max(len(s.transmissions) for s in systems) if loads is None else loads
        self.states = max(len(owners(s)) for s in systems)
        inputs = driven or [len(s.inputs) for s in systems]
        source = shooting_source(systems, self.free, self.loads, self.states, inputs)
        alone = self.coordinates == 1 and self.contacts <= 1
        self._compiled = in_background(_library, source, OF_ONE if alone else OF_MANY)

    def run(
        self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int, states: Array
    ) -> Array:
        """Positions (S, L, n) of every segment, from ``states`` (S, 2n).

        Args:
            p: values of ``free[model]``.
            drive: (N substeps, m) effective inputs.

        Raises:
            BadInput: where there is no C compiler.
        """
        plant, (h, t0), cut = self._plant(model, p, structure), _times(record), _segments(record)
        hidden = self.hidden(model, p, structure, record, drive, substeps)
        out = np.empty((len(record.start), record.length, self.coordinates))
        states = np.ascontiguousarray(states)
        self._compiled().shoot(
            *plant, *cut, ctypes.c_int(record.length), ctypes.c_int(substeps), h, t0, _pointer(drive),
            _pointer(states), _pointer(hidden), _pointer(out),
        )  # fmt: skip
        return out

    def hidden(self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int) -> Array:
        """States that are not logged, at the start of each segment, simulated along the measured motion.

        Returns:
            (S, contacts + states + 2 loads): bristle deflection of each contact, states of laws, positions of the
                loads, their velocities.
        """
        hidden = np.zeros((len(record.start), self.contacts + self.states + 2 * self.loads))
        if structure.split or len(structure.rest) or max(structure.sigma, default=0.0) > 0:
            plant, (h, t0), cut = self._plant(model, p, structure), _times(record), _segments(record)
            x, v = np.ascontiguousarray(record.positions), np.ascontiguousarray(record.velocities)
            self._compiled().follow(
                *plant, ctypes.c_int(substeps), h, t0, _pointer(x), _pointer(v), _pointer(drive), *cut,
                ctypes.c_int(self._warm(record, structure)), _pointer(hidden),
            )  # fmt: skip
        return hidden

    def _warm(self, record: Record, structure: Structure) -> int:
        """Samples of simulation before each start; −1: the whole log in one pass."""
        warm = max(record.length, round(WARM_S / record.sample_time))
        few = len(record.start) * warm < len(record.positions)
        return warm if few and structure.split else -1

    def _plant(self, model: int, p: Array, structure: Structure) -> tuple[Any, ...]:
        """The first arguments of both C functions."""
        idle = np.zeros(self.states - len(structure.rest))
        states = np.concatenate([structure.rest, idle, structure.limits[0], idle, structure.limits[1], idle, [0.0]])
        split = np.array([*structure.split, 0], dtype=np.int32)
        coupling = np.append(structure.coupling.ravel(), 0.0)
        p, sigma = np.append(np.ascontiguousarray(p, dtype=float), 0.0), np.array([*structure.sigma, 0.0])
        loads = ctypes.c_int(len(structure.split))
        return ctypes.c_int(model), loads, *(_pointer(array) for array in (p, sigma, split, coupling, states))


@lru_cache(maxsize=KEPT_LIBRARIES)
def _library(source: str, level: tuple[str, ...]) -> ctypes.CDLL:
    """The compiled and loaded library; recent ones are cached."""
    library = load_library(compile_shared({"shooting.c": source}, ["shooting.c"], (*level, *FLAGS)))
    library.follow.restype = library.shoot.restype = None
    return library


def shooting_source(
    systems: Sequence[System],
    free: Sequence[Sequence[sympy.Symbol]],
    loads: int,
    states: int,
    driven: Sequence[int],
) -> str:
    """The C source of all systems' equations and the loops over segments."""
    generator = casadi.CodeGenerator("models", {"with_header": False, "main": False})
    kept = 0
    jumps = any(_set_valued_level(c).has(Sgn) for system in systems for c in system.contacts)
    for k, (system, symbols) in enumerate(zip(systems, free, strict=True)):
        place, model, resting = terms_functions(str(k), system, symbols, loads > 0, jumps)
        for function in (place, model, *([resting] if loads else [])):
            generator.add(function)
        kept = max(kept, model.size1_in(6))
        if states:
            generator.add(law_function(f"laws_{k}", system, symbols, states))
    one = systems[0]
    return render(
        "diagnosis/shooting.c.j2",
        coordinates=one.degrees_of_freedom,
        inputs=max(len(s.inputs) for s in systems),
        driven=driven,
        contacts=len(one.contacts),
        sweeps=SWEEPS,
        rest=REST if jumps else _REST,
        jumps=jumps,
        models=generator.dump(),
        names=range(len(systems)),
        kept=kept,
        loads=loads,
        states=states,
        owners=[owners(system) for system in systems],
    )


def terms_of(system: System) -> tuple[Any, ...]:
    """The compiled expressions of a system; systems with equal ones share code."""
    contacts = [(_set_valued_level(c), c.extra_force) for c in system.contacts]
    laws = [(c, terms.force, *terms.rates) for c, terms in all_law_terms(system)]
    return (system.mass_matrix, system.force, system.distribution, *contacts, *laws)


def term_symbols(changed: System, system: System) -> set[sympy.Symbol]:
    """Symbols in the compiled expressions of a changed system that differ from the original system's."""
    pairs = zip_longest(_entries(changed), _entries(system), fillvalue=sympy.S.Zero)
    return {s for entry, own in pairs if entry != own for s in entry.free_symbols}


def _entries(system: System) -> list[Any]:
    mass, force, distribution, *others = terms_of(system)
    return [*mass, *force, *distribution, *(sympy.sympify(e) for other in others for e in other)]


def _set_valued_level(contact: ContactFriction) -> sympy.Expr:
    """The level of the set-valued law; for a law with states only the part that effects add to it.

    λ = force(u, y) + sgn(u) extra_level + extra_force
    """
    return contact.extra_level if law_terms(contact) is not None else set_valued_level(contact)


def terms_functions(
    name: str, system: System, free: Sequence[sympy.Symbol], loads: bool, jumps: bool
) -> tuple[Any, Any, Any]:
    """Three CasADi functions of a system, all results dense.

    M is factorised once a step; U and each sum of forces are then solved for.

    Args:
        loads: whether coordinates may share their inertia with loads; else ``share`` and ``push`` have no effect.
        jumps: whether levels may jump at standstill; else those at rest are left out.

    Returns:
        place_NAME (x, w, t, p, share) → (U, M⁻¹U, U'M⁻¹U, inertia of the loads, kept) with M less that inertia;
        model_NAME (x, v, w, t, p, share, kept, push, bristle) → (M⁻¹(g + push − U (smooth friction + bristle)), levels
        forward and backward, the same at rest): ``kept`` are values independent of v, computed once for several
        velocities; and
        resting_NAME (x, w, t, p) → g at v = 0.
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
    levels: list[list[Any]] = [[], [], [], []]
    smooth = []
    for c, contact in enumerate(system.contacts):
        level = _set_valued_level(contact)
        speed = casadi.fabs(slip[c]) + _AT_REST
        for column, u in zip(levels, (speed, -speed, casadi.SX(0), casadi.SX(0)), strict=True):
            column.append(to_casadi(level, names | {contact.slip: u}))
        smooth.append(to_casadi(contact.extra_force, names | {contact.slip: slip[c]}))
    force = to_casadi(system.force, names, by_angle=True)
    net = force + push if loads else force
    for c, own in enumerate(smooth):
        net = net - distribution[:, c] * (own + bristle[c])
    outputs = [factors.solve(net), *(casadi.vertcat(*column) for column in (levels if jumps else levels[:2]))]
    still = casadi.vertcat(x, w, t, p, share)
    moving, pieces, values = casadi.extract_parametric([casadi.densify(o) for o in outputs], still, {})
    kept = casadi.vertcat(*pieces) if pieces else casadi.SX.sym("kept", 0)
    before = casadi.vertcat(*values) if values else casadi.SX(0, 1)
    found = [distribution, carried, casadi.mtimes(distribution.T, carried), heavy, before]
    place = casadi.Function(f"place_{name}", [x, w, t, p, share], [casadi.densify(f) for f in found], {"cse": True})
    model = casadi.Function(f"model_{name}", [x, v, w, t, p, share, kept, push, bristle], moving)
    rest = to_casadi(system.force, names | dict.fromkeys(system.velocities, casadi.SX(0)), by_angle=True)
    return place, model, casadi.Function(f"resting_{name}", [x, w, t, p], [casadi.densify(rest)])


def _times(record: Record) -> tuple[Any, Any]:
    return ctypes.c_double(record.sample_time), ctypes.c_double(record.time0)


def _segments(record: Record) -> tuple[Any, Any]:
    return ctypes.c_int(len(record.start)), record.start.ctypes.data_as(ctypes.c_void_p)


def _pointer(array: NDArray[Any]) -> Any:
    return array.ctypes.data_as(ctypes.c_void_p)
