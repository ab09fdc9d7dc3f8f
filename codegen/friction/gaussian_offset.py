"""The Gaussian Stribeck curve with its maximum away from standstill."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values
from codegen.friction.stribeck import COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS, StribeckLaw, gaussian_slope


class GaussianOffset(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−((|u| − v_0)/v_s)²) + F_v |u|] sgn(u).

    The level F_s is reached at the speed v_0; below it friction rises with speed.
    """

    name = "gaussian_offset"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1"
    parameters = (
        COULOMB,
        STATIC,
        STRIBECK_VELOCITY,
        LawParameter("v_0", "{q}/s", False, "speed of the crest"),
        VISCOUS,
    )

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-(((slip_speed - p["v_0"]) / p["v_s"]) ** 2))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """Falling: v_s/√2 beyond the crest. Rising: as far before it, or at standstill where the crest is nearer."""
        before = sympy.Min(p["v_0"] / p["v_s"], 1 / sympy.sqrt(2))
        return -gaussian_slope(1 / sympy.sqrt(2), p["v_s"]), gaussian_slope(before, p["v_s"])
