"""Base classes of friction laws: parameters, level in steady sliding, bound on its slope, states."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.spec.functions import Sgn

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


@dataclass(frozen=True)
class LawState:
    """An internal state of a dynamic law; ``unit`` is a template as in LawParameter."""

    name: str
    unit: str
    meaning: str


class FrictionLaw(ABC):
    """A friction law: the force λ at one contact as a function of its slip velocity u, and of states or history.

    Attributes:
        form: of the force, as the title of a group of laws, and a sentence about it.
        name: as in a spec.
        source: publication.
        states: z, in order.
        parameters: in order.
        drives: observers that can use the law: "level" (CFO, GCFO), "state" (DFO, GDFO), or "" for none.
        why_not: if ``drives`` is empty, the reason.
        simulable: whether a plant can simulate the law, if it has a level at rest.
        instead: laws to simulate in its place, if no plant can simulate this one.
    """

    form: ClassVar[tuple[str, str]]
    name: ClassVar[str]
    source: ClassVar[str]
    states: ClassVar[tuple[LawState, ...]] = ()
    parameters: ClassVar[tuple[LawParameter, ...]]
    drives: ClassVar[str]
    why_not: ClassVar[str] = ""
    simulable: ClassVar[bool] = True
    instead: ClassVar[str] = "a law of zero memory or with states"

    @abstractmethod
    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level a(|u|) ≥ 0 in steady sliding, λ = a(|u|) sgn(u), in the contact's force unit."""

    def plant_level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """The level of a set-valued law in a plant, whose standstill has no width; by default ``level``."""
        return self.level(slip_speed, p)

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

    def slope_bound(self, p: Values) -> sympy.Expr:
        """A bound on |∂a/∂u| (Lemma 2.1, generalised), in force unit · s / slip unit; oo if there is none.

        By default 0 for a level that does not depend on the speed; oo for others, which may give their own.
        """
        speed = sympy.Dummy(positive=True)
        return sympy.oo if sympy.sympify(self.level(speed, p)).has(speed) else sympy.Integer(0)

    def sliding_level(self, slip_speed: Array, p: Mapping[str, float]) -> Array:
        """The level in steady sliding at speeds (N,), with parameters as numbers."""
        s = sympy.Symbol("s", nonnegative=True)
        level = _function([s], self.level(s, {name: sympy.sympify(value) for name, value in p.items()}))
        return np.broadcast_to(level(slip_speed), np.shape(slip_speed))

    def is_frictionless(self, p: Mapping[str, float]) -> bool:
        """Whether the level is zero at all speeds."""
        return not np.any(self.sliding_level(np.array([0.0, 1.0]), p))

    def is_weaker_at_rest(self, p: Mapping[str, float]) -> bool:
        """Whether the static level F_s is below the Coulomb level F_c. It seldom is, so the two may be exchanged."""
        return {"F_s", "F_c"} <= p.keys() and p["F_s"] < p["F_c"]

    @abstractmethod
    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force λ over a history of slip, with the states at rest without load at its start.

        Not finite where the law is not defined, as logarithms of the slip speed at standstill.

        Args:
            time: s, increasing, length N.
            slip_velocity: u at those times, length N.
            p: parameters as numbers.
            applied_force: the tangential force on the contact at rest, length N, if the law needs it.

        Returns:
            λ at those times, length N.
        """


def _function(arguments: Sequence[sympy.Symbol], expression: Any) -> Callable[..., Any]:
    """A numerical function of the arguments."""
    modules = [{"Magnitude": np.abs, "Sgn": np.sign}, "numpy"]
    made: Callable[..., Any] = sympy.lambdify(arguments, expression, modules)
    return made


def at_speed(slope: Any, fastest: Any) -> Any:
    """slope · fastest; 0 for a slope of 0, also where there is no highest speed (oo)."""
    return sympy.Integer(0) if slope == 0 else slope * fastest


class ZeroMemoryLaw(FrictionLaw):
    """A law λ = level(|u|) sgn(u), whose force depends on the present slip velocity only."""

    form = ("Zero-memory laws", "The force depends on the present slip velocity alone, as in figure 1.1 of the thesis.")
    drives = "level"

    def largest_level(self, fastest: sympy.Expr, p: Values) -> sympy.Expr:
        """Upper bound on the level for 0 < |u| ≤ ``fastest``: by default a(0+) and the bound on the slope times it.

        oo if there is none. ``p`` are numbers.
        """
        s = sympy.Symbol("s", positive=True)
        slow = self.level(s, p).replace(Sgn, lambda _: sympy.Integer(1)).subs(s, 0)
        return slow + at_speed(self.slope_bound(p), fastest)

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history; zero at rest."""
        return self.sliding_level(np.abs(slip_velocity), p) * np.sign(slip_velocity)


class DynamicLaw(FrictionLaw):
    """A law in state-space form: λ = force(u, z), dz/dt = rates(u, z).

    Attributes:
        scale: name of the parameter a in λ = a φ(u, z), if neither φ nor the rates contain it: a DFO estimates it. ""
            if there is none; a DFO then estimates a factor of the whole force, nominally 1.
    """

    form = (
        "Laws in state-space form",
        "The force and the states' rates are functions of slip velocity and states; hysteresis as in figure 1.2.",
    )
    drives = "state"
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

    def response(self, time: Any, slip_velocity: Any, p: Mapping[str, float], applied_force: Any = None) -> Any:
        """The force over a history, linear in u between the samples; integrated by LSODA."""
        from scipy.integrate import solve_ivp  # its import takes a second, which a list of the laws saves

        values = {name: sympy.sympify(value) for name, value in p.items()}
        arguments = u, *z = sympy.symbols(f"u z:{len(self.states)}", real=True)
        rates = _function(arguments, list(self.rates(u, tuple(z), values)))
        force = _function(arguments, self.force(u, tuple(z), values))
        found = solve_ivp(
            lambda t, states: rates(np.interp(t, time, slip_velocity), *states),
            (time[0], time[-1]),
            [float(state) for state in self.rest_state(values)],
            "LSODA",
            time,
            rtol=1e-7,
            atol=1e-9,
            max_step=(time[-1] - time[0]) / 200,
        )
        return force(slip_velocity, *found.y)


class MemoryLaw(FrictionLaw):
    """A law without state-space form: its force depends on the history of slip, such as the time since it stopped."""

    form = (
        "Laws that are not in state-space form",
        "The force needs the history of the slip. No observer can run them; in steady sliding they have a level.",
    )
    drives = ""
    simulable = False
