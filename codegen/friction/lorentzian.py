"""The Lorentzian Stribeck curve of Hess and Soom."""

from __future__ import annotations

import sympy

from codegen.friction.law import Values
from codegen.friction.stribeck import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, StribeckLaw


class Lorentzian(StribeckLaw):
    """F = [F_c + (F_s − F_c)/(1 + (u/v_s)²) + F_v |u|] sgn(u)."""

    name = "lorentzian"
    source = "Hess and Soom 1990 without their time lag; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return 1 / (1 + (slip_speed / p["v_s"]) ** 2)

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """At v_s/√3, by 3√3/(8 v_s)."""
        return -3 * sympy.sqrt(3) / (8 * p["v_s"]), sympy.Integer(0)
