"""Error dynamics of the observers on one mass, derived by the chain rule; errors are truth less estimate.

CFO and TO: v̇ = w − F with F = a(v) sgn(v). DFO: F = a f, ḟ = ξ(v, f); its model is ξ₁, and ``xi_1_hat`` is ξ₁ at the
estimates, which to first order is ξ₁ − ξ₁v e_v − ξ₁f e_f. ``v_dot`` is v̇, so that w = v̇ + F.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import World, jacobian_at_zero, named, rate, real, tidy
from codegen.thesis.audit.worlds.shipped import one_mass_jacobian

v, x, a, f, v_dot, a_v, F, F_dot = real("v", "x", "a", "f", "v_dot", "a_v", "F", "F_dot")
k_F, mu, k_1, k_2, k_v, k_a, k_f1, k_f2 = real("k_F", "mu", "k_1", "k_2", "k_v", "k_a", "k_f1", "k_f2")
e_v, e_a, e_f, e_F, lambda_ = real("e_v", "e_a", "e_f", "e_F", "lambda_")
z_F, z, z_a, z_f, v_hat, f_hat = real("z_F", "z", "z_a", "z_f", "v_hat", "f_hat")
xi, xi_1, xi_1_hat, xi_f, xi_v = real("xi", "xi_1", "xi_1_hat", "xi_f", "xi_v")
(s,) = real("s")  # sgn(v) = sgn(v̂) between reversals
STATIC = named((v, x, a, v_dot, a_v, F_dot, k_F, mu, k_1, k_2, k_v, e_v, e_a, e_F))
DYNAMIC = named((x, v, v_dot, a, f, k_a, k_f1, k_f2, k_v, e_v, e_a, e_f, xi, xi_1, xi_1_hat, xi_f, xi_v))
DYNAMIC |= {"a_hat": a - e_a, "f_hat": f - e_f}


def one_coulomb() -> World:
    """(2.12)–(2.13), (6.17): CFO with measured velocity."""
    estimate = z_F - k_F * Magnitude(v) ** mu
    F_estimate = (a - e_a) * Sgn(v)
    w = v_dot + a * Sgn(v)
    z_rate = k_F * mu * Magnitude(v) ** (mu - 1) * (w - F_estimate) * Sgn(v)
    flows = {v: v_dot, z_F: z_rate, x: v}
    e_a_dot = tidy(a_v * v_dot - rate(estimate, flows))
    estimate_F = estimate * Sgn(v)
    F_rate = rate(estimate_F, flows).subs(e_a, e_F * Sgn(v))
    (zdot,) = real("zdot_F")
    step = F_dot - rate(estimate_F, {v: v_dot, z_F: zdot})
    names = {**STATIC, "F": a * Sgn(v), "F_hat": F_estimate, "w": w, "zdot_F": zdot}
    names["e_rest"] = sympy.solve(e_a_dot, e_a)[0]  # where the level error settles while (∂a/∂v) v̇ lasts
    derived = {
        "e_a_dot": e_a_dot,
        "e_F_dot": tidy(F_dot - F_rate),
        "e_F_dot_step": tidy(step),
        "jacobian": e_a_dot.coeff(e_a),
    }
    halves = tuple(sympy.Rational(k, 2) for k in (-4, -2, -1, 1, 2, 3, 4, 6))
    return World(names, derived, ranges={mu: halves})


def one_tracking() -> World:
    """(2.17)–(2.18), (6.18): TO with measured velocity."""
    w = v_dot + F
    z_rate = -k_1 * v - k_2 * (w - (F - e_F))
    estimate_rate = rate(z + k_1 * x + k_2 * v, {z: z_rate, x: v, v: v_dot})
    e_F_dot = sympy.expand(F_dot - estimate_rate)
    return World({**STATIC, "F": F, "w": w}, {"e_F_dot": e_F_dot, "jacobian": e_F_dot.diff(e_F)})


def one_coulomb_estimated() -> World:
    """(3.13)–(3.21), (6.26)–(6.28): CFO with μ = 1 and the velocity observer; the sign of slip is s = ±1."""
    v_hat_rate = v_dot + e_F + k_v * e_v
    level_rate = k_F * (v_dot + e_F) * s - k_F * s * v_hat_rate  # d|v̂|/dt = sgn(v̂) dv̂/dt
    F_true_rate = a_v * v_dot * s
    e_F_dot = sympy.expand(F_true_rate - level_rate * s).subs(s**2, 1)
    rates = sympy.Matrix([sympy.expand(v_dot - v_hat_rate), e_F_dot])
    constant = rates.subs(a_v, 0)
    names = {**STATIC, "s": s, "q_2": constant[1], "q_1": constant[0], "sgn_v": s, "v_hat": v - e_v}
    names["lambda_"] = lambda_
    return World(names, _estimated(rates, constant, "cfo"), ranges={s: (-1, 1)})


def one_tracking_estimated() -> World:
    """(3.22)–(3.26), (6.29): TO with the velocity observer."""
    v_hat_rate = v_dot + e_F + k_v * e_v
    z_rate = -k_1 * (v - e_v) - k_2 * (v_dot + e_F)
    estimate_rate = rate(z + k_1 * x + k_2 * v_hat, {z: z_rate, x: v, v_hat: v_hat_rate})
    rates = sympy.Matrix([v_dot - v_hat_rate, F_dot - estimate_rate]).expand()
    return World({**STATIC, "F": F}, _estimated(rates, rates.subs(F_dot, 0), "to"))


def _estimated(rates: Any, constant: Any, kind: str) -> dict[str, Any]:
    """The rates with their Jacobian, which the project's own routine must give, too."""
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_v, e_F]), {})
    theirs = one_mass_jacobian(kind)
    if (jacobian - theirs).expand() != sympy.zeros(2, 2):
        raise ArithmeticError(f"{kind}: the chain rule gives {jacobian}, derive_error_dynamics {theirs}")
    return {
        "e_v_dot": rates[0],
        "e_F_dot": rates[1],
        "constant": constant,
        "constant_v": constant[0],
        "constant_F": constant[1],
        "jacobian": jacobian,
        "polynomial": (lambda_ * sympy.eye(2) - jacobian).det(),
    }


