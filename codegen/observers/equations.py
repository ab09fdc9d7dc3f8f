"""An observer as data: an ordered list of named equations, with states and their rates of change.

Error dynamics, Ψ, gain conditions, certificate and generated code are derived from this list.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import sympy

from codegen.mechanics.system import Matrix, System


@dataclass(frozen=True)
class Equation:
    """One named block of the observer.

    Attributes:
        name: a textbook term (``velocity_estimate``).
        symbols: the symbols of its elements in later equations, k by 1.
        expression: its value over earlier symbols, states, x, v and w; for a ``mass_solve`` the r of M a = r.
        units: one per element.
        source: equation number.
        state: the state z of this estimate (estimate = z + …), k by 1, or None.
        output: whether it is an output of the generated code.
        law: for elements that are functions of a friction law: the arguments and the function's name. Their partial
            derivatives stay symbols in Ψ, so that its structure remains visible.
    """

    name: str
    symbols: Matrix
    expression: Matrix
    units: tuple[str, ...]
    source: str
    form: Literal["algebra", "mass_solve"] = "algebra"
    state: Matrix | None = None
    output: bool = False
    law: tuple[LawFunction, ...] = ()


@dataclass(frozen=True)
class LawFunction:
    """One element of an Equation as a function of a friction law.

    Attributes:
        label: of its value, such as xi_rail; a slope is named with the letter of its argument, such as xi_u_rail.
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
    """A component of the estimation error: truth less estimate.

    Attributes:
        symbol: of the error, such as e_v1.
        truth: the symbol of the true value.
        of: what is estimated: a velocity, a friction force, a contact's level, or the state of its law.
        contact: index of the contact it belongs to, or None.
        coordinate: index of the coordinate it belongs to where it has no contact, or None.
        meaning: the error as a formula, for pages.
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

    Valid where g does not depend on v and U not on x; the analysis checks it against the derived Ψ.

    Attributes:
        gain: G, p by p: K_F of a (G)CFO, −K_2 of a (G)TO with K_1 = 0.
        weight: D, p by p, diagonal and positive: h'(|u|).
        onto: O, n by p: U, or the identity.
        velocity_gain: K_v, n by n, or None where the velocity is measured.
        label, words: the gain's name, and the product G D O' M⁻¹ O in words.
    """

    gain: Matrix
    weight: Matrix
    onto: Matrix
    velocity_gain: Matrix | None
    label: str
    words: str


@dataclass(frozen=True)
class Domain:
    """Region of slip in which a (G)CFO's estimate is certified, on one contact; all values exact.

    The level is updated only while the estimated slip is faster than ``slip_speed`` and keeps its sign; otherwise it is
    held within ``level``. The estimate is in the domain after ``samples`` consecutive such samples.

    Attributes:
        slip_speed: in the slip's unit/s.
        samples: whole, at least 1.
        level: (low, high) of the true level, in its unit.
        innovation: the largest |x − (x + h v̂) of the sample before| in the domain; None: not checked.
    """

    slip_speed: Any
    samples: int
    level: tuple[Any, Any]
    innovation: Any = None


@dataclass(frozen=True)
class Observer:
    """An observer on a System.

    Attributes:
        equations: in the order in which they are computed.
        states: z, in order; ``rates`` is dz/dt over the equations' symbols; ``initial`` is z at the first sample, with
            zero velocity estimate and the declared friction level.
        errors: in order; ``true_friction`` is the generalised friction force over their true values and ``signs``.
        signs: the slip signs s = ±1, one a contact, constant between reversals.
        gains: exact values of the gain symbols; ``gain_units`` their units.
        sample_time: exact, seconds.
        level_errors: whether the friction error is in levels, a − â; the force error of a contact is s (a − â).
        assumed: exact values of other constants in Ψ than gains and the system's parameters: parameters of the law that
            the observer assumes, and true levels without a range in the envelope; ``assumed_units`` their units.
        truth_ranges: ranges of true values that vary, such as a friction state, from their law.
        level_ranges: of a DFO, ranges of true levels that are variables of Ψ: the envelope's, or about the declared.
        cascade: form of Ψ for this kind where g does not depend on v; None if there is none.
        exact: whether e = 0 is an equilibrium: true where the observer assumes the plant's own laws and parameters
            (ξ₁ = ξ).
        integration: method by which rates become a step; it also changes the velocity equations.
        euler: the observer with explicit Euler, whose equations are the differential ones; None: it is this one.
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
        """(name, exact value, unit) of each true friction level that enters Ψ as a fixed number, the declared one.

        For a DFO without a range for the level in the envelope: the certificate holds at that level only.
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
