"""Walrath's rolling friction of a bearing: Coulomb friction through a first-order lag."""

from __future__ import annotations

import sympy

from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.spec.functions import Sgn


class Walrath(DynamicLaw):
    """τ F' = −F + T sgn(u), here with F = T f: f' = (sgn(u) − f)/τ."""

    name = "walrath"
    source = "Walrath 1984; Mentzelopoulou 1994, section 1.1.2.2"
    parameters = (
        LawParameter("T", "{F}", False, "rolling friction level"),
        LawParameter("tau", "s", True, "time constant"),
    )
    states = (LawState("f", "1", "normalized friction force"),)
    scale = "T"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return ((Sgn(u) - z[0]) / p["tau"],)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["T"] * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        return ((sympy.Integer(-1), sympy.Integer(1)),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["T"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Integer(0)
