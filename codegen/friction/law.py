"""The base classes of friction laws: parameters, steady-sliding level, bound on its slope, states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import sympy

Values = Mapping[str, sympy.Expr]
"""Parameter of a law → its symbol or its value."""
States = tuple[sympy.Expr, ...]
Ranges = tuple[tuple[sympy.Expr, sympy.Expr], ...]
"""Low and high of each state."""


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a law.

    Attributes:
        unit: template over {F} (the contact's force unit) and {q} (its slip's unit).
        positive: whether the lowest value itself is excluded.
        meaning: a few words.
        lowest: admissible value, exact; None where there is no bound.
        default: used where a spec leaves the parameter out; None makes it required.
    """

    name: str
    unit: str
    positive: bool
    meaning: str
    lowest: Any = 0
    default: Any = None


class FrictionLaw(ABC):
    """A law of the force λ at one contact whose slip velocity is u.

    Attributes:
        name: as in a spec.
        source: where the law is published.
        parameters: in order.
        drives: which observers can use the law: "level" (CFO, GCFO), "state" (DFO, GDFO), or "" if neither.
        why_not: where ``drives`` is empty, the reason.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[LawParameter, ...]]
    drives: ClassVar[str]
    why_not: ClassVar[str] = ""

    @abstractmethod
    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level a(|u|) ≥ 0 in steady sliding, λ = a(|u|) sgn(u), in the contact's force unit."""

    def bristle_stiffness(self, p: Values) -> sympy.Expr:
        """σ of a law λ = σ z, z' = u − (σ/level) z |u|; 0 for laws of another form."""
        return sympy.Integer(0)

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """(σ0, σ1) of a law of LuGre's form, None of another.

        λ = σ0 z + σ1 z' + σ2 u with z' = u − σ0 |u| z/s(|u|), where s(|u|) is the level without its viscous part.
        ``p`` are numbers: the form may hold for some values alone.
        """
        stiffness = self.bristle_stiffness(p)
        return None if stiffness == 0 else (stiffness, sympy.Integer(0))

    @abstractmethod
    def slope_bound(self, p: Values) -> sympy.Expr:
        """A bound on |∂a/∂u| (Lemma 2.1 generalised), in force unit · s / slip unit; oo where there is none."""


class ZeroMemoryLaw(FrictionLaw):
    """λ = level(|u|) sgn(u): the force depends on the present slip velocity alone."""

    drives = "level"


@dataclass(frozen=True)
class LawState:
    """An internal state of a dynamic law; ``unit`` is a template as in LawParameter."""

    name: str
    unit: str
    meaning: str


class DynamicLaw(FrictionLaw):
    """A law in state-space form: λ = force(u, z), dz/dt = rates(u, z).

    Attributes:
        states: z, in order.
        scale: the parameter a of λ = a φ(u, z) that neither φ nor the rates contain, so that a DFO can estimate it;
            "" where there is none, and the DFO then estimates a factor of the whole force, nominally 1.
    """

    drives = "state"
    states: ClassVar[tuple[LawState, ...]]
    scale: ClassVar[str] = ""

    @abstractmethod
    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        """ξ(u, z) = dz/dt, one per state."""

    @abstractmethod
    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        """λ(u, z) in the contact's force unit; positive opposes u > 0."""

    @abstractmethod
    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """An invariant interval for each state while |u| ≤ top_speed."""

    def in_sliding(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """(speed, slope): in sustained sliding above this speed |dλ/dt| ≤ slope |du/dt|; None if no bound is known."""
        return None

    def rest_state(self, p: Values) -> States:
        """The states at rest without load."""
        return tuple(sympy.Integer(0) for _ in self.states)


class MemoryLaw(FrictionLaw):
    """A law that is not in state-space form: its force needs the slip's history, such as the time since it stopped."""

    drives = ""

    @abstractmethod
    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a whole history of slip.

        Args:
            time: s, increasing, length N.
            slip_velocity: u at those times, length N.
            p: parameters as numbers.
            applied_force: the force that tries to move the contact, length N, where the law needs it; else None.

        Returns:
            λ at those times, length N.
        """
