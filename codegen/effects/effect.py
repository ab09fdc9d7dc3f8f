"""Base class of effects: a physical effect that a model may lack, given by parameters, a place and a change of System.

The change determines the added force, the free-run simulation in diagnosis, the terms in Ψ, the certificate and the
generated code.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence, Set
from copy import copy
from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import sympy

from codegen.effects.coordinate import FREE, Above, Between, Coordinate
from codegen.effects.places import pairs
from codegen.effects.start import Covered, Start
from codegen.mechanics.system import System

Place = Literal["contact", "coordinate", "two coordinates", "axis", "input", "sensor"]
"""Kind of place at which an effect acts."""
Axis = Literal["velocity", "position", "load", "time", "acceleration", "input", "input rate"]
"""Variable over which a residual is plotted."""
Symbols = Mapping[str, sympy.Symbol]
"""Name of a parameter → its symbol."""
Intervals = Mapping[str, tuple[float, float]]
"""Name of a parameter → the ends of its interval."""

SHARES = (0.1, 0.5)
"""Default starting values of a shape parameter, as shares of ``Covered.size``."""
PROBE = 1e-3
"""Step of a scale parameter in a difference quotient, as a share of ``Covered.size``; the force is linear over it."""


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    The force of an effect is linear in its scale parameters, such as the b of b u, at least near the neutral value, and
    nonlinear in its shape parameters, such as a Stribeck velocity. A fit therefore tries several starting values of the
    shape parameters, and finds the scale parameters for each by linear least squares.

    Attributes:
        unit: template over {F} (force), {q} (coordinate), {w} (input).
        low, high: open interval of admissible values; None means unbounded.
        neutral: for a scale parameter, the value at which the effect vanishes; None makes it a shape parameter.
        start: function that gives the starting values of a fit. By default a scale parameter starts from linear least
            squares, and a shape parameter at a tenth and at half of the value at which its effect is as large as the
            force.
        moved_in: transformation to the unbounded coordinate in which a fit changes it; by default from its bounds.
        seen_at: for a parameter that is a speed, the lowest and highest value that a log can show, as shares of its
            top speed; None for any.
        as_number: whether the equations contain its declared value instead of a symbol. True for an exponent: SymPy
            then knows that the derivative of |u|**2 at 0 is finite.
        absent_at: for a shape parameter without which the effect vanishes, such as the load behind a spring, the least
            value that a log can show; None for others.
        by_default: the value of a shape parameter with which the effect equals its form without that parameter, such as
            an exponent of 2; None where there is none.
        essential: whether a shape parameter makes the effect what it is, such as the stiffness of a spring. The effect
            is then not accepted where the log does not determine it.
    """

    name: str
    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None
    neutral: float | None = None
    start: Start | None = None
    moved_in: Coordinate | None = None
    seen_at: tuple[float, float] | None = None
    as_number: bool = False
    absent_at: float | None = None
    by_default: float | None = None
    essential: bool = False

    @property
    def limits(self) -> list[str]:
        """The bounds in words."""
        return [f"{word} {b:g}" for word, b in (("above", self.low), ("below", self.high)) if b is not None]

    @property
    def coordinate(self) -> Coordinate:
        """The coordinate in which a fit changes it: itself if it may cross zero, else one that keeps the bounds."""
        if self.moved_in is not None:
            return self.moved_in
        if self.low is None or self.neutral not in (None, 1.0):
            return FREE
        return Above(self.low) if self.high is None else Between(self.low, self.high)


@dataclass(frozen=True)
class Confusion:
    """An effect or cause with a similar signature, and the experiment that discriminates the two.

    The experiment holds for both, also where only one of two effects names the other.

    Attributes:
        other: a kind of the catalogue, or another cause in words.
    """

    other: str
    separated_by: str


