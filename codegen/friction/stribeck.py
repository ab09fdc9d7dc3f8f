"""The family of Stribeck curves: Coulomb level, a rise towards standstill of some shape, and a viscous slope."""

from __future__ import annotations

from abc import abstractmethod

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw

COULOMB = LawParameter("F_c", "{F}", False, "Coulomb (kinetic) level")
STATIC = LawParameter("F_s", "{F}", False, "static level")
VISCOUS = LawParameter("F_v", "{F}*s/{q}", False, "viscous slope", default=0)
STRIBECK_VELOCITY = LawParameter("v_s", "{q}/s", True, "Stribeck velocity")


class StribeckLaw(ZeroMemoryLaw):
    """F = [F_c + (F_s − F_c) s(|u|) + F_v |u|] sgn(u) with a shape 0 ≤ s ≤ 1 that vanishes at high speed."""

    @abstractmethod
    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """s(|u|), dimensionless."""

    @abstractmethod
    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """The lowest and the highest slope of s, in s / slip unit."""

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_c"] + (p["F_s"] - p["F_c"]) * self.shape(slip_speed, p) + p["F_v"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        """The slope is F_v + (F_s − F_c) s', which is largest in magnitude at an end of the range of s'."""
        falling, rising = self.steepest(p)
        rise = p["F_s"] - p["F_c"]
        return sympy.Max(abs(p["F_v"] + rise * falling), abs(p["F_v"] + rise * rising))


def gaussian_slope(scaled_speed: sympy.Expr, width: sympy.Expr) -> sympy.Expr:
    """|d/du exp(−(u/width)²)| at u = scaled_speed · width; largest, √2 exp(−1/2)/width, at 1/√2."""
    return 2 * scaled_speed * sympy.exp(-(scaled_speed**2)) / width
