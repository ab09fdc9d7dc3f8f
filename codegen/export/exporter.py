"""Base class of all exported models: force errors over the envelope, and remarks on what a target represents."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import Literal

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.export.mechanism import SPEED, Direction, Line, LineFriction, Mechanism, OtherForce
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.system import TIME, System
from codegen.spec.functions import Magnitude
from codegen.spec.model import Spec

Held = Literal["exact", "nearest", "dropped"]
CORNER = ", with a sharp corner in place of a rounded one"


@dataclass(frozen=True)
class Remark:
    """How the exported model represents one property of the machine.

    Attributes:
        where: the property, such as ``contact guide``.
        held: ``exact``, ``nearest`` (approximated by the nearest element of the target), or ``dropped``.
        how: the element of the model that represents it.
        worst, rms: largest and RMS force error over the envelope; None if there is none, or it is no force.
        unit: of these.
    """

    where: str
    held: Held
    how: str
    worst: float | None = None
    rms: float | None = None
    unit: str = ""

    @classmethod
    def with_errors(cls, where: str, held: Held, how: str, errors: NDArray[np.float64], unit: str) -> Remark:
        """A remark with the largest and the RMS of the force errors at sampled points."""
        rms = float(np.sqrt(np.mean(errors**2)))
        return cls(where, held, how, float(np.abs(errors).max(initial=0.0)), rms, unit)

    @property
    def text(self) -> str:
        """The remark as a line."""
        errors = "" if self.worst is None else f"; force error at most {self.worst:.4g}, RMS {self.rms:.4g} {self.unit}"
        return f"{self.where}: {self.held}: {self.how}{errors}"


POINTS = 4096
"""Random points of the region over which a mean is formed."""
SPEEDS = 1000
"""Speeds at which friction along a line is fitted."""
NEGLIGIBLE = 0.05
"""A mean below this share of the force's RMS counts as zero: it is due to the random points."""


class Exporter:
    """A mechanism whose other forces are replaced by their means over the envelope, with remarks.

    Forces for which no target has an element become constant forces or friction levels; the deviation is the error.
    """

    def __init__(self, spec: Spec, mechanism: Mechanism) -> None:
        self.spec, self.system = spec, mechanism.system
        self.region = Region(spec, self.system)
        self.remarks: list[Remark] = []
        lines = {line.direction: replace(line, frictions=list(line.frictions)) for line in mechanism.lines}
        for other in mechanism.other_forces:
            self._take(other, lines)
        self.mechanism = replace(mechanism, lines=tuple(lines.values()), other_forces=())

    def remark(self, where: str, held: Held, how: str, errors: Array | None = None, unit: str = "") -> None:
        """Add a remark, with the force errors at sampled points, if given."""
        made = Remark(where, held, how) if errors is None else Remark.with_errors(where, held, how, errors, unit)
        self.remarks.append(made)

    def unit(self, direction: Direction) -> str:
        """The unit of a force along a line, which is that of its first coordinate."""
        return self.system.force_unit(next((i for i, c in enumerate(direction) if c), 0))

    def line_name(self, direction: Direction) -> str:
        """A line in words: ``x``, ``x2 - x1``."""
        names = [x.name for x in self.system.positions]
        parts = []
        for c, name in sorted(zip(direction, names, strict=True), key=lambda part: -part[0]):
            if c:
                size = "" if abs(c) == 1 else f"{abs(c):.6g}*"
                parts.append(f"{'-' if c < 0 else '+'} {size}{name}")
        return " ".join(parts).removeprefix("+ ")

    def assumed(self, force: sympy.Expr, direction: Direction = ()) -> str:
        """The assumed ranges over which a force was evaluated, in words; empty if the spec gives all of them."""
        names = {s for s in force.free_symbols if isinstance(s, sympy.Symbol)}
        if SPEED in names:
            names |= {v for c, v in zip(direction, self.system.velocities, strict=False) if c}
        ranges = self.region.assumptions(names)
        return f" (over {', '.join(ranges)}, assumed: the envelope has no range for it)" if ranges else ""

    def _take(self, other: OtherForce, lines: dict[Direction, Line]) -> None:
        """Add the mean of a force to its line, and a remark."""
        values = self.region.sampled(other.force, other.direction)
        finite = values[np.isfinite(values)]
        mean = float(finite.mean()) if len(finite) else 0.0
        if abs(mean) < NEGLIGIBLE * float(np.sqrt(np.mean(finite**2))) or (other.friction and mean < 0):
            mean = 0.0
        line = lines.setdefault(other.direction, Line(other.direction))
        if other.friction and mean:
            line.frictions.append(LineFriction(other.friction, "a mean", sympy.Float(mean), None, False))
        elif mean:
            line.constant += mean
        unit = self.unit(other.direction)
        kept = f"its mean over the envelope, {mean:.4g} {unit}, is exported" if mean else "it is left out"
        fractions = {r: sympy.Float(r, 6) for r in other.force.atoms(sympy.Rational) if not r.is_Integer}
        force = f"{sympy.sstr(other.force.xreplace(fractions))} along {self.line_name(other.direction)}"
        how = f"{force} has no element in this format; {kept}{self.assumed(other.force)}"
        self.remark(other.where, "nearest" if mean else "dropped", how, finite - mean, unit)


