"""Bo and Pavelescu's exponential decay with a free exponent."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values
from codegen.friction.stribeck import COULOMB, STATIC, VISCOUS, StribeckLaw


class BoPavelescu(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−(|u|/α)^n) + F_v |u|] sgn(u); Bo and Pavelescu have F_v = 0.

    They found n between 0.5 and 1, Armstrong-Hélouvry used 2, Fuller suggests a large n under effective lubrication.
    For n < 1 the slope is unbounded at standstill.
    """

    name = "bo_pavelescu"
    source = "Bo and Pavelescu 1982; Mentzelopoulou 1994, section 1.1.1"
    parameters = (
        COULOMB,
        STATIC,
        LawParameter("alpha", "{q}/s", True, "velocity at which 1/e of the rise is left"),
        LawParameter("n", "1", True, "exponent"),
        VISCOUS,
    )

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-((slip_speed / p["alpha"]) ** p["n"]))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """For n ≥ 1: where (u/α)^n = q = 1 − 1/n, by n q^q exp(−q)/α."""
        q = sympy.Max(p["n"] - 1, 0) / p["n"]
        return -p["n"] * q**q * sympy.exp(-q) / p["alpha"], sympy.Integer(0)

    def slope_bound(self, p: Values) -> sympy.Expr:
        unbounded = sympy.And(p["n"] < 1, sympy.Ne(p["F_s"], p["F_c"]))
        return sympy.Piecewise((sympy.oo, unbounded), (super().slope_bound(p), True))
