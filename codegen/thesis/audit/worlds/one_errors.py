"""One mass with Coulomb or extended Coulomb friction: error dynamics of CFO and TO by the chain rule.

The plant is v̇ = w − F with F = a(v) sgn(v); ``v_dot`` is v̇, so that w = v̇ + F. Errors are truth less estimate.
"""

from __future__ import annotations

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import Derived, World, jacobian_at_zero, rate, real, tidy
from codegen.thesis.audit.worlds.shipped import one_mass_jacobian

v, x, a, v_dot, a_v, F_dot = real("v", "x", "a", "v_dot", "a_v", "F_dot")
k_F, mu, k_1, k_2, k_v = real("k_F", "mu", "k_1", "k_2", "k_v")
e_v, e_a, e_F, z_F, z, z_v, v_hat, F_hat, a_hat = real(
    "e_v", "e_a", "e_F", "z_F", "z", "z_v", "v_hat", "F_hat", "a_hat"
)
s = real("s")[0]  # sgn(v) = sgn(v̂) between reversals
GAINS = {g.name: g for g in (v, x, a, v_dot, a_v, F_dot, k_F, mu, k_1, k_2, k_v, e_v, e_a, e_F)}


def one_coulomb() -> World:
    """(2.12)–(2.13), (6.17): CFO with measured velocity."""
    F = a * Sgn(v)
    estimate = z_F - k_F * Magnitude(v) ** mu
    F_estimate = (a - e_a) * Sgn(v)
    w = v_dot + F
    z_rate = k_F * mu * Magnitude(v) ** (mu - 1) * (w - F_estimate) * Sgn(v)
    flows = {v: v_dot, z_F: z_rate, x: v}
    e_a_dot = tidy(a_v * v_dot - rate(estimate, flows))
    level_gain = e_a_dot.coeff(e_a)
    estimate_F = estimate * Sgn(v)
    F_rate = rate(estimate_F, flows).subs(e_a, e_F * Sgn(v))
    zdot = real("zdot_F")[0]
    step = F_dot - rate(estimate_F, {v: v_dot, z_F: zdot})
    names = {**GAINS, "F": F, "F_hat": F_estimate, "w": w, "zdot_F": zdot}
    names["e_rest"] = sympy.solve(e_a_dot, e_a)[0]  # where the level error settles while (∂a/∂v) v̇ lasts
    derived = {
        "e_a_dot": _one(e_a_dot),
        "e_F_dot": _one(tidy(F_dot - F_rate)),
        "e_F_dot_step": _one(tidy(step)),
        "jacobian": _one(level_gain),
    }
    halves = tuple(sympy.Rational(k, 2) for k in (-4, -2, -1, 1, 2, 3, 4, 6))
    return World(names, derived, ranges={mu: halves})


def one_tracking() -> World:
    """(2.17)–(2.18), (6.18): TO with measured velocity."""
    F = real("F")[0]
    w = v_dot + F
    z_rate = -k_1 * v - k_2 * (w - (F - e_F))
    estimate_rate = rate(z + k_1 * x + k_2 * v, {z: z_rate, x: v, v: v_dot})
    e_F_dot = sympy.expand(F_dot - estimate_rate)
    derived = {"e_F_dot": _one(e_F_dot), "jacobian": _one(e_F_dot.diff(e_F))}
    return World({**GAINS, "F": F, "w": w}, derived)


def one_coulomb_estimated() -> World:
    """(3.13)–(3.21), (6.26)–(6.28): CFO with μ = 1 and the velocity observer; the sign of slip is s = ±1."""
    F = a * s
    w = v_dot + F
    v_estimate, F_estimate = v - e_v, F - e_F
    v_hat_rate = (-k_v * v_estimate + (w - F_estimate)) + k_v * v
    e_v_dot = sympy.expand(v_dot - v_hat_rate)
    level_rate = k_F * (w - F_estimate) * s - k_F * s * v_hat_rate  # d|v̂|/dt = sgn(v̂) dv̂/dt
    F_true_rate = a_v * v_dot * s
    e_F_dot = sympy.expand(F_true_rate - level_rate * s).subs(s**2, 1)
    rates = sympy.Matrix([e_v_dot, e_F_dot])
    constant = rates.subs(a_v, 0)
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_v, e_F]), {})
    names = {**GAINS, "s": s, "q_2": constant[1], "q_1": constant[0], "sgn_v": s, "v_hat": v_estimate}
    names["lambda_"] = real("lambda_")[0]
    return World(names, _estimated(rates, constant, jacobian, "cfo"), ranges={s: (-1, 1)})


def one_tracking_estimated() -> World:
    """(3.22)–(3.26), (6.29): TO with the velocity observer."""
    F = real("F")[0]
    w = v_dot + F
    v_estimate, F_estimate = v - e_v, F - e_F
    v_hat_rate = (-k_v * v_estimate + (w - F_estimate)) + k_v * v
    z_rate = -k_1 * v_estimate - k_2 * (w - F_estimate)
    estimate_rate = rate(z + k_1 * x + k_2 * v_hat, {z: z_rate, x: v, v_hat: v_hat_rate})
    rates = sympy.Matrix([v_dot - v_hat_rate, F_dot - estimate_rate]).expand()
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_v, e_F]), {})
    return World({**GAINS, "F": F}, _estimated(rates, rates.subs(F_dot, 0), jacobian, "to"))


def _estimated(rates: Any, constant: Any, jacobian: Any, kind: str) -> dict[str, Derived]:
    """The rates with their Jacobian, which the project's own routine must give, too."""
    theirs = one_mass_jacobian(kind)
    if (jacobian - theirs).expand() != sympy.zeros(2, 2):
        raise ArithmeticError(f"{kind}: the chain rule gives {jacobian}, derive_error_dynamics {theirs}")
    polynomial = (real("lambda_")[0] * sympy.eye(2) - jacobian).det()
    return {
        "e_v_dot": _one(rates[0]),
        "e_F_dot": _one(rates[1]),
        "constant": Derived(constant),
        "constant_v": _one(constant[0]),
        "constant_F": _one(constant[1]),
        "jacobian": Derived(jacobian),
        "polynomial": _one(polynomial),
    }


def _one(expression: Any) -> Derived:
    return Derived(sympy.Matrix([[expression]]))
