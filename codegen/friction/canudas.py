"""Canudas de Wit's law, linear in its parameters, with a level that falls at low velocity."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw


class Canudas(ZeroMemoryLaw):
    """F = (α0 + α1 √|u| + α2 |u|) sgn(u).

    α1 < 0 gives the downward bend; its slope is unbounded at standstill. The level stays positive if α1² < 4 α0 α2.
    """

    name = "canudas"
    source = (
        "Canudas de Wit, Noel, Aubin and Brogliato 1991; Mentzelopoulou 1994, section 1.1.1 (in words; "
        "the exponent 1/2 is not printed there)"
    )
    parameters = (
        LawParameter("alpha_0", "{F}", False, "level at standstill"),
        LawParameter("alpha_1", "{F}*(s/{q})^0.5", False, "coefficient of the bend", lowest=None),
        LawParameter("alpha_2", "{F}*s/{q}", False, "viscous slope"),
    )

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["alpha_0"] + p["alpha_1"] * sympy.sqrt(slip_speed) + p["alpha_2"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Piecewise((p["alpha_2"], sympy.Eq(p["alpha_1"], 0)), (sympy.oo, True))
