"""The typed specification: what a spec file says, with names resolved, expressions parsed and values in SI."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import sympy

from codegen.base.errors import Place
from codegen.spec.motion import Form, KinematicTree, Sliding
from codegen.spec.schema import CodeChoice

Rational = sympy.Rational
NO_INPUTS = "no inputs are declared (`inputs:` is missing)"
"""Said of an unknown name where an input may stand."""


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate and its velocity; ``unit`` is SI (m or rad)."""

    name: str
    velocity: str
    unit: str


@dataclass(frozen=True)
class Input:
    """An external input w in its SI unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class Parameter:
    """A constant of the model.

    Attributes:
        value: exact, in SI base units.
        unit: as declared; ``declared`` is the value in that unit.
        tolerance: relative, or None where the spec gives none.
    """

    name: str
    value: Any
    unit: str
    declared: Any
    tolerance: float | None = None


@dataclass(frozen=True)
class Contact:
    """A place where friction acts: its law's name, that law's parameters in SI, and the bodies if the spec has any.

    Attributes:
        units: parameter → the unit that it was written with, where it has one.
    """

    name: str
    law: str
    unit: str
    parameters: Mapping[str, Any]
    sliding: Sliding | None = None
    units: Mapping[str, str] = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class DeclaredEffect:
    """An entry of ``effects:``; kind, place and parameters as in the catalogue, in SI.

    Attributes:
        units: parameter → the unit that it was written with, where it has one.
        tolerance: of all its parameters, relative, or None where the spec gives none.
    """

    kind: str
    on: tuple[str, ...]
    parameters: Mapping[str, Any]
    units: Mapping[str, str] = field(default_factory=dict, compare=False)
    tolerance: float | None = field(default=None, compare=False)


@dataclass(frozen=True)
class FreeGain:
    """A gain, or an entry of one, that the spec leaves open between two exact bounds."""

    low: Any
    high: Any


@dataclass(frozen=True)
class DomainChoice:
    """``observer.domain``: exact numbers.

    Attributes:
        slip_speed: least speed of the estimated slip, in the slip's unit/s.
        settle: how long the slip has been so fast, with one sign, s.
        innovation: the largest |x − (x + h v̂) of the sample before|, in the coordinate's unit; None: not checked.
    """

    slip_speed: Any
    settle: Any
    innovation: Any = None


@dataclass(frozen=True)
class ObserverChoice:
    """The observer section: gains are matrices given by rows (a scalar or a list means a diagonal).

    Attributes:
        kind: cfo, gcfo, to, gto, mgto, dfo or gdfo.
        velocity: "measured" or "estimated".
        gains: raw numbers as written: a scalar, a list or rows; a FreeGain where the spec leaves one open.
        sample_time: seconds, exact.
        exponent: μ of (2.6), exact.
        shape: h(s) over the slip speed s in place of s^μ, or None.
        laws: contact → the law that the observer assumes there (ξ₁ of 6.3.3), where it is not the plant's.
        integration: euler, semi_implicit, implicit or exponential (observers/velocity.py).
        domain: where a (G)CFO's estimate is certified through reversals, or None.
    """

    kind: str
    velocity: str
    gains: Mapping[str, Any]
    sample_time: Any
    exponent: Any
    shape: sympy.Expr | None = None
    laws: Mapping[str, Contact] = field(default_factory=dict)
    integration: str = "euler"
    domain: DomainChoice | None = None


@dataclass(frozen=True)
class Simulation:
    """How the plant is driven by ``stiction simulate``; expressions are over the time symbol ``t``.

    Attributes:
        observer: whether the spec's observer is simulated with the plant.
        cancel: the share of its friction estimate that is cancelled, or None; cancel_delay: its age, in samples of the
            observer.
    """

    duration: float
    sample_time: float
    inputs: Mapping[str, sympy.Expr]
    reference: Mapping[str, sympy.Expr]
    position_gain: Mapping[str, float]
    velocity_gain: Mapping[str, float]
    input_limit: Mapping[str, float]
    encoder_step: Mapping[str, float]
    position_noise: Mapping[str, float]
    seed: int
    integral_gain: Mapping[str, float] = field(default_factory=dict)
    velocity_noise: Mapping[str, float] = field(default_factory=dict)
    observer: bool = False
    cancel: float | None = None
    cancel_delay: int = 0


@dataclass(frozen=True)
class LogColumns:
    """What a log calls its columns: from ``t``, coordinate, velocity or input to a column's name and scale to SI.

    ``published`` holds figures of others on the same log, label to text, for comparison in the report.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    cutoff_hz: float | None = None
    published: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class CancellationChoice:
    """The cancellation section.

    Attributes:
        method: of several best inputs the one of ``minimum_norm``, or that of ``appendix_b``, with unused inputs at 0.
        weight: W of the cost r'W r of the remaining force r: ``mass_inverse``, ``acceleration`` (M⁻²) or ``identity``.
        gain: exact; the share of the estimate that is cancelled.
        contacts: ``all``, ``cancellable`` (those that can be cancelled perfectly) or names.
        damping: exact, relative; 0 leaves the inputs undamped.
    """

    method: str = "minimum_norm"
    weight: str = "mass_inverse"
    gain: Any = sympy.S.One
    contacts: str | tuple[str, ...] = "all"
    damping: Any = sympy.S.Zero


