"""Extended dynamic friction: the extended Coulomb level on a normalized friction force that has dynamics."""

from __future__ import annotations

from typing import ClassVar

import sympy

from codegen.friction.dahl import Dahl
from codegen.friction.extended_coulomb import ExtendedCoulomb
from codegen.friction.law import DynamicLaw, LawParameter, Ranges, States, Values
from codegen.friction.reset_integrator import ResetIntegrator
from codegen.spec.functions import Magnitude

_LEVEL = ExtendedCoulomb()


class ExtendedDynamic(DynamicLaw):
    """F = (a1 + a2 exp(−a3 |u|) + a4 |u|) f, (A.76), f' = ξ(u, f) of Dahl's law, (6.6).

    (A.73) leaves ξ open; ``extended_reset_integrator`` has (6.5) in its place.
    """

    name = "extended_dynamic"
    source = "Mentzelopoulou 1994, (A.71), (A.75) and (A.76)"
    parameters: ClassVar[tuple[LawParameter, ...]] = (*ExtendedCoulomb.parameters, *Dahl.parameters[1:])
    states = Dahl.states
    carrier: ClassVar[DynamicLaw] = Dahl()

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return self.carrier.rates(u, z, p)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return _LEVEL.level(Magnitude(u), p) * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        return self.carrier.state_range(top_speed, p)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _LEVEL.level(slip_speed, p) * self.carrier.level(slip_speed, {**p, "a": sympy.Integer(1)})

    def slope_bound(self, p: Values) -> sympy.Expr:
        """In steady sliding f = sgn(u), so Lemma 2.1 applies unchanged."""
        return _LEVEL.slope_bound(p)


class ExtendedResetIntegrator(ExtendedDynamic):
    """F = (a1 + a2 exp(−a3 |u|) + a4 |u|) f, (A.76), f' = c [u − φ⁻¹(f)], (6.5) and (6.33)."""

    name = "extended_reset_integrator"
    source = "Mentzelopoulou 1994, (6.5), (6.33), (A.71) and (A.76)"
    parameters = (*ExtendedCoulomb.parameters, *ResetIntegrator.parameters[1:])
    states = ResetIntegrator.states
    carrier = ResetIntegrator()

    def slope_bound(self, p: Values) -> sympy.Expr:
        """None in general: f = φ(u) grows with u, and a4 |u| φ(|u|) quadratically."""
        return sympy.oo
