"""The Gaussian Stribeck curve."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from codegen.friction.stribeck import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, StribeckLaw, gaussian_slope


class Gaussian(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−(u/v_s)²) + F_v |u|] sgn(u)."""

    name = "gaussian"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return sympy.exp(-((slip_speed / p["v_s"]) ** 2))

    def steepest(self, p: Mapping[str, sympy.Expr]) -> tuple[sympy.Expr, sympy.Expr]:
        return -gaussian_slope(1 / sympy.sqrt(2), p["v_s"]), sympy.Integer(0)
