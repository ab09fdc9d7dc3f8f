"""Base classes of friction laws: parameters, level in steady sliding, bound on its slope, states."""

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
"""(low, high) of each state."""


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a law.

    Attributes:
        unit: template over {F} (the contact's force unit) and {q} (its slip's unit).
        positive: whether the parameter must be above ``lowest``, and not only at least that.
        meaning: in a few words.
        lowest: least admissible value, exact; None if there is no bound.
        default: value if a spec omits the parameter; None if it is required.
    """

    name: str
    unit: str
    positive: bool
    meaning: str
    lowest: Any = 0
    default: Any = None


class FrictionLaw(ABC):
    """A friction law: the force λ at one contact as a function of its slip velocity u, and of states or history.

    Attributes:
        name: as in a spec.
        source: publication.
        parameters: in order.
        drives: observers that can use the law: "level" (CFO, GCFO), "state" (DFO, GDFO), or "" for none.
        why_not: if ``drives`` is empty, the reason.
        instead: laws to simulate in its place, if no plant can simulate this one.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[LawParameter, ...]]
    drives: ClassVar[str]
    why_not: ClassVar[str] = ""
    instead: ClassVar[str] = "a law of zero memory or with states"

    @abstractmethod
    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level a(|u|) ≥ 0 in steady sliding, λ = a(|u|) sgn(u), in the contact's force unit."""

    def bristle_stiffness(self, p: Values) -> sympy.Expr:
        """σ of a law of the form λ = σ z, z' = u − (σ/level) |u| z; 0 for other laws."""
        return sympy.Integer(0)

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """(σ0, σ1) of a law of the form of LuGre; None for other laws.

        λ = σ0 z + σ1 z' + σ2 u, z' = u − σ0 |u| z/s(|u|), with s(|u|) the level without its viscous part. ``p`` are
        numbers, since a law may have this form for some values only.
        """
        stiffness = self.bristle_stiffness(p)
        return None if stiffness == 0 else (stiffness, sympy.Integer(0))

    @abstractmethod
    def slope_bound(self, p: Values) -> sympy.Expr:
        """A bound on |∂a/∂u| (Lemma 2.1, generalised), in force unit · s / slip unit; oo if there is none."""


class ZeroMemoryLaw(FrictionLaw):
    """A law λ = level(|u|) sgn(u), whose force depends on the present slip velocity only."""

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
        scale: name of the parameter a in λ = a φ(u, z), if neither φ nor the rates contain it: a DFO estimates it. ""
            if there is none; a DFO then estimates a factor of the whole force, nominally 1.
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
        """(speed, slope) such that |dλ/dt| ≤ slope |du/dt| in sustained sliding above the speed; None if unknown."""
        return None

    def rest_state(self, p: Values) -> States:
        """The states at rest without load."""
        return tuple(sympy.Integer(0) for _ in self.states)


class MemoryLaw(FrictionLaw):
    """A law without state-space form: its force depends on the history of slip, such as the time since it stopped.

    Attributes:
        simulable: whether a plant with set-valued friction simulates it, by its levels at rest and in sliding.
    """

    drives = ""
    simulable: ClassVar[bool] = False

    @abstractmethod
    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force λ over a history of slip.

        Args:
            time: s, increasing, length N.
            slip_velocity: u at those times, length N.
            p: parameters as numbers.
            applied_force: the tangential force on the contact at rest, length N, if the law needs it.

        Returns:
            λ at those times, length N.
        """
