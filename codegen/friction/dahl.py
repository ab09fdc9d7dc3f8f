"""Dahl's solid friction: a spring that yields towards the Coulomb level."""

from __future__ import annotations

import sympy

from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.spec.functions import Magnitude, Sgn

PRESLIDING = LawParameter(
    "c", "1/{q}", True, "inverse of the presliding distance; the hysteresis is the wider the smaller c"
)


class Dahl(DynamicLaw):
    """F = a f, f' = c u |1 − f sgn(u)|^i sgn(1 − f sgn(u)), (1.1), (1.2) and (6.6) with φ = sgn.

    For i ≥ 1 the level is approached but never reached; for i < 1 it is reached in finite slip, and ∂ξ/∂f is unbounded
    there.
    """

    name = "dahl"
    source = "Dahl 1976; Mentzelopoulou 1994, (1.1) and (6.6)"
    parameters = (
        LawParameter("a", "{F}", False, "Coulomb level"),
        PRESLIDING,
        LawParameter("i", "1", False, "exponent of the presliding curve", default=1),
    )
    states = (LawState("f", "1", "normalized friction force"),)
    scale = "a"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        gap = 1 - z[0] * Sgn(u)
        odd = p["i"].is_Integer and p["i"] % 2 == 1  # then |gap|^i sgn(gap) is gap^i, with its slope at a gap of zero
        power = gap ** p["i"] if odd else Magnitude(gap) ** p["i"] * Sgn(gap)
        return (p["c"] * u * power,)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["a"] * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """f' has the sign of u up to |f| = 1, where it vanishes or points inwards."""
        return ((sympy.Integer(-1), sympy.Integer(1)),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"]

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """With the exponent 1, z = f/c: z' = u − |u| c z."""
        return (p["a"] * p["c"], sympy.Integer(0)) if p["i"] == 1 else None

    def slope_bound(self, p: Values) -> sympy.Expr:
        return sympy.Integer(0)
