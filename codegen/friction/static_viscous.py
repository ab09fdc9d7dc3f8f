"""Static, kinetic and viscous friction: the basic zero-memory law."""

from __future__ import annotations

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw
from codegen.friction.stribeck import COULOMB
from codegen.spec.functions import Sgn


class StaticViscous(ZeroMemoryLaw):
    """F = (F_c + F_v |u|) sgn(u) for u ≠ 0, |F| ≤ F_s at u = 0.

    The bound on the slope holds between reversals; at u = 0 the level jumps from F_s to F_c.
    """

    name = "static_viscous"
    source = "Morin 1833 and Reynolds 1866; Mentzelopoulou 1994, figure 1.1(b)"
    parameters = (
        COULOMB,
        LawParameter("F_s", "{F}", False, "static level: what must be overcome to leave standstill"),
        LawParameter("F_v", "{F}*s/{q}", False, "viscous slope"),
    )

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_c"] + (p["F_s"] - p["F_c"]) * (1 - Sgn(slip_speed)) + p["F_v"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return p["F_v"]
