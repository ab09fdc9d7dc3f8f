"""The thesis' extended Coulomb friction: static, Stribeck and viscous parts in one even level."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw


class ExtendedCoulomb(ZeroMemoryLaw):
    """F = (a1 + a2 exp(−a3 |u|) + a4 |u|) sgn(u), (2.5)."""

    name = "extended_coulomb"
    source = "Mentzelopoulou 1994, (2.5); bound: Lemma 2.1, (2.16)"
    parameters = (
        LawParameter("a1", "{F}", False, "Coulomb level"),
        LawParameter("a2", "{F}", False, "Stribeck rise at standstill"),
        LawParameter("a3", "s/{q}", True, "inverse of the Stribeck velocity"),
        LawParameter("a4", "{F}*s/{q}", False, "viscous slope"),
    )

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a1"] + p["a2"] * sympy.exp(-p["a3"] * slip_speed) + p["a4"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Max(abs(p["a4"] - p["a2"] * p["a3"]), abs(p["a4"]))
