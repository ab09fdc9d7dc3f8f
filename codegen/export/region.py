"""Over what an exported law is compared with ours: the envelope, and what is assumed where it says nothing."""

from __future__ import annotations

from math import pi

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.export.mechanism import SPEED, Direction
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME, System
from codegen.spec.model import Spec

Array = NDArray[np.float64]
POINTS = 4096
SPEEDS = 1000


class Region:
    """Ranges of positions, velocities, inputs and time.

    Attributes:
        assumed: what no section of the spec says, in words.
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
        told = name.name.removesuffix("_load")
        if told in spec.envelope:
            low, high = spec.envelope[told]
            return float(low), float(high)
        if told == name.name:
            self.assumed.append(f"{name} in [{-half:g}, {half:g}] {unit}")
        return -half, half

    def said(self, names: set[sympy.Symbol]) -> list[str]:
        """The assumptions about these symbols."""
        return [text for text in self.assumed if text.split(" ")[0] in {s.name for s in names}]

    def speeds(self, direction: Direction) -> Array:
        """Speeds along a line, above 0 up to the highest of the region, evenly."""
        pairs = zip(direction, self._system.velocities, strict=True)
        top = sum(abs(c) * max(map(abs, self.ranges[v])) for c, v in pairs if c)
        return (np.arange(SPEEDS) + 0.5) / SPEEDS * top

    def sampled(self, expression: sympy.Expr, direction: Direction) -> Array:
        """Values at random points of the region, (POINTS,); SPEED is the magnitude of the velocity along the line."""
        rate = sympy.Add(*[sympy.Float(c) * v for c, v in zip(direction, self._system.velocities, strict=True) if c])
        rng = np.random.default_rng(0)
        symbols = list(self.ranges)
        points = np.array([rng.uniform(*self.ranges[s], POINTS) for s in symbols])
        at = casadi.SX.sym("at", len(symbols))
        names = {s: at[k] for k, s in enumerate(symbols)}
        names[SPEED] = casadi.fabs(to_casadi(rate, names))
        value = casadi.densify(to_casadi(sympy.sympify(expression), names))
        return np.asarray(casadi.Function("sampled", [at], [value])(points).full(), dtype=float).ravel()
