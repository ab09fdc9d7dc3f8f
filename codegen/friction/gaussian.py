"""The Gaussian Stribeck curve."""

from __future__ import annotations

import sympy

from codegen.friction.law import Values
from codegen.friction.stribeck import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, StribeckLaw, gaussian_slope


class Gaussian(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−(u/v_s)²) + F_v |u|] sgn(u)."""

    name = "gaussian"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-((slip_speed / p["v_s"]) ** 2))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        return -gaussian_slope(1 / sympy.sqrt(2), p["v_s"]), sympy.Integer(0)
