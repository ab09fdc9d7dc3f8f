"""The actuator chain from a command to the input that acts: delay → gain → dead zone → saturation → first-order lag."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import sympy

from codegen.spec.functions import Magnitude

Stage = Literal["delay", "gain", "dead_zone", "saturation", "lag"]


@dataclass(frozen=True)
class Limit:
    """A saturation. height: input's unit; rounding: from 0 for a sharp corner to below 1."""

    height: sympy.Expr
    rounding: sympy.Expr = sympy.S.Zero

    def of(self, w: sympy.Expr) -> sympy.Expr:
        """The input that passes; clip(w, −L, L) is (|w + L| − |w − L|)/2."""
        if self.rounding == 0:
            return (Magnitude(w + self.height) - Magnitude(w - self.height)) / 2
        steep = sympy.sqrt(1 - self.rounding**2)
        corner, width = self.height * steep, self.height * self.rounding
        return (sympy.sqrt((w + corner) ** 2 + width**2) - sympy.sqrt((w - corner) ** 2 + width**2)) / (2 * steep)


@dataclass(frozen=True)
class Actuator:
    """The chain of one input, in this order whatever the order in which its stages are declared.

    Two of a kind act one after the other: delays add up, gains multiply, dead zones add up.

    Attributes:
        delay: T, s.
        gain: 1 if there is none.
        dead_zone: width, input's unit.
        limits: of saturation, one after the other.
        lag: tau, s; None if there is none.
    """

    delay: sympy.Expr = sympy.S.Zero
    gain: sympy.Expr = sympy.S.One
    dead_zone: sympy.Expr = sympy.S.Zero
    limits: tuple[Limit, ...] = ()
    lag: sympy.Expr | None = None

    def with_stage(self, stage: Stage, parameter: sympy.Expr, *shape: sympy.Expr) -> Actuator:
        """The chain with one more stage.

        Args:
            shape: a saturation's rounding, where it has one.

        Raises:
            ValueError: for a second lag.
        """
        match stage:
            case "delay":
                return replace(self, delay=self.delay + parameter)
            case "gain":
                return replace(self, gain=self.gain * parameter)
            case "dead_zone":
                return replace(self, dead_zone=self.dead_zone + parameter)
            case "saturation":
                return replace(self, limits=(*self.limits, Limit(parameter, *shape)))
            case "lag":
                if self.lag is not None:
                    raise ValueError("a second lag on one input")
                return replace(self, lag=parameter)

    @property
    def has_memory(self) -> bool:
        return self.delay != 0 or self.lag is not None

    def static(self, w: sympy.Expr) -> sympy.Expr:
        """Gain, dead zone and saturation of a command."""
        w = self.gain * w
        if self.dead_zone != 0:
            w = w - Limit(self.dead_zone).of(w)
        for limit in self.limits:
            w = limit.of(w)
        return w

    @property
    def numbers(self) -> tuple[sympy.Expr, ...]:
        """Delay, gain, dead zone, lag (0 for none), then height and rounding of each limit."""
        pairs = [number for limit in self.limits for number in (limit.height, limit.rounding)]
        return (self.delay, self.gain, self.dead_zone, self.lag or sympy.S.Zero, *pairs)
