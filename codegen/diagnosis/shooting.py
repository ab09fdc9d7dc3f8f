"""Free runs over short segments of a log in compiled C, with parameters as arguments."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.compiler import compile_shared
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME, System
from codegen.simulate.contact import SWEEPS
from codegen.text import render

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

FLAGS = ("-O2", "-fno-math-errno", "-fno-trapping-math")
_AT_REST = 1e-30
WARM_S = 1.0
STEPS_PER_PERIOD = 60
"""Time steps in a period of the coarse cutoff."""


@dataclass(frozen=True, eq=False)
class Record:
    """What a free run needs of a log.

    Attributes:
        measured: (N, n) raw positions. positions, velocities: (N, n) smoothed, to start from.
        commands: (N, m), held from t_k to t_(k+1).
        sample_time: s. time0: of the first row since the log began, s.
        noise: (n,) standard deviation of the measured positions' noise.
        start: (S,) first samples of the segments. length: samples of each.
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

    @property
    def targets(self) -> Array:
        """(S, L, n) measured positions of each segment."""
        return np.asarray(self.measured[self.start[:, None] + np.arange(self.length)])

    @property
    def states(self) -> Array:
        """(S, 2n) smoothed states at the starts."""
        return np.hstack([self.positions[self.start], self.velocities[self.start]])


@dataclass(frozen=True)
class Structure:
    """What a model has beyond M, g and U λ.

    Attributes:
        sigma: one a contact; above 0 Dahl's law with that stiffness in place of the set-valued law.
        split: the coordinate whose inertia is shared with a load, or −1.
        load_fraction, stiffness, damping, gap: of the coupling to the load.
    """

    sigma: tuple[float, ...]
    split: int = -1
    load_fraction: float = 0.5
    stiffness: float = 0.0
    damping: float = 0.0
    gap: float = 0.0


class Shooter:
    """Compiled free runs of several systems.

    Attributes:
        free: for each system the symbols that are arguments, in order.
    """

    def __init__(self, systems: Sequence[System], free: Sequence[Sequence[sympy.Symbol]]) -> None:
        """Compile.

        Raises:
            BadInput: where there is no C compiler.
        """
        self.free = [tuple(symbols) for symbols in free]
        self.inputs, self.contacts = len(systems[0].inputs), len(systems[0].contacts)
        self.coordinates = systems[0].degrees_of_freedom
        source = shooting_source(systems, self.free)
        made = compile_shared({"shooting.c": source}, ["shooting.c"], FLAGS)
        with tempfile.NamedTemporaryFile(suffix=".so") as file:
            Path(file.name).write_bytes(made)
            library = ctypes.CDLL(file.name)
        self._follow, self._shoot = library.follow, library.shoot
        self._follow.restype = self._shoot.restype = None

    def run(
        self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int, states: Array
    ) -> Array:
        """Positions (S, L, n) of every segment, from ``states`` (S, 2n).

        Args:
            p: values of ``free[model]``.
            drive: (N substeps, m) effective inputs.
        """
        plant, (h, t0), cut = _plant(model, p, structure), _times(record), _segments(record)
        hidden = self.hidden(model, p, structure, record, drive, substeps)
        out = np.empty((len(record.start), record.length, self.coordinates))
        states = np.ascontiguousarray(states)
        self._shoot(
            *plant, *cut, ctypes.c_int(record.length), ctypes.c_int(substeps), h, t0, _pointer(drive),
            _pointer(states), _pointer(hidden), _pointer(out),
        )  # fmt: skip
        return out

    def hidden(self, model: int, p: Array, structure: Structure, record: Record, drive: Array, substeps: int) -> Array:
        """(S, contacts + 2) z of each contact, load position and velocity at each start, along the measured motion."""
        hidden = np.zeros((len(record.start), self.contacts + 2))
        if structure.split >= 0 or max(structure.sigma, default=0.0) > 0:
            plant, (h, t0), cut = _plant(model, p, structure), _times(record), _segments(record)
            x, v = np.ascontiguousarray(record.positions), np.ascontiguousarray(record.velocities)
            self._follow(
                *plant, ctypes.c_int(substeps), h, t0, _pointer(x), _pointer(v), _pointer(drive), *cut,
                ctypes.c_int(self._warm(record, structure)), _pointer(hidden),
            )  # fmt: skip
        return hidden

    def _warm(self, record: Record, structure: Structure) -> int:
        """Samples for which hidden states are followed before each start; −1: all, in one go."""
        warm = max(record.length, round(WARM_S / record.sample_time))
        few = len(record.start) * warm < len(record.positions)
        return warm if few and structure.split >= 0 else -1