class Region:
    """Ranges of positions, velocities, inputs and time, over which errors are evaluated.

    Attributes:
        ranges: symbol → (low, high).
        assumed: ranges that the spec does not give, in words.
    """

    def __init__(self, spec: Spec, system: System) -> None:
        self.assumed: list[str] = []
        self._system = system
        self.ranges: dict[sympy.Symbol, tuple[float, float]] = {}
        for x, v, unit in zip(system.positions, system.velocities, system.position_units, strict=True):
            half = pi if unit == "rad" else 1.0
            self.ranges[x] = self._range(spec, x, half, unit)
            self.ranges[v] = self._range(spec, v, 1.0, f"{unit}/s")
        for w, unit in zip(system.inputs, system.input_units, strict=True):
            given = spec.simulation.input_limit.get(w.name) if spec.simulation is not None else None
            limits = [float(e.height.subs(system.values)) for e in system.actuator(system.inputs.index(w)).limits]
            if given is not None or limits:
                half = min([*limits, *([given] if given is not None else [])])
                self.ranges[w] = (-half, half)
            else:
                self.ranges[w] = self._range(spec, w, 1.0, unit)
        duration = spec.simulation.duration if spec.simulation is not None else 60.0
        self.ranges[TIME] = (0.0, float(duration))

    def _range(self, spec: Spec, name: sympy.Symbol, half: float, unit: str) -> tuple[float, float]:
        declared = name.name.removesuffix("_load")
        if declared in spec.envelope:
            low, high = spec.envelope[declared]
            return float(low), float(high)
        if declared == name.name:
            self.assumed.append(f"{name} in [{-half:g}, {half:g}] {unit}")
        return -half, half

    def assumptions(self, names: set[sympy.Symbol]) -> list[str]:
        """The assumptions about these symbols."""
        return [text for text in self.assumed if text.split(" ")[0] in {s.name for s in names}]

    def speeds(self, direction: Direction) -> Array:
        """Evenly spaced speeds along a line, from above 0 to the highest in the region, (SPEEDS,)."""
        pairs = zip(direction, self._system.velocities, strict=True)
        top = sum(abs(c) * max(map(abs, self.ranges[v])) for c, v in pairs if c)
        return (np.arange(SPEEDS) + 0.5) / SPEEDS * top

    def sampled(self, expression: sympy.Expr, direction: Direction = ()) -> Array:
        """Values at random points of the region, (POINTS,); SPEED is the magnitude of the velocity along the line."""
        rate = sympy.Add(*[sympy.Float(c) * v for c, v in zip(direction, self._system.velocities, strict=False) if c])
        rng = np.random.default_rng(0)
        points = np.column_stack([rng.uniform(*range_, POINTS) for range_ in self.ranges.values()])
        value = sympy.sympify(expression).xreplace({SPEED: Magnitude(rate)})
        return at_points(function_of(value, list(self.ranges)), points).ravel()
