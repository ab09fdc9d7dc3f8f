"""Random gain sets for every observer kind, as YAML for the spec and as NumPy for the reference; and numbers of Ψ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.observers import Observer, build_observer
from tests.machines import machine
from tests.observers.by_hand import BY_HAND

from .reference import Point, Reference

KINDS = {
    "one_mass": ("cfo", "gcfo", "to", "gto", "mgto"),
    "two_mass": ("gcfo", "gto", "mgto"),
    "arm": ("gcfo", "gto", "mgto"),
    "cart": ("gcfo", "gto", "mgto"),
}
SPEED = {"one_mass": 1.5, "two_mass": 1.5, "arm": 4.0, "cart": 2.0}


@dataclass(frozen=True)
class Case:
    """An observer made by the project, and the same by hand.

    Attributes:
        h: sample time.
    """

    name: str
    observer: Observer
    dynamics: ErrorDynamics
    reference: Reference
    h: float

    @property
    def size(self) -> int:
        return len(self.observer.errors)

    def point(self, generator: np.random.Generator, slip: Any = None) -> Point:
        """A random operating point; with ``slip`` given, one at which the contacts slip that fast."""
        hand, n = self.reference.hand, self.observer.system.degrees_of_freedom
        x = generator.uniform(-2, 2, n)
        v = generator.uniform(-SPEED[self.name], SPEED[self.name], n)
        if slip is not None:
            v = np.linalg.solve(hand.distribution(x).T, slip)
        count = n if self.reference.kind in ("to", "gto") else len(self.observer.system.contacts)
        friction = generator.uniform(1, 3, count) * (1 if self.reference.levels else generator.choice([-1, 1], count))
        return Point(x, v, generator.uniform(-5, 5, hand.inputs), friction)

    def numbers(self, matrix: Any, p: Point) -> Any:
        """A matrix of the error dynamics at a point, by NumPy, with M⁻¹ and the next velocity by hand."""
        hand, system = self.reference.hand, self.observer.system
        following = p.v + self.h * self.reference.acceleration(p.x, p.v, p.w, p.friction)
        inverse = np.linalg.inv(hand.mass(p.x))
        values = {s: float(v) for s, v in self.observer.values.items()}
        values |= dict(zip((*system.positions, *system.velocities, *system.inputs), (*p.x, *p.v, *p.w), strict=True))
        values |= dict(zip(self.observer.signs, np.sign(hand.distribution(p.x).T @ p.v), strict=True))
        values |= {w: inverse[i, j] for w, (i, j) in self.dynamics.inverse_mass.items()}
        velocity = dict(zip(system.velocities, following, strict=True))
        values |= {n: velocity[v] for n, v in self.dynamics.next_velocity.items()}
        values[sympy.Symbol("h", real=True)] = self.h
        assert matrix.free_symbols <= values.keys()
        used = sorted(matrix.free_symbols, key=str)
        function = sympy.lambdify(used, matrix, [{"Sgn": np.sign, "Magnitude": np.abs}, "numpy"])
        return np.array(function(*[values[s] for s in used]), dtype=float)


def _written(matrix: Any) -> str:
    """A matrix as a gain of a spec: its diagonal if nothing else is in it."""
    if matrix.shape[0] == matrix.shape[1] and not (matrix - np.diag(np.diag(matrix))).any():
        return "[" + ", ".join(repr(float(e)) for e in np.diag(matrix)) + "]"
    return "[" + ", ".join("[" + ", ".join(repr(float(e)) for e in row) + "]" for row in matrix) + "]"


def seeded(*words: str) -> np.random.Generator:
    """A generator of its own for each test, whatever else runs."""
    return np.random.default_rng(list("|".join(words).encode()))


def write_observer(
    name: str,
    kind: str,
    velocity: str,
    generator: np.random.Generator,
    full: bool = False,
    exponent: float = 1.0,
    effects: bool = False,
    h: float = 0.001,
) -> tuple[str, Reference]:
    """The observer section of a spec with random gains, diagonal or with ``full`` every entry filled; and by hand."""
    hand = BY_HAND[name]
    n, contacts = hand.distribution(np.zeros(20)).shape
    rows = n if kind in ("to", "gto") else contacts
    columns = contacts if kind in ("cfo", "gcfo") else n

    def gain(rows: int, columns: int, sign: float) -> Any:
        diagonal = np.zeros((rows, columns))
        np.fill_diagonal(diagonal, sign * generator.uniform(2, 30, min(rows, columns)))
        rest = generator.uniform(-5, 5, (rows, columns))
        return np.where(diagonal != 0, diagonal, rest) if full or rows != columns else diagonal

    levels = kind in ("cfo", "gcfo")
    first, second, third = gain(rows, columns, 1 if levels else -1), gain(rows, n, -1), gain(n, n, 1)
    written = {"K_F": first} if levels else {"K_1": first, "K_2": second}
    if velocity == "estimated":
        written["K_v"] = third
    gains = ", ".join(f"{key}: {_written(value)}" for key, value in written.items())
    shape = f"exponent: {exponent}, " if kind.endswith("cfo") else ""
    section = f"{{kind: {kind}, velocity: {velocity}, sample_time: {h}, {shape}gains: {{{gains}}}}}"
    return section, Reference(hand, kind, velocity == "estimated", first, second, third, exponent, effects)


def make_case(name: str, kind: str, velocity: str, generator: np.random.Generator, **options: Any) -> Case:
    """An observer with random gains and its error dynamics."""
    section, reference = write_observer(name, kind, velocity, generator, **options)
    spec, system = machine(name, section, effects=reference.effects)
    observer = build_observer(spec, system)
    return Case(name, observer, derive_error_dynamics(observer), reference, float(observer.sample_time))
