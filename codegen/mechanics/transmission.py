"""Compliant transmission of one coordinate: a spring, with or without backlash, between motor and load."""

from dataclasses import dataclass

import sympy

from codegen.spec.functions import Magnitude, Sgn


@dataclass(frozen=True)
class Transmission:
    """Spring and damper between the motor, whose position is the coordinate, and its load.

    Attributes:
        coordinate: index of the coordinate. Encoder, inputs, damping and contacts are at the motor.
        stiffness, damping: k and c, force unit per coordinate unit (times s).
        load_fraction: ρ: the load has the inertia ρM, the motor (1 − ρ)M.
        gap: full width of the backlash, in the coordinate's unit; 0 for none.
        limit: force that the damper approaches at high speeds, as of a belt that slips; 0 for none.
    """

    coordinate: int
    stiffness: sympy.Expr
    damping: sympy.Expr
    load_fraction: sympy.Expr
    gap: sympy.Expr = sympy.S.Zero
    limit: sympy.Expr = sympy.S.Zero

    def force(self, deflection: sympy.Expr, rate: sympy.Expr) -> sympy.Expr:
        """The force F at the deflection dx = x − x_load and its rate dx': −F acts on the motor, +F on the load.

        Without backlash k dx + c dx', or with a limit k dx + c dx'/(1 + |c dx'|/limit). With backlash
        sgn(dx) max(0, k p + c p') where p = |dx| − gap/2 > 0, else 0.
        """
        if self.gap == 0:
            drag = self.damping * rate
            slipping = drag if self.limit == 0 else drag / (1 + Magnitude(drag) / self.limit)
            return self.stiffness * deflection + slipping
        side, depth = Sgn(deflection), Magnitude(deflection) - self.gap / 2
        push = self.stiffness * depth + self.damping * side * rate
        return side * (1 + Sgn(depth)) / 2 * (push + Magnitude(push)) / 2
