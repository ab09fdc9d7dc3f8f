"""Linker and Dieterich's rate-and-state friction, whose state is the age of the contacts."""

from __future__ import annotations

import sympy

from codegen.friction.law import DynamicLaw, LawState, Ranges, States, Values
from codegen.friction.ruina import DIVERGES, RATE_AND_STATE
from codegen.spec.functions import Magnitude, Sgn


class LinkerDieterich(DynamicLaw):
    """F = [F_0 + a ln(|u|/v_0) + b ln(θ v_0/L)] sgn(u), θ' = 1 − |u| θ/L, under a constant normal load.

    The source adds −α θ N'/(b N) to θ' for a normal load N that varies; a contact of a spec has a constant one, and
    F_0, a and b are the source's coefficients times it. Not regularised.
    """

    name = "linker_dieterich"
    source = "Linker and Dieterich 1992; Mentzelopoulou 1994, section 1.1.2.2 (in words)"
    parameters = RATE_AND_STATE
    states = (LawState("theta", "s", "age of the contacts"),)
    drives = ""
    why_not = DIVERGES

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return (1 - Magnitude(u) * z[0] / p["L"],)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        rate = p["a"] * sympy.log(Magnitude(u) / p["v_0"])
        return (p["F_0"] + rate + p["b"] * sympy.log(z[0] * p["v_0"] / p["L"])) * Sgn(u)

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """θ follows L/|u|, which is lowest at the top speed; at rest it grows without bound."""
        return ((p["L"] / sympy.Max(top_speed, p["v_0"]), sympy.oo),)

    def rest_state(self, p: Values) -> States:
        """The age in steady sliding at v_0: at rest it has no stationary value."""
        return (p["L"] / p["v_0"],)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_0"] + (p["a"] - p["b"]) * sympy.log(slip_speed / p["v_0"])

    def slope_bound(self, p: Values) -> sympy.Expr:
        """(a − b)/|u| has no bound."""
        return sympy.Piecewise((sympy.Integer(0), sympy.Eq(p["a"], p["b"])), (sympy.oo, True))
