"""The LuGre law: the mean deflection of bristles, with Stribeck friction in steady sliding."""

from __future__ import annotations

import sympy

from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.spec.functions import Magnitude


class LuGre(DynamicLaw):
    """F = σ0 z + σ1 z' + σ2 u, z' = u − |u| z/g(u), σ0 g(u) = F_c + (F_s − F_c) exp(−(u/v_s)²)."""

    name = "lugre"
    source = "Canudas de Wit, Olsson, Åström and Lischinsky 1993; Mentzelopoulou 1994, section 1.1.2.2"
    parameters = (
        LawParameter("sigma_0", "{F}/{q}", True, "bristle stiffness"),
        LawParameter("sigma_1", "{F}*s/{q}", False, "bristle damping"),
        LawParameter("sigma_2", "{F}*s/{q}", False, "viscous slope"),
        LawParameter("F_c", "{F}", True, "Coulomb level"),
        LawParameter("F_s", "{F}", True, "static level"),
        LawParameter("v_s", "{q}/s", True, "Stribeck velocity"),
    )
    states = (LawState("z", "{q}", "mean deflection of the bristles"),)

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return (u - p["sigma_0"] * Magnitude(u) * z[0] / _stribeck(u, p),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["sigma_0"] * z[0] + p["sigma_1"] * self.rates(u, z, p)[0] + p["sigma_2"] * u

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """±max g: there z' = u − |u| z/g(u) is zero or points inwards, whatever u."""
        limit = sympy.Max(p["F_c"], p["F_s"]) / p["sigma_0"]
        return ((-limit, limit),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _stribeck(slip_speed, p) + p["sigma_2"] * slip_speed

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        return p["sigma_0"], p["sigma_1"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        """The Gaussian is steepest at v_s/√2, by √2 exp(−1/2) (F_s − F_c)/v_s."""
        steepest = sympy.sqrt(2) * sympy.exp(-sympy.Rational(1, 2)) * (p["F_s"] - p["F_c"]) / p["v_s"]
        return sympy.Max(abs(p["sigma_2"]), abs(p["sigma_2"] - steepest))


def _stribeck(speed: sympy.Expr, p: Values) -> sympy.Expr:
    """σ0 g: the level of steady sliding without its viscous part."""
    return p["F_c"] + (p["F_s"] - p["F_c"]) * sympy.exp(-((speed / p["v_s"]) ** 2))
