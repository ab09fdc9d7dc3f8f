"""What an observer is: an ordered list of named equations, its states and their rates. Nothing else.

The error dynamics, Ψ, the gain conditions, the certificate and the generated code all follow from this list.
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
        name: what it is, in the field's words (``velocity_estimate``).
        symbols: the symbols that stand for its elements in later equations, k by 1.
        expression: its value over earlier symbols, states, x, v and w; for a ``mass_solve`` the r of M a = r.
        units: one per element.
        source: equation number.
        state: the state z whose estimate this is (estimate = z + …), k by 1, or None.
        output: whether the generated code hands it out.
        law: where each element is a function of its own few symbols by a friction law: these symbols, and what the
            function is called; its slopes stay symbols in Ψ, so that no law's formula hides the structure.
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
    """One element of an Equation as a function of a law.

    Attributes:
        label: of its value, such as xi_rail; its slopes are label_symbol.
        arguments: letter → symbol of an earlier equation, such as u → slip_rail.
    """

    label: str
    arguments: Mapping[str, sympy.Symbol]

    def slope_label(self, letter: str) -> str:
        head, _, tail = self.label.partition("_")
        return f"{head}_{letter}_{tail}"

    @property
    def labels(self) -> tuple[str, ...]:
        return (self.label, *(self.slope_label(letter) for letter in self.arguments))


@dataclass(frozen=True)
class ErrorVariable:
    """A component of the estimation error: truth less estimate.

    Attributes:
        symbol: of the error, such as e_v1.
        truth: the symbol of the true value.
        contact: index of the contact it belongs to, or None.
        meaning: as a formula in words.
    """

    symbol: sympy.Symbol
    truth: sympy.Symbol
    contact: int | None
    meaning: str
    unit: str


@dataclass(frozen=True)
class Cascade:
    """The form Ψ = −G D O' M⁻¹ O, or [[−K_v, −M⁻¹O], [G D O' K_v, 0]] behind the velocity observer, in force errors.

    It holds where g does not depend on v and U not on x; ``stability`` checks that against the derived Ψ.

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
    """Where a (G)CFO's estimate is certified, on one contact: how the code guards its level there, all exact.

    The level is learnt only while the estimated slip is faster than ``slip_speed`` and keeps its sign; outside it is
    held within ``level``. The estimate is in the domain after ``samples`` such samples one after the other.

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
        kind, velocity: as the spec names them.
        equations: in the order in which they are computed.
        states: z, in order; ``rates`` is dz/dt over the equations' symbols; ``initial`` is z at the first sample, with
            zero velocity estimate and the declared friction level.
        errors: in order; ``true_friction`` is the generalised friction force over their true values and ``signs``.
        signs: the slip signs s = ±1, one a contact, constant between reversals.
        gains: gain symbols' exact values; ``gain_units`` their units.
        sample_time: exact, seconds.
        level_errors: whether the friction error is in levels (a − â), whose force form carries the slip sign.
        assumed: exact values of what Ψ holds beside gains and the system's parameters: the parameters of the law that
            the observer assumes, and true levels that the envelope gives no range for; ``assumed_units`` their units.
        truth_ranges: true values that vary, such as a friction state, and the range that their law keeps them in.
        cascade: the form that Ψ has for this kind where g does not depend on v; None if it has no such form.
        exact: whether e = 0 is an equilibrium: the observer assumes the plant's own laws and parameters (ξ₁ = ξ).
        integration: how the step is made from the rates; the equations hold what is chosen of it there.
        euler: the same observer by ``integration: euler``, whose equations are the differential ones; None: this is it.
        domain: how the code guards the level estimate through reversals; None: as the equations stand.
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
    cascade: Cascade | None = None
    exact: bool = True
    integration: str = "euler"
    euler: Observer | None = None
    domain: Domain | None = None

    @property
    def declared_levels(self) -> tuple[tuple[str, Any, str], ...]:
        """(name, exact value, unit) of each true friction level that Ψ holds as the declared number, and as no other.

        These are of a DFO whose envelope has no range for the level: what is certified is true at that level alone.
        """
        return tuple((e.truth.name, self.assumed[e.truth], e.unit) for e in self.errors if e.truth in self.assumed)

    @property
    def values(self) -> dict[sympy.Symbol, Any]:
        """Exact values of all parameters, gains and assumed constants."""
        return {**self.system.values, **self.assumed, **self.gains}