def one_dynamic() -> World:
    """The DFO (6.13)–(6.15) with measured velocity; its error dynamics are (6.19)–(6.23) of the thesis."""
    w, F_hat = v_dot + a * f, (a - e_a) * (f - e_f)
    z_a_rate, z_f_rate = _dynamic_states(v, w - F_hat)
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v, {z_f: z_f_rate, x: v, v: v_dot})
    a_hat_rate = rate(z_a + k_a * f_hat * v, {z_a: z_a_rate, f_hat: f_hat_rate, v: v_dot}).subs(f_hat, f - e_f)
    derived = _dynamic({"e_f_dot": xi - f_hat_rate, "e_a_dot": -a_hat_rate}, (e_f, e_a), {xi_1_hat: xi_1 - xi_f * e_f})
    return World({**DYNAMIC, "F": a * f, "F_hat": F_hat, "w": w}, derived)


def one_dynamic_estimated() -> World:
    """The DFO with the velocity observer (6.24)–(6.25); its error dynamics are (6.30)–(6.32), with their Jacobian Ψ."""
    w, F_hat = v_dot + a * f, (a - e_a) * (f - e_f)
    v_hat_rate = (w - F_hat) + k_v * e_v
    z_a_rate, z_f_rate = _dynamic_states(v - e_v, w - F_hat)
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v_hat, {z_f: z_f_rate, x: v, v_hat: v_hat_rate})
    flows = {z_a: z_a_rate, f_hat: f_hat_rate, v_hat: v_hat_rate}
    a_hat_rate = rate(z_a + k_a * f_hat * v_hat, flows).subs({f_hat: f - e_f, v_hat: v - e_v})
    rates = {"e_v_dot": v_dot - v_hat_rate, "e_a_dot": -a_hat_rate, "e_f_dot": xi - f_hat_rate}
    derived = _dynamic(rates, (e_v, e_a, e_f), {xi_1_hat: xi_1 - xi_v * e_v - xi_f * e_f})
    return World({**DYNAMIC, "F_hat": F_hat, "e_F": a * f - F_hat, "w": w}, derived)


def _dynamic_states(speed: Any, modelled: Any) -> tuple[Any, Any]:
    """ż_a and ż_f, at the velocity and the acceleration that the observer takes."""
    z_a_rate = -k_a * speed * xi_1_hat - k_a * (f - e_f) * modelled
    return z_a_rate, -k_f1 * speed - k_f2 * modelled + xi_1_hat


def _dynamic(rates: Mapping[str, Any], errors: Sequence[Any], first_order: Mapping[Any, Any]) -> dict[str, Any]:
    """The rates with their Jacobian at zero error."""
    jacobian = jacobian_at_zero(sympy.Matrix(list(rates.values())), sympy.Matrix(errors), first_order)
    expanded = {name: sympy.expand(r) for name, r in rates.items()}
    return {**expanded, "jacobian": jacobian.applyfunc(sympy.factor)}
