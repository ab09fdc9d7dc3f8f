"""Laws of zero memory, λ = level(|u|) sgn(u): Coulomb, viscous and Stribeck friction."""

from abc import abstractmethod

import sympy

from codegen.friction.law import LawParameter, Values, ZeroMemoryLaw, at_speed
from codegen.spec.functions import Sgn

COULOMB = LawParameter("F_c", "{F}", False, "Coulomb (kinetic) level")
STATIC = LawParameter("F_s", "{F}", False, "static level")
VISCOUS = LawParameter("F_v", "{F}*s/{q}", False, "viscous slope", default=0)
STRIBECK_VELOCITY = LawParameter("v_s", "{q}/s", True, "Stribeck velocity")


class Coulomb(ZeroMemoryLaw):
    """F = a sgn(u)."""

    name = "coulomb"
    source = "Coulomb 1785; Mentzelopoulou 1994, figure 1.1(a)"
    parameters = (LawParameter("a", "{F}", False, "level"),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"]


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

    def largest_level(self, fastest: sympy.Expr, p: Values) -> sympy.Expr:
        """a1 + a2, and the viscous part at the highest speed."""
        return p["a1"] + p["a2"] + at_speed(p["a4"], fastest)


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


class Canudas(ZeroMemoryLaw):
    """F = (α0 + α1 √|u| + α2 |u|) sgn(u).

    α1 < 0 gives the downward bend; its slope is unbounded at standstill. The level stays positive if α1² < 4 α0 α2.
    """

    name = "canudas"
    source = (
        "Canudas de Wit, Noel, Aubin and Brogliato 1991; Mentzelopoulou 1994, section 1.1.1 (in words; "
        "the exponent 1/2 is not printed there)"
    )
    parameters = (
        LawParameter("alpha_0", "{F}", False, "level at standstill"),
        LawParameter("alpha_1", "{F}*(s/{q})^0.5", False, "coefficient of the bend", lowest=None),
        LawParameter("alpha_2", "{F}*s/{q}", False, "viscous slope"),
    )

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["alpha_0"] + p["alpha_1"] * sympy.sqrt(slip_speed) + p["alpha_2"] * slip_speed

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Piecewise((p["alpha_2"], sympy.Eq(p["alpha_1"], 0)), (sympy.oo, True))


class StribeckLaw(ZeroMemoryLaw):
    """A Stribeck curve F = [F_c + (F_s − F_c) s(|u|) + F_v |u|] sgn(u), with 0 ≤ s ≤ 1 and s → 0 at high speed."""

    @abstractmethod
    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        """s(|u|), dimensionless."""

    @abstractmethod
    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """The lowest and the highest slope of s, in s / slip unit."""

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_c"] + (p["F_s"] - p["F_c"]) * self.shape(slip_speed, p) + p["F_v"] * slip_speed

    def largest_level(self, fastest: sympy.Expr, p: Values) -> sympy.Expr:
        """The larger of F_c and F_s, and the viscous part at the highest speed."""
        return sympy.Max(p["F_c"], p["F_s"]) + at_speed(p["F_v"], fastest)

    def slope_bound(self, p: Values) -> sympy.Expr:
        """max |F_v + (F_s − F_c) s'|, which is at an end of the range of s'."""
        falling, rising = self.steepest(p)
        rise = p["F_s"] - p["F_c"]
        return sympy.Max(abs(p["F_v"] + rise * falling), abs(p["F_v"] + rise * rising))


class Tustin(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−|u|/v_c) + F_v |u|] sgn(u); Tustin has F_v = 0."""

    name = "tustin"
    source = "Tustin 1947; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, LawParameter("v_c", "{q}/s", True, "characteristic velocity"), VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-slip_speed / p["v_c"])

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        return -1 / p["v_c"], sympy.Integer(0)


class BoPavelescu(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−(|u|/α)^n) + F_v |u|] sgn(u); Bo and Pavelescu have F_v = 0.

    They found n between 0.5 and 1, Armstrong-Hélouvry used 2, Fuller suggests a large n under effective lubrication.
    For n < 1 the slope is unbounded at standstill.
    """

    name = "bo_pavelescu"
    source = "Bo and Pavelescu 1982; Mentzelopoulou 1994, section 1.1.1"
    parameters = (
        COULOMB,
        STATIC,
        LawParameter("alpha", "{q}/s", True, "velocity at which 1/e of the rise is left"),
        LawParameter("n", "1", True, "exponent"),
        VISCOUS,
    )

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-((slip_speed / p["alpha"]) ** p["n"]))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """For n ≥ 1: −n q^q exp(−q)/α, at (u/α)^n = q = 1 − 1/n."""
        q = sympy.Max(p["n"] - 1, 0) / p["n"]
        return -p["n"] * q**q * sympy.exp(-q) / p["alpha"], sympy.Integer(0)

    def slope_bound(self, p: Values) -> sympy.Expr:
        unbounded = sympy.And(p["n"] < 1, sympy.Ne(p["F_s"], p["F_c"]))
        return sympy.Piecewise((sympy.oo, unbounded), (super().slope_bound(p), True))


class Lorentzian(StribeckLaw):
    """F = [F_c + (F_s − F_c)/(1 + (u/v_s)²) + F_v |u|] sgn(u)."""

    name = "lorentzian"
    source = "Hess and Soom 1990 without their time lag; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return 1 / (1 + (slip_speed / p["v_s"]) ** 2)

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """−3√3/(8 v_s), at v_s/√3."""
        return -3 * sympy.sqrt(3) / (8 * p["v_s"]), sympy.Integer(0)


class Gaussian(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−(u/v_s)²) + F_v |u|] sgn(u)."""

    name = "gaussian"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1"
    parameters = (COULOMB, STATIC, STRIBECK_VELOCITY, VISCOUS)

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-((slip_speed / p["v_s"]) ** 2))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        return -gaussian_slope(1 / sympy.sqrt(2), p["v_s"]), sympy.Integer(0)


class GaussianOffset(StribeckLaw):
    """F = [F_c + (F_s − F_c) exp(−((|u| − v_0)/v_s)²) + F_v |u|] sgn(u).

    The level F_s is reached at the speed v_0; below it friction rises with speed.
    """

    name = "gaussian_offset"
    source = "Armstrong-Hélouvry 1991; Mentzelopoulou 1994, section 1.1.1"
    parameters = (
        COULOMB,
        STATIC,
        STRIBECK_VELOCITY,
        LawParameter("v_0", "{q}/s", False, "speed of the crest"),
        VISCOUS,
    )

    def shape(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return sympy.exp(-(((slip_speed - p["v_0"]) / p["v_s"]) ** 2))

    def steepest(self, p: Values) -> tuple[sympy.Expr, sympy.Expr]:
        """Lowest: v_s/√2 above the maximum at v_0; highest: v_s/√2 below it, or at standstill if that is nearer."""
        before = sympy.Min(p["v_0"] / p["v_s"], 1 / sympy.sqrt(2))
        return -gaussian_slope(1 / sympy.sqrt(2), p["v_s"]), gaussian_slope(before, p["v_s"])


def gaussian_slope(scaled_speed: sympy.Expr, width: sympy.Expr) -> sympy.Expr:
    """|d/du exp(−(u/width)²)| at u = scaled_speed · width; largest, √2 exp(−1/2)/width, at 1/√2."""
    return 2 * scaled_speed * sympy.exp(-(scaled_speed**2)) / width
