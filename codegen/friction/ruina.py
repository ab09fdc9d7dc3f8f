"""Ruina's rate-and-state friction of rock."""

from __future__ import annotations

import sympy

from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.spec.functions import Magnitude, Sgn

RATE_AND_STATE = (
    LawParameter("F_0", "{F}", False, "level of steady sliding at v_0"),
    LawParameter("a", "{F}", False, "direct effect of the rate"),
    LawParameter("b", "{F}", False, "effect of the state"),
    LawParameter("L", "{q}", True, "characteristic slip"),
    LawParameter("v_0", "{q}/s", True, "reference velocity"),
)
DIVERGES = "ln(|u|/v_0) diverges at u = 0: the law has no force at standstill and through a reversal"


class Ruina(DynamicLaw):
    """F = [F_0 + a ln(|u|/v_0) + f] sgn(u), f' = −(|u|/L) [f + b ln(|u|/v_0)].

    Printed for u > 0; written here for both directions, and not regularised.
    """

    name = "ruina"
    source = "Ruina 1980; Mentzelopoulou 1994, section 1.1.2.2"
    parameters = RATE_AND_STATE
    states = (LawState("f", "{F}", "force of the state"),)
    drives = ""
    why_not = DIVERGES

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        speed = Magnitude(u)
        return (-speed / p["L"] * (z[0] + p["b"] * sympy.log(speed / p["v_0"])),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return (p["F_0"] + p["a"] * sympy.log(Magnitude(u) / p["v_0"]) + z[0]) * Sgn(u)

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """f follows −b ln(|u|/v_0), which is lowest at the top speed and has no upper bound."""
        return ((-p["b"] * sympy.log(sympy.Max(top_speed, p["v_0"]) / p["v_0"]), sympy.oo),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_0"] + (p["a"] - p["b"]) * sympy.log(slip_speed / p["v_0"])

    def slope_bound(self, p: Values) -> sympy.Expr:
        """(a − b)/|u| has no bound."""
        return sympy.Piecewise((sympy.Integer(0), sympy.Eq(p["a"], p["b"])), (sympy.oo, True))