class Effect(ABC):
    """One entry of the catalogue (``effects.md``).

    Attributes:
        kind: its name in a spec and in diagnosis.json.
        sits_on: the kind of place that ``on`` names; an axis or a sensor is named by its coordinate.
        equation: in plain notation.
        signature: its pattern in a residual.
        seen_over: the variable over which the signature is seen best.
        parameters: in order.
        more_forms: the parameters of other forms of the same effect, simpler ones first.
        confused_with: effects or causes with a similar signature.
        needs: the condition of ``applies``, in words.
        demands: the condition of ``admissible`` beyond the bounds of each parameter, in words.
        refines: a simpler kind; this one is tried only after a diagnosis has found that one; "" for none.
        extends: a kind with one parameter less, which this one equals where that parameter is zero; "" for none.
        nameless: kinds of laws outside the catalogue (``nameless.py``) that look like this effect where the drive force
            hardly varies. It is not named where one of them explains a log as well.
        both_ways: for an effect on a contact, whether it is identifiable only with slip in both directions.
    """

    kind: ClassVar[str]
    sits_on: ClassVar[Place]
    equation: ClassVar[str]
    signature: ClassVar[str]
    seen_over: ClassVar[Axis]
    parameters: tuple[EffectParameter, ...]
    more_forms: ClassVar[tuple[tuple[EffectParameter, ...], ...]] = ()
    confused_with: ClassVar[tuple[Confusion, ...]]
    needs: ClassVar[str] = ""
    demands: ClassVar[str] = ""
    refines: ClassVar[str] = ""
    extends: ClassVar[str] = ""
    nameless: ClassVar[tuple[str, ...]] = ()
    both_ways: ClassVar[bool] = False

    @abstractmethod
    def add(self, system: System, place: int, p: Symbols) -> System:
        """The system with this effect at ``place``: index of the contact, coordinate, input or pair of coordinates."""

    @property
    def rough(self) -> bool:
        """Whether the free-run error is not a smooth function of the parameters, so that gradient methods fail."""
        return False

    def delay(self, values: Mapping[str, float]) -> float:
        """By how much the input acts late at low frequencies, in s, with these parameter values; by default 0."""
        return 0.0

    def period(self, values: Mapping[str, float]) -> float:
        """Distance after which the shape over position repeats, in the coordinate's unit; 0 without one."""
        return values.get("period", 0.0)

    @property
    def forms(self) -> tuple[Effect, ...]:
        """The forms of this effect that a diagnosis tries, the simplest first; several with optional parameters."""
        if not self.more_forms:
            return (self,)
        return tuple(self._with(parameters) for parameters in (type(self).parameters, *self.more_forms))

    def _with(self, parameters: tuple[EffectParameter, ...]) -> Effect:
        """A copy of this effect with other parameters; the class attribute ``parameters`` is not changed."""
        form = copy(self)
        form.parameters = parameters
        return form

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """The simplest form that has all of these parameters; the last form where none has."""
        known = {p.name for form in self.forms for p in form.parameters}.intersection(names)
        return next((f for f in self.forms if known <= {p.name for p in f.parameters}), self.forms[-1])

    def without(self, free: Set[str]) -> Effect | None:
        """The simplest form that lacks only parameters of these names; None if there is none."""
        own = {p.name for p in self.parameters}
        forms = ((form, {p.name for p in form.parameters}) for form in self.forms)
        return next((form for form, names in forms if names < own <= names | free), None)

    @property
    def waves(self) -> tuple[tuple[str, str], ...]:
        """Names (amplitude, phase) of the parameters of each sine in the effect; by default none.

        They are polar coordinates of two weights, one on the sine and one on the cosine.
        """
        return ()

    def coordinate(self, system: System, place: int) -> int:
        """Index of the coordinate on which the effect acts most; the first of two coordinates."""
        match self.sits_on:
            case "contact":
                return system.contact_coordinates[place]
            case "input":
                return system.driven_coordinates[place]
            case "two coordinates":
                return pairs(system)[place][0]
        return place

    def applies(self, system: System, place: int) -> bool:
        """Whether the effect is possible at this place of this system; see ``needs``."""
        return True

    def is_tried(self, system: System, place: int) -> bool:
        """Whether a diagnosis tries this form at a place where the effect applies."""
        return True

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Whether these parameter values are physical: inside their bounds, and as ``demands`` says."""
        bounds = [(values[p.name], p.low, p.high) for p in self.parameters]
        return all((low is None or v > low) and (high is None or v < high) for v, low, high in bounds)

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """The shape parameters: a fit tries several starting values of them."""
        return tuple(q for q in self.parameters if q.start is not None or q.neutral is None)

    @property
    def scaling(self) -> tuple[EffectParameter, ...]:
        """The scale parameters: the effect is linear in them near the neutral value."""
        shapes = self.shapes
        return tuple(q for q in self.parameters if q not in shapes)

    @property
    def adds_up(self) -> bool:
        """Whether two of this effect on one place are one with the sums of their parameters: its force is linear."""
        return all(q in self.scaling and q.neutral == 0 for q in self.parameters)

    def probes(self, shape: Mapping[str, float], covered: Covered) -> list[tuple[dict[str, float], float]]:
        """Points for finite differences: (parameters, step) for each scale parameter.

        In each, this parameter is a small step from its neutral value and the other scale parameters are neutral. The
        change of the force divided by the step is the regressor of this parameter in linear least squares.
        """
        neutral = dict(shape) | {q.name: float(q.neutral or 0.0) for q in self.scaling}
        steps = [(q.name, PROBE * covered.size(q.unit)) for q in self.scaling]
        return [(neutral | {name: neutral[name] + step}, step) for name, step in steps]

    def weighted(self, shape: Mapping[str, float], weights: Sequence[float]) -> dict[str, float]:
        """All parameters, from the shape parameters and the weights that least squares found for ``probes``."""
        weighted = zip(self.scaling, weights, strict=True)
        return dict(shape) | {q.name: float(q.neutral or 0.0) + float(w) for q, w in weighted}

    def normal_form(self, values: Mapping[str, float]) -> dict[str, float]:
        """These values in a unique form, where several sets of values describe the same effect."""
        return dict(values)

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values for the machine mounted upside down: weights change their sign, all others are unchanged."""
        return dict(values)

    def coupling(self, values: Mapping[str, float]) -> dict[str, float] | None:
        """k, c and load_fraction of a fitted compliance, as a starting point of later fits; None for other effects."""
        return None

    def unseen(self, values: Mapping[str, float], noise: float) -> str:
        """Why a log with this position noise (standard deviation) cannot show these values; empty where it can."""
        return ""

    def outside(
        self, model: System, place: int, values: Mapping[str, float], intervals: Intervals, stroke: float
    ) -> str:
        """Why values describe another effect on a log that moves by ``stroke`` at the place; empty where they do not.

        Args:
            model: the fitted model with this effect. intervals: 95 %, of the parameters that have one.
        """
        return ""

    def limit(self, system: System, place: int, values: Mapping[str, float]) -> tuple[str, dict[str, float]] | None:
        """A limiting case: kind and parameters of a simpler effect that has almost the same force at these values.

        The comparison shows whether the additional parameters of this effect are justified. None where there is none.
        """
        return None

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """Every combination of the shape parameters' starting values; one empty entry where there are none."""
        shapes = self.shapes
        grids = [q.start(covered) if q.start else [s * covered.size(q.unit) for s in SHARES] for q in shapes]
        return [{q.name: float(v) for q, v in zip(shapes, values, strict=True)} for values in product(*grids)]

    def suggested(self, covered: Covered) -> list[dict[str, float]]:
        """Further starting values, computed from the force residual; a fit starts from each of them."""
        return []

    def followed(self, covered: Covered) -> list[dict[str, float]]:
        """A grid of starting values for an effect with internal states; empty for others.

        The simulation error of such an effect is not a smooth function of its parameters, so a fit must start near the
        optimum. The states are simulated along the measured motion for each point of the grid, and fits start from the
        points with the smallest force residual.
        """
        return []

    def restarts(self, values: Mapping[str, float], covered: Covered) -> list[dict[str, float]]:
        """Starting values for a repeated fit, from fitted values; for effects whose fit may end in a local minimum."""
        return []

    def neighbours(self, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Values at which the error is nearly that of fitted ones: one more search begins at the best of them."""
        return []

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        """(kind, place) of each effect that gives the same motion once friction levels are refitted."""
        return []
