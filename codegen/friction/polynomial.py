"""Friction as a polynomial of the slip speed."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw


class Polynomial(ZeroMemoryLaw):
    """F = (a0 + a1 |u| + a2 u² + a3 |u|³) sgn(u).

    The source names a polynomial without its degree; three is what a Stribeck dip and a rise beyond it need. It holds
    over the speeds it was fitted to: outside them the level may fall below zero, and its slope has no bound.
    """

    name = "polynomial"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1 (no degree given)"
    parameters = (
        LawParameter("a0", "{F}", False, "level at standstill"),
        LawParameter("a1", "{F}*s/{q}", False, "coefficient of the speed", lowest=None),
        LawParameter("a2", "{F}*s^2/{q}^2", False, "coefficient of its square", lowest=None, default=0),
        LawParameter("a3", "{F}*s^3/{q}^3", False, "coefficient of its cube", lowest=None, default=0),
    )

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a0"] + slip_speed * (p["a1"] + slip_speed * (p["a2"] + slip_speed * p["a3"]))

    def slope_bound(self, p: Values) -> sympy.Expr:
        straight = sympy.And(sympy.Eq(p["a2"], 0), sympy.Eq(p["a3"], 0))
        return sympy.Piecewise((abs(p["a1"]), straight), (sympy.oo, True))
