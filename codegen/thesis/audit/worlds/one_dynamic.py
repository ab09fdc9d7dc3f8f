"""Error dynamics of the dynamic friction observer (DFO) on one mass, derived by the chain rule.

    v̇ = w − F,  F = a f,  ḟ = ξ(v, f)

The observer's model is ξ₁; ``xi_1_hat`` is ξ₁ at the estimates, which to first order is ξ₁ − ξ₁v e_v − ξ₁f e_f.
"""

from __future__ import annotations

from typing import Any

import sympy

from codegen.thesis.audit.world import Derived, World, jacobian_at_zero, rate, real

x, v, v_dot, a, f, F_dot = real("x", "v", "v_dot", "a", "f", "F_dot")
k_a, k_f1, k_f2, k_v = real("k_a", "k_f1", "k_f2", "k_v")
e_v, e_a, e_f = real("e_v", "e_a", "e_f")
z_a, z_f, v_hat, f_hat = real("z_a", "z_f", "v_hat", "f_hat")
xi, xi_1, xi_1_hat, xi_f, xi_v = real("xi", "xi_1", "xi_1_hat", "xi_f", "xi_v")
SYMBOLS = (x, v, v_dot, a, f, k_a, k_f1, k_f2, k_v, e_v, e_a, e_f, xi, xi_1, xi_1_hat, xi_f, xi_v)
ESTIMATES = {"a_hat": a - e_a, "f_hat": f - e_f}


def one_dynamic() -> World:
    """The DFO (6.13)–(6.15) with measured velocity; its error dynamics are (6.19)–(6.23) of the thesis."""
    w = v_dot + a * f
    F_hat = (a - e_a) * (f - e_f)
    z_a_rate = -k_a * v * xi_1_hat - k_a * (f - e_f) * (w - F_hat)
    z_f_rate = -k_f1 * v - k_f2 * (w - F_hat) + xi_1_hat
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v, {z_f: z_f_rate, x: v, v: v_dot})
    a_hat_rate = rate(z_a + k_a * f_hat * v, {z_a: z_a_rate, f_hat: f_hat_rate, v: v_dot}).subs(f_hat, f - e_f)
    rates = sympy.Matrix([xi - f_hat_rate, -a_hat_rate])
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_f, e_a]), {xi_1_hat: xi_1 - xi_f * e_f})
    names = {**{s.name: s for s in SYMBOLS}, **ESTIMATES, "F": a * f, "F_hat": F_hat, "w": w}
    return World(names, _derived(rates, jacobian, ("e_f_dot", "e_a_dot")))


def one_dynamic_estimated() -> World:
    """The DFO with the velocity observer (6.24)–(6.25); its error dynamics are (6.30)–(6.32), with their Jacobian Ψ."""
    w = v_dot + a * f
    F_hat = (a - e_a) * (f - e_f)
    v_estimate = v - e_v
    v_hat_rate = (w - F_hat) - k_v * v_estimate + k_v * v
    z_a_rate = -k_a * v_estimate * xi_1_hat - k_a * (f - e_f) * (w - F_hat)
    z_f_rate = -k_f1 * v_estimate - k_f2 * (w - F_hat) + xi_1_hat
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v_hat, {z_f: z_f_rate, x: v, v_hat: v_hat_rate})
    flows = {z_a: z_a_rate, f_hat: f_hat_rate, v_hat: v_hat_rate}
    a_hat_rate = rate(z_a + k_a * f_hat * v_hat, flows).subs({f_hat: f - e_f, v_hat: v_estimate})
    rates = sympy.Matrix([v_dot - v_hat_rate, -a_hat_rate, xi - f_hat_rate])
    first_order = {xi_1_hat: xi_1 - xi_v * e_v - xi_f * e_f}
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_v, e_a, e_f]), first_order)
    names = {**{s.name: s for s in SYMBOLS}, **ESTIMATES, "F_hat": F_hat, "e_F": a * f - F_hat, "w": w}
    return World(names, _derived(rates, jacobian, ("e_v_dot", "e_a_dot", "e_f_dot")))


def _derived(rates: Any, jacobian: Any, names: tuple[str, ...]) -> dict[str, Derived]:
    expanded = [sympy.expand(r) for r in rates]
    derived = {name: Derived(sympy.Matrix([[r]])) for name, r in zip(names, expanded, strict=True)}
    return derived | {"jacobian": Derived(jacobian.applyfunc(sympy.factor))}
