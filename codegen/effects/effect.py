"""What an effect is: parameters, a place, and what it does to the System.

Everything else is derived from that one change: the force it adds, its free runs in diagnosis, its part in Ψ, the
certificate and the generated code.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import sympy

from codegen.effects.coordinate import FREE, Above, Between, Coordinate
from codegen.effects.places import driven_coordinate, pairs, rubbed_coordinate
from codegen.effects.start import Covered, Start
from codegen.mechanics.system import Matrix, System

Place = Literal["contact", "coordinate", "two coordinates", "axis", "input", "sensor"]
Axis = Literal["velocity", "position", "load", "time", "acceleration", "input", "input rate"]
Symbols = Mapping[str, sympy.Symbol]

SHARES = (0.1, 0.5)
"""Where a shape parameter without a start of its own is tried, in what makes its effect as large as the force."""
PROBE = 1e-3
"""Size of a probe of a parameter that scales an effect, in what makes its effect as large as the force."""


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes:
        unit: template over {F} (force), {q} (coordinate), {w} (input).
        low, high: open interval of admissible values; None means unbounded.
        neutral: the value at which the effect vanishes (for those that scale it), or None for shape parameters.
        start: the values from which a fit to a log may start; without it, least squares finds a parameter that
            scales the effect, and a shape parameter at a tenth and a half of what makes it as large as the force.
        moved_in: the coordinate in which a fit moves it; None leaves that to its bounds.
    """

    name: str
    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None
    neutral: float | None = None
    start: Start | None = None
    moved_in: Coordinate | None = None

    @property
    def coordinate(self) -> Coordinate:
        """In which a fit moves it: what vanishes at zero crosses it freely, any other value keeps its bounds."""
        if self.moved_in is not None:
            return self.moved_in
        if self.low is None or self.neutral not in (None, 1.0):
            return FREE
        return Above(self.low) if self.high is None else Between(self.low, self.high)


@dataclass(frozen=True)
class Confusion:
    """What looks like an effect, and the motion that tells the two apart.

    Attributes:
        other: a kind of the catalogue, or in words what is no effect.
        separated_by: the motion, or whatever else it takes.
    """

    other: str
    separated_by: str


class Effect(ABC):
    """One entry of the catalogue (``effects.md``).

    Attributes:
        kind: its name in a spec and in diagnosis.json.
        sits_on: what ``on`` names; an axis or a sensor is that of a coordinate and is named by it.
        equation: as a person writes it.
        signature: what it leaves in a residual.
        seen_over: against what the signature is seen best.
        parameters: in order.
        confused_with: what leaves a similar signature.
        needs: where ``applies`` is not always true, the condition in words.
        demands: where ``admissible`` asks for more than each parameter's bounds, that in words.
        refines: the kind of which this is the richer form, worth trying only where that one is found; "" for none.
        both_ways: of an effect on a contact, whether it is seen only where the slip has both directions.
        rough: whether the error of a free run jumps as its parameters change, so that slopes alone find no minimum.
    """

    kind: ClassVar[str]
    sits_on: ClassVar[Place]
    equation: ClassVar[str]
    signature: ClassVar[str]
    seen_over: ClassVar[Axis]
    parameters: tuple[EffectParameter, ...]
    confused_with: ClassVar[tuple[Confusion, ...]]
    needs: ClassVar[str] = ""
    demands: ClassVar[str] = ""
    refines: ClassVar[str] = ""
    both_ways: ClassVar[bool] = False
    rough: ClassVar[bool] = False

    @abstractmethod
    def add(self, system: System, place: int, p: Symbols) -> System:
        """The system with this effect at ``place``: index of the contact, coordinate, input or pair of coordinates."""

    def with_parameters(self, names: Sequence[str]) -> Effect:
        """The effect with the parameters that a spec gives it; another one only where their number is open."""
        return self

    def coordinate(self, system: System, place: int) -> int:
        """Index of the coordinate on which the effect acts most; of two coordinates the first."""
        match self.sits_on:
            case "contact":
                return rubbed_coordinate(system, place)
            case "input":
                return driven_coordinate(system, place)
            case "two coordinates":
                return pairs(system)[place][0]
        return place

    def applies(self, system: System, place: int) -> bool:
        """Whether the effect makes sense at this place of this system; ``needs`` says when."""
        return True

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Whether these parameter values are physical: inside their bounds, and what else a kind demands."""
        bounds = [(values[p.name], p.low, p.high) for p in self.parameters]
        return all((low is None or v > low) and (high is None or v < high) for v, low, high in bounds)

    def change(self, system: System, place: int, p: Symbols) -> Matrix:
        """What the effect adds to g − M a − U λ, n by 1, over x, v, w, accelerations and its parameters."""
        return Matrix(self.add(system, place, p).equation_error - system.equation_error)

    @property
    def shapes(self) -> tuple[EffectParameter, ...]:
        """The parameters that a fit tries at several values before it refines them."""
        return tuple(q for q in self.parameters if q.start is not None or q.neutral is None)

    @property
    def scaling(self) -> tuple[EffectParameter, ...]:
        """The parameters in which the effect is linear near no effect: least squares finds them for each shape."""
        shapes = self.shapes
        return tuple(q for q in self.parameters if q not in shapes)

    def probes(self, shape: Mapping[str, float], covered: Covered) -> list[tuple[dict[str, float], float]]:
        """(parameters, size of the step) of a small effect of this shape, one for each weight to be found."""
        none = dict(shape) | {q.name: float(q.neutral or 0.0) for q in self.scaling}
        steps = [(q.name, PROBE * covered.size(q.unit)) for q in self.scaling]
        return [(none | {name: none[name] + step}, step) for name, step in steps]

    def weighted(self, shape: Mapping[str, float], weights: Sequence[float]) -> dict[str, float]:
        """The parameters of a shape with the weights of its ``probes``."""
        found = zip(self.scaling, weights, strict=True)
        return dict(shape) | {q.name: float(q.neutral or 0.0) + float(w) for q, w in found}

    def normal_form(self, values: Mapping[str, float]) -> dict[str, float]:
        """These parameters, or those of the same effect by which it is named where several give it."""
        return dict(values)

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """The parameters that the effect has where weight acts the other way; the same, unless it is weight."""
        return dict(values)

    def coupling(self, values: Mapping[str, float]) -> dict[str, float] | None:
        """The fitted spring between motor and load (k, c, load_fraction) from which others start; None: it is none."""
        return None

    def unseen(self, values: Mapping[str, float], noise: float) -> str:
        """Why a log with this noise of the position (standard deviation) cannot show these values; else empty."""
        return ""

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """Every combination of the values that the shape parameters start from; one empty where there are none."""
        shapes = self.shapes
        grids = [q.start(covered) if q.start else [s * covered.size(q.unit) for s in SHARES] for q in shapes]
        return [{q.name: float(v) for q, v in zip(shapes, values, strict=True)} for values in product(*grids)]

    def suggested(self, covered: Covered) -> list[dict[str, float]]:
        """Values that the force residual suggests: a fit starts from each, however it looks before the fit."""
        return []

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        """(kind, on) of effects that give the same motion once friction levels may be refitted."""
        return []
