"""Coulomb friction: a constant level."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw


class Coulomb(ZeroMemoryLaw):
    """F = a sgn(u)."""

    name = "coulomb"
    source = "Coulomb 1785; Mentzelopoulou 1994, figure 1.1(a)"
    parameters = (LawParameter("a", "{F}", False, "level"),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Integer(0)
