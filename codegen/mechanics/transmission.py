"""A spring between a motor and its load, with play or without: of one coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from codegen.spec.functions import Magnitude, Sgn


@dataclass(frozen=True)
class Transmission:
    """Between the motor, whose position is the coordinate, and its load.

    Attributes:
        coordinate: index of the motor's position; encoder, inputs, damping and contacts are at the motor.
        stiffness, damping: k, c.
        load_fraction: ρ: ρM at the load, (1 − ρ)M at the motor.
        gap: full width of the play; 0 for none.
    """

    coordinate: int
    stiffness: sympy.Expr
    damping: sympy.Expr
    load_fraction: sympy.Expr
    gap: sympy.Expr = sympy.S.Zero

    def force(self, deflection: sympy.Expr, rate: sympy.Expr) -> sympy.Expr:
        """What pulls the motor back and the load on, at dx = x − x_load and its rate.

        With play: sgn(dx) max(0, k p + c p') where p = |dx| − gap/2 > 0, else none.
        """
        if self.gap == 0:
            return self.stiffness * deflection + self.damping * rate
        side, depth = Sgn(deflection), Magnitude(deflection) - self.gap / 2
        push = self.stiffness * depth + self.damping * side * rate
        return side * (1 + Sgn(depth)) / 2 * (push + Magnitude(push)) / 2