@dataclass(frozen=True)
class Spec:
    """One machine and its observer, as its author wrote it.

    Attributes:
        mass_matrix: M(x), n by n, over coordinate and parameter symbols; None where ``form`` gives it.
        force: g(x, v, w), n by 1, everything but friction, without ``effects``; beside ``constraints`` and
            ``lagrangian`` the generalised forces that these do not give.
        distribution: U(x), n by contacts; slip velocity is U' v; None where the bodies of ``form`` give it.
        form: topology, constraints, Lagrangian or a robot file's kinematic tree in place of ``mass_matrix``.
        envelope: exact (low, high) for each named variable.
        text, path: the file itself.
    """

    name: str
    source: str
    coordinates: tuple[Coordinate, ...]
    inputs: tuple[Input, ...]
    parameters: tuple[Parameter, ...]
    mass_matrix: sympy.ImmutableMatrix | None
    force: sympy.ImmutableMatrix
    distribution: sympy.ImmutableMatrix | None
    form: Form | None
    contacts: tuple[Contact, ...]
    effects: tuple[DeclaredEffect, ...]
    observer: ObserverChoice | None
    envelope: Mapping[str, tuple[Any, Any]]
    simulation: Simulation | None
    log: LogColumns
    text: str
    path: Path
    places: Mapping[str, Place]
    code: CodeChoice = field(default_factory=CodeChoice)
    cancellation: CancellationChoice | None = None

    @property
    def file_sha256(self) -> str:
        """Hash of the spec file's bytes."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def sha256(self) -> str:
        """Hash of all that the spec says: of the file's bytes, and of its robot file's hash where it names one."""
        robot = self.form.sha256 if isinstance(self.form, KinematicTree) else ""
        return hashlib.sha256(self.text.encode() + robot.encode()).hexdigest()

    @property
    def robot(self) -> tuple[str, str] | None:
        """Name and hash of the robot file that ``urdf:`` names."""
        return (self.form.file, self.form.sha256) if isinstance(self.form, KinematicTree) else None

    @property
    def positions(self) -> tuple[str, ...]:
        return tuple(c.name for c in self.coordinates)

    @property
    def velocities(self) -> tuple[str, ...]:
        return tuple(c.velocity for c in self.coordinates)

    @property
    def required_observer(self) -> ObserverChoice:
        """The observer section, for work that only a spec with one is given."""
        assert self.observer is not None, f"{self.name} has no observer"
        return self.observer

    @property
    def required_simulation(self) -> Simulation:
        """The simulation section, alike."""
        assert self.simulation is not None, f"{self.name} has no simulation section"
        return self.simulation

    def symbol(self, name: str) -> sympy.Symbol:
        """The real SymPy symbol of a declared name."""
        return symbol(name)

    def place(self, key: str) -> Place:
        """File and line of a key; of the nearest parent if it has no line of its own."""
        while key not in self.places and ("." in key or "[" in key):
            key = key[: max(key.rfind("."), key.rfind("["))]
        return self.places.get(key, Place(str(self.path)))


def symbol(name: str) -> sympy.Symbol:
    """Every declared name is a real symbol."""
    return sympy.Symbol(name, real=True)
