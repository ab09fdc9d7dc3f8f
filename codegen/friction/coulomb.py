"""Coulomb friction: a constant level."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from codegen.friction.law import LawParameter, ZeroMemoryLaw


class Coulomb(ZeroMemoryLaw):
    """F = a sgn(u)."""

    name = "coulomb"
    source = "Coulomb 1785; Mentzelopoulou 1994, figure 1.1(a)"
    parameters = (LawParameter("a", "{F}", False, "level"),)

    def level(self, slip_speed: sympy.Expr, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return p["a"]

    def slope_bound(self, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return sympy.Integer(0)
