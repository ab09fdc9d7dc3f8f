"""The reset integrator: slip is integrated into a deflection that cannot exceed the one of steady sliding."""

from __future__ import annotations

import sympy

from codegen.friction.dahl import PRESLIDING
from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.spec.functions import Magnitude


class ResetIntegrator(DynamicLaw):
    """F = a f, f' = c [u − φ⁻¹(f)], (6.5), φ⁻¹ piecewise linear: slope D2 for |f| < 1, D1 beyond, (6.33).

    The thesis prints φ⁻¹(v) in chapter 1; (6.5) has φ⁻¹(f), which alone has the dimension and the limit. As
    φ⁻¹(f) = D2 f + (D1 − D2) dz(f) with the dead zone dz(f) = f − (|f + 1| − |f − 1|)/2, no case distinction is needed.
    """

    name = "reset_integrator"
    source = "Haessig and Friedland 1991; Mentzelopoulou 1994, (6.5) and (6.33)"
    parameters = (
        LawParameter("a", "{F}", False, "Coulomb level"),
        PRESLIDING,
        LawParameter("D1", "{q}/s", True, "slope of φ⁻¹ beyond the level", default=1000),
        LawParameter("D2", "{q}/s", True, "slope of φ⁻¹ within the level: the creep speed at it", default="0.0001"),
    )
    states = (LawState("f", "1", "normalized friction force"),)
    scale = "a"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        f = z[0]
        dead_zone = f - (Magnitude(f + 1) - Magnitude(f - 1)) / 2
        return (p["c"] * (u - p["D2"] * f - (p["D1"] - p["D2"]) * dead_zone),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["a"] * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """±φ(top speed): there f' = c (u ∓ top speed) points inwards, as φ⁻¹ is monotone."""
        limit = _phi(top_speed, p)
        return ((-limit, limit),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"] * _phi(slip_speed, p)

    def in_sliding(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """Beyond D2 f stays above 1, and f'' = c (u' − D1 f'): f' comes within |u'|/D1 at the rate c D1."""
        return p["D2"], p["a"] / p["D1"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return p["a"] * sympy.Max(1 / p["D1"], 1 / p["D2"])


def _phi(speed: sympy.Expr, p: Values) -> sympy.Expr:
    """φ for speed ≥ 0: speed/D2 up to D2, then 1 + (speed − D2)/D1."""
    below = (Magnitude(speed - p["D2"]) - (speed - p["D2"])) / 2
    return 1 + (speed - p["D2"]) / p["D1"] - below * (1 / p["D2"] - 1 / p["D1"])
