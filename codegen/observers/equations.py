"""Data model of an observer: an ordered list of named equations, with states and their rates of change.

Error dynamics, gain conditions, certificate and generated code are derived from this list.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import sympy

from codegen.mechanics.system import Matrix, System
from codegen.spec.model import Spec


@dataclass(frozen=True)
class Equation:
    """A named vector equation of an observer.

    Attributes:
        name: a textbook term (``velocity_estimate``).
        symbols: the symbols of its elements in later equations, k by 1.
        expression: right-hand side over earlier symbols, states, x, v and w.
        units: one per element.
        source: equation number.
        form: ``algebra``: symbols = expression; ``mass_solve``: M symbols = expression, for the acceleration;
            ``solve``: matrix · symbols = expression, behind all equations on which a state depends.
        state: the state z of an estimate of the form z + …, k by 1, or None.
        output: whether it is an output of the generated code.
        matrix: of a ``solve``, k by k, symmetric positive definite.
        law: for each element that is a function of a friction law, its name and arguments; its partial derivatives are
            symbols in Ψ, so that the structure of Ψ is visible.
    """

    name: str
    symbols: Matrix
    expression: Matrix
    units: tuple[str, ...]
    source: str
    form: Literal["algebra", "mass_solve", "solve"] = "algebra"
    state: Matrix | None = None
    output: bool = False
    law: tuple[LawFunction, ...] = ()
    matrix: Matrix | None = None


@dataclass(frozen=True)
class LawFunction:
    """An element of an Equation that is a function of a friction law.

    Attributes:
        label: name of its value, such as xi_rail; the partial derivative by u is xi_u_rail.
        arguments: letter → symbol of an earlier equation, such as u → slip_rail.
    """

    label: str
    arguments: Mapping[str, sympy.Symbol]

    def slope_label(self, letter: str) -> str:
        """The name of the partial derivative by an argument."""
        head, _, tail = self.label.partition("_")
        return f"{head}_{letter}_{tail}"

    @property
    def labels(self) -> tuple[str, ...]:
        """The names of the value and of all its partial derivatives."""
        return (self.label, *(self.slope_label(letter) for letter in self.arguments))


ErrorOf = Literal["velocity", "force", "level", "state"]


@dataclass(frozen=True)
class ErrorVariable:
    """A component of the estimation error, truth − estimate.

    Attributes:
        symbol: of the error, such as e_v1.
        truth: symbol of the true value.
        of: the estimated quantity: velocity, friction force, level of a contact, or state of its law.
        contact: index of its contact, or None.
        coordinate: index of its coordinate, if it has no contact, or None.
        meaning: the error as a formula, for documentation.
    """

    symbol: sympy.Symbol
    truth: sympy.Symbol
    of: ErrorOf
    contact: int | None
    coordinate: int | None
    meaning: str
    unit: str


@dataclass(frozen=True)
class Cascade:
    """Cascade form of Ψ in force errors: −G D O' M⁻¹ O, or with a velocity observer [[−K_v, −M⁻¹O], [G D O' K_v, 0]].

    Valid if g does not depend on v and U does not depend on x; the analysis compares it with the derived Ψ.

    Attributes:
        gain: G, p by p: K_F of a (G)CFO, −K_2 of a (G)TO with K_1 = 0.
        weight: D, p by p, diagonal and positive: h'(|u|).
        onto: O, n by p: U, or the identity.
        velocity_gain: K_v, n by n; None if the velocity is measured.
        label, words: name of the gain, and the product G D O' M⁻¹ O as text.
    """

    gain: Matrix
    weight: Matrix
    onto: Matrix
    velocity_gain: Matrix | None
    label: str
    words: str


@dataclass(frozen=True)
class Domain:
    """Region in which the estimate of a (G)CFO with one contact is certified; all values exact.

    The level is updated only while the estimated slip speed is above ``slip_speed`` and keeps its sign; otherwise it is
    held within ``level``. The estimate is in the domain after ``samples`` consecutive such samples. At the start and
    after invalid samples the level is held for ``restart`` samples first.

    Attributes:
        slip_speed: in the slip's unit/s.
        samples, restart: whole, at least 1.
        level: (low, high) of the true level, in its unit.
        innovation: largest |x[k] − (x + h v̂)[k−1]| in the domain; None: not checked.
    """

    slip_speed: Any
    samples: int
    restart: int
    level: tuple[Any, Any]
    innovation: Any = None


@dataclass(frozen=True)
class Observer:
    """An observer of a System.

    Attributes:
        kind, velocity: as in the spec, such as ``gcfo``, and ``measured`` or ``estimated``.
        equations: in the order in which they are computed.
        states, state_units: z, in order.
        rates: dz/dt over the symbols of the equations.
        initial: z at the first sample, with zero velocity estimate and the declared friction level.
        errors: components of e, in order.
        true_friction: the generalised friction force over their true values and ``signs``.
        signs: slip signs s = ±1, one per contact, constant between reversals.
        gains, gain_units: exact values and units of the gain symbols.
        sample_time: exact, s.
        level_errors: whether the friction errors are in levels, a − â; the force error of a contact is then s (a − â).
        assumed, assumed_units: exact values and units of further constants in Ψ: parameters of the law that the
            observer assumes, and true levels without a range in the envelope.
        truth_ranges: ranges of varying true values, such as a friction state, from their law.
        level_ranges: of a DFO: true level → its range in the envelope; these levels are variables of Ψ.
        cascade: form of Ψ for this kind if g does not depend on v; None if there is none.
        exact: whether e = 0 is an equilibrium: an estimate without error moves as the true value does, and the
            observer assumes the plant's laws and parameters (ξ₁ = ξ). The error dynamics are not derived if it is not
            so; without ``exact`` there is no bound, and the certificate says why.
        integration: method of the step; it also changes the equations of the velocity estimate.
        euler: the observer with explicit Euler, whose equations are the differential equations; None for this one.
        domain: region in which the code updates the level estimate; None: everywhere.
    """

    kind: str
    velocity: str
    system: System
    equations: tuple[Equation, ...]
    states: Matrix
    state_units: tuple[str, ...]
    rates: Matrix
    initial: Matrix
    errors: tuple[ErrorVariable, ...]
    true_friction: Matrix
    signs: tuple[sympy.Symbol, ...]
    gains: Mapping[sympy.Symbol, Any]
    gain_units: Mapping[sympy.Symbol, str]
    sample_time: Any
    level_errors: bool
    assumed: Mapping[sympy.Symbol, Any] = field(default_factory=dict)
    assumed_units: Mapping[sympy.Symbol, str] = field(default_factory=dict)
    truth_ranges: Mapping[sympy.Symbol, tuple[Any, Any]] = field(default_factory=dict)
    level_ranges: Mapping[sympy.Symbol, tuple[Any, Any]] = field(default_factory=dict)
    cascade: Cascade | None = None
    exact: bool = True
    integration: str = "euler"
    euler: Observer | None = None
    domain: Domain | None = None

    @property
    def declared_levels(self) -> tuple[tuple[str, Any, str], ...]:
        """(name, exact value, unit) of each true level that is a constant of Ψ, with its declared value.

        These are levels of a DFO without a range in the envelope; the certificate holds at these values only.
        """
        return tuple((e.truth.name, self.assumed[e.truth], e.unit) for e in self.errors if e.truth in self.assumed)

    @property
    def ranged_levels(self) -> tuple[tuple[str, Any, Any, str], ...]:
        """(name, lowest, largest, unit) of each true friction level that is a variable of Ψ."""
        return tuple(
            (e.truth.name, *self.level_ranges[e.truth], e.unit) for e in self.errors if e.truth in self.level_ranges
        )

    @property
    def values(self) -> dict[sympy.Symbol, Any]:
        """Exact values of all parameters, gains and assumed constants."""
        return {**self.system.values, **self.assumed, **self.gains}

    @cached_property
    def estimates(self) -> tuple[tuple[Any, Any, Any], ...]:
        """(state, symbol of the estimate, its expression), in the order of the errors."""
        own = [e for e in self.equations if e.state is not None]
        return tuple(each for e in own for each in zip(e.state or (), e.symbols, e.expression, strict=True))

    @cached_property
    def distribution(self) -> Matrix:
        """U with numbers in place of the parameters."""
        return Matrix(self.system.distribution.xreplace(self.values))


@dataclass(frozen=True)
class ObserverKind:
    """A kind of observer, such as ``gcfo``; the registry ``OBSERVERS`` collects them.

    Attributes:
        build: the spec and its system → the observer's equations.
        gains: names of the gains that it can have, K_v included.
        options: keys of the ``observer:`` section that only some kinds read, among ``exponent``, ``h``, ``domain`` and
            ``laws``; a spec that sets another of them is refused.
        general: of a kind for one coordinate with one contact: the kind for several; "" for all others.
        by_contact: whether it estimates the friction of each contact, and not only that on each coordinate.
    """

    build: Callable[[Spec, System], Observer]
    gains: tuple[str, ...]
    options: tuple[str, ...] = ()
    general: str = ""
    by_contact: bool = True
