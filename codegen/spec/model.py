"""Typed specification: the content of a spec file, with names resolved, expressions parsed and values in SI."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import sympy

from codegen.base.errors import Place
from codegen.spec.motion import Form, KinematicTree, Sliding
from codegen.spec.schema import CodeChoice

Rational = sympy.Rational
NO_INPUTS = "no inputs are declared (`inputs:` is missing)"
"""Added to the message on an unknown name that may be meant as an input."""


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
        tolerance: relative, or None.
        deviation: the tolerance in SI where it is written with a unit, else None.
    """

    name: str
    value: Any
    unit: str
    declared: Any
    tolerance: float | None = None
    deviation: float | None = None


@dataclass(frozen=True)
class Contact:
    """A contact, at which friction acts: name of the law, parameters in SI, and bodies if the spec has any.

    Attributes:
        units: parameter → unit with which it is written, if any.
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
        units: parameter → unit with which it is written, if any.
        tolerance: of all its parameters, relative, or None.
    """

    kind: str
    on: tuple[str, ...]
    parameters: Mapping[str, Any]
    units: Mapping[str, str] = field(default_factory=dict, compare=False)
    tolerance: float | None = field(default=None, compare=False)


@dataclass(frozen=True)
class FreeGain:
    """A gain, or an entry of one, that the spec leaves free between two exact bounds."""

    low: Any
    high: Any


@dataclass(frozen=True)
class DomainChoice:
    """The section ``observer.domain``, with exact numbers.

    Attributes:
        slip_speed: least estimated slip speed, in the slip's unit/s.
        settle: time for which the slip must have been above it with one sign, s.
        innovation: largest |x[k] − (x + h v̂)[k−1]|, in the coordinate's unit; None: not checked.
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
        gains: numbers as written: a scalar, a list or rows; a FreeGain for a free one.
        sample_time: seconds, exact.
        exponent: μ of (2.6), exact.
        shape: h(s) over the slip speed s instead of s^μ, or None.
        laws: contact → law that the observer assumes there (ξ₁ of 6.3.3), if it is not the plant's.
        integration: euler, semi_implicit, implicit or exponential (observers/velocity.py).
        domain: region in which a (G)CFO's estimate is certified through reversals, or None.
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
    """The simulation section: inputs, references and controller of ``stiction simulate``, over the time symbol ``t``.

    Attributes:
        observer: whether the spec's observer is simulated with the plant.
        cancel: share of its friction estimate that is cancelled, or None.
        cancel_delay: age of this estimate, in samples of the observer.
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
    """The log section: ``t``, coordinate, velocity or input → name of its column, and factor to SI.

    ``published`` are published figures on the same log, label → text, for comparison in the report.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    cutoff_hz: float | None = None
    published: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class CancellationChoice:
    """The cancellation section.

    Attributes:
        method: choice among several best inputs: ``minimum_norm``, or ``appendix_b``, with unused inputs at 0.
        weight: W of the cost r'W r of the remaining force r: ``mass_inverse``, ``acceleration`` (M⁻²) or ``identity``.
        gain: share of the estimate that is cancelled, exact.
        contacts: ``all``, ``cancellable`` (those that can be cancelled perfectly) or names.
        damping: relative regularisation of the inputs, exact; 0 for none.
    """

    method: str = "minimum_norm"
    weight: str = "mass_inverse"
    gain: Any = sympy.S.One
    contacts: str | tuple[str, ...] = "all"
    damping: Any = sympy.S.Zero


@dataclass(frozen=True)
class Spec:
    """The specification of a machine and its observer.

    Attributes:
        mass_matrix: M(x), n by n, over coordinate and parameter symbols; None if ``form`` gives it.
        force: g(x, v, w), n by 1, all forces but friction, without ``effects``; with ``constraints`` and ``lagrangian``
            the generalised forces that are not in these.
        distribution: U(x), n by contacts, slip velocity U' v; None if the bodies of ``form`` give it.
        form: topology, constraints, Lagrangian or kinematic tree of a robot file, instead of ``mass_matrix``.
        envelope: variable → exact (low, high).
        text, path: of the file.
        places: key → its line in the file.
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
        """Hash of the file's bytes and of the hash of its robot file, if it has one."""
        robot = self.form.sha256 if isinstance(self.form, KinematicTree) else ""
        return hashlib.sha256(self.text.encode() + robot.encode()).hexdigest()

    @property
    def robot(self) -> tuple[str, str] | None:
        """Name and hash of the robot file, or None."""
        return (self.form.file, self.form.sha256) if isinstance(self.form, KinematicTree) else None

    @property
    def positions(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(c.name for c in self.coordinates)

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of their velocities."""
        return tuple(c.velocity for c in self.coordinates)

    @property
    def units(self) -> dict[str, str]:
        """As ``signal_units``."""
        return signal_units(self.coordinates, self.inputs)

    @property
    def required_observer(self) -> ObserverChoice:
        """The observer section, for callers that require one."""
        assert self.observer is not None, f"{self.name} has no observer"
        return self.observer

    @property
    def required_simulation(self) -> Simulation:
        """The simulation section, for callers that require one."""
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


def signal_units(coordinates: Sequence[Coordinate], inputs: Sequence[Input]) -> dict[str, str]:
    """Name → SI unit of every signal that a log may contain: ``t``, positions, velocities and inputs."""
    units = {"t": "s"} | {c.name: c.unit for c in coordinates} | {c.velocity: f"{c.unit}/s" for c in coordinates}
    return units | {i.name: i.unit for i in inputs}


def symbol(name: str) -> sympy.Symbol:
    """The SymPy symbol of a declared name, which is real."""
    return sympy.Symbol(name, real=True)
