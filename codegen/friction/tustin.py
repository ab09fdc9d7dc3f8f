"""Tustin's exponential decay from static to kinetic friction."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values
from codegen.friction.stribeck import COULOMB, STATIC, VISCOUS, StribeckLaw


class Tustin(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−|u|/v_c) + F_v |u|] sgn(u); Tustin has F_v = 0."""

    name = "tustin"
    source = "Tustin 1947; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, LawParameter("v_c", "{q}/s", True, "characteristic velocity"), VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-slip_speed / p["v_c"])

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        return -1 / p["v_c"], sympy.Integer(0)
