"""What stands between a command and the input that acts: delay → gain → dead zone → saturation → first-order lag."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import sympy

from codegen.spec.functions import Magnitude

Stage = Literal["delay", "gain", "dead_zone", "saturation", "lag"]


@dataclass(frozen=True)
class Actuator:
    """The chain of one input, in this order whatever the order in which its stages are declared.

    Two of a kind act one after the other: delays add up, gains multiply, dead zones add up, the smaller limit holds.

    Attributes:
        delay: T, s.
        gain: 1 if there is none.
        dead_zone: width, input's unit.
        limits: of saturation, input's unit.
        lag: tau, s; None if there is none.
    """

    delay: sympy.Expr = sympy.S.Zero
    gain: sympy.Expr = sympy.S.One
    dead_zone: sympy.Expr = sympy.S.Zero
    limits: tuple[sympy.Expr, ...] = ()
    lag: sympy.Expr | None = None

    def with_stage(self, stage: Stage, parameter: sympy.Expr) -> Actuator:
        """The chain with one more stage.

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
                return replace(self, limits=(*self.limits, parameter))
            case "lag":
                if self.lag is not None:
                    raise ValueError("a second lag on one input")
                return replace(self, lag=parameter)

    @property
    def has_memory(self) -> bool:
        return self.delay != 0 or self.lag is not None

    def static(self, w: sympy.Expr) -> sympy.Expr:
        """Gain, dead zone and saturation of a command; clip(w, −L, L) is (|w + L| − |w − L|)/2."""
        w = self.gain * w
        if self.dead_zone != 0:
            w = w - _clipped(w, self.dead_zone)
        for limit in self.limits:
            w = _clipped(w, limit)
        return w


def _clipped(w: sympy.Expr, limit: sympy.Expr) -> sympy.Expr:
    return (Magnitude(w + limit) - Magnitude(w - limit)) / 2
