"""Presliding: friction that acts as a spring before it slides."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.start import bristles
from codegen.friction.coulomb import Coulomb
from codegen.friction.law import DynamicLaw, LawParameter, LawState
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude


class PreslidingLaw(DynamicLaw):
    """λ = sigma z, z' = u − (sigma/a) z |u|: Dahl's law with its stiffness as a parameter of its own."""

    name = "presliding"
    source = "Dahl 1976"
    parameters = (
        LawParameter("a", "{F}", True, "Coulomb level"),
        LawParameter("sigma", "{F}/{q}", True, "presliding stiffness"),
    )
    states = (LawState("z", "{q}", "presliding deflection"),)

    def rates(self, u: sympy.Expr, z: tuple[sympy.Expr, ...], p: Mapping[str, sympy.Expr]) -> tuple[sympy.Expr, ...]:
        return (u - p["sigma"] / p["a"] * z[0] * Magnitude(u),)

    def force(self, u: sympy.Expr, z: tuple[sympy.Expr, ...], p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return p["sigma"] * z[0]

    def state_range(
        self, top_speed: sympy.Expr, p: Mapping[str, sympy.Expr]
    ) -> tuple[tuple[sympy.Expr, sympy.Expr], ...]:
        """z' has the sign of u up to |z| = a/sigma, where it vanishes or points inwards."""
        return ((-p["a"] / p["sigma"], p["a"] / p["sigma"]),)

    def level(self, slip_speed: sympy.Expr, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return p["a"]

    def bristle_stiffness(self, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return p["sigma"]

    def slope_bound(self, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        return sympy.Integer(0)


class Presliding(Effect):
    """Dahl's law λ = sigma z, z' = u − (sigma/a) z |u| in place of the set-valued Coulomb law."""

    kind = "presliding"
    sits_on = "contact"
    equation = "λ = sigma·z, dz/dt = u − (sigma/a)·z·|u| in place of a·sgn(u)"
    signature = "hysteresis over position at each reversal, in place of a step"
    seen_over = "position"
    parameters = (EffectParameter("sigma", "{F}/{q}", "presliding stiffness", low=0.0, start=bristles),)
    confused_with = (
        Confusion("backlash", "a microscopic slow sine: presliding holds it with a force, backlash lets it go"),
        Confusion("input_delay", "a microscopic slow sine"),
        Confusion("stribeck", "a microscopic slow sine"),
        Confusion("inertia_error", "two frequencies"),
    )
    needs = "a contact whose law is coulomb; of a richer law with presliding the laws are lugre, dahl and others"

    def applies(self, system: System, place: int) -> bool:
        return isinstance(system.contacts[place].law, Coulomb)

    def add(self, system: System, place: int, p: Symbols) -> System:
        contact = system.contacts[place]
        return system.with_law(place, PreslidingLaw(), {**contact.law_parameters, "sigma": p["sigma"]})