def shooting_source(systems: Sequence[System], free: Sequence[Sequence[sympy.Symbol]]) -> str:
    """The C of all systems' terms and the loops over segments."""
    generator = casadi.CodeGenerator("models", {"with_header": False, "main": False})
    names = []
    for k, (system, symbols) in enumerate(zip(systems, free, strict=True)):
        generator.add(terms_function(f"model_{k}", system, symbols))
        names.append(f"model_{k}")
    one = systems[0]
    return render(
        "diagnosis/shooting.c.j2",
        coordinates=one.degrees_of_freedom,
        inputs=len(one.inputs),
        contacts=len(one.contacts),
        sweeps=SWEEPS,
        models=generator.dump(),
        names=names,
    )


def terms_function(name: str, system: System, free: Sequence[sympy.Symbol]) -> Any:
    """CasADi (x, v, w, t, p) → (M, g, U, levels forward, levels backward, smooth friction), all dense."""
    n = system.degrees_of_freedom
    x, v, w = casadi.SX.sym("x", n), casadi.SX.sym("v", n), casadi.SX.sym("w", len(system.inputs))
    t, p = casadi.SX.sym("t"), casadi.SX.sym("p", len(free))
    names: dict[sympy.Symbol, Any] = {s: casadi.SX(float(value)) for s, value in system.values.items()}
    names |= {s: x[i] for i, s in enumerate(system.positions)} | {s: v[i] for i, s in enumerate(system.velocities)}
    names |= {s: w[i] for i, s in enumerate(system.inputs)} | {s: p[i] for i, s in enumerate(free)} | {TIME: t}
    distribution = casadi.densify(to_casadi(system.distribution, names))
    slip = casadi.mtimes(distribution.T, v)
    forward, backward, smooth = [], [], []
    for c, contact in enumerate(system.contacts):
        level = contact.law_level + contact.extra_level
        speed = casadi.fabs(slip[c]) + _AT_REST
        forward.append(to_casadi(level, names | {contact.slip: speed}))
        backward.append(to_casadi(level, names | {contact.slip: -speed}))
        smooth.append(to_casadi(contact.extra_force, names | {contact.slip: slip[c]}))
    outputs = [to_casadi(system.mass_matrix, names), to_casadi(system.force, names), distribution]
    outputs += [casadi.vertcat(*rows) for rows in (forward, backward, smooth)]
    return casadi.Function(name, [x, v, w, t, p], [casadi.densify(o) for o in outputs])


def _plant(model: int, p: Array, structure: Structure) -> tuple[Any, ...]:
    """The first arguments of both loops."""
    share = np.array([structure.load_fraction, structure.stiffness, structure.damping, structure.gap])
    p, sigma = np.append(np.ascontiguousarray(p, dtype=float), 0.0), np.array([*structure.sigma, 0.0])
    return ctypes.c_int(model), _pointer(p), _pointer(sigma), ctypes.c_int(structure.split), _pointer(share)


def _times(record: Record) -> tuple[Any, Any]:
    return ctypes.c_double(record.sample_time), ctypes.c_double(record.time0)


def _segments(record: Record) -> tuple[Any, Any]:
    return ctypes.c_int(len(record.start)), record.start.ctypes.data_as(ctypes.c_void_p)


def _pointer(array: Array) -> Any:
    return array.ctypes.data_as(ctypes.c_void_p)
