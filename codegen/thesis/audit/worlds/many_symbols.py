"""Several coordinates and contacts: the symbols of chapters 4, 5 and 7, here for two coordinates and three contacts.

U's elements move (``U_dot``), since U may depend on x; M⁻¹ is any symmetric matrix; g, h and ξ are symbols, with their
derivatives g_v, D and ξ_u, ξ_f as further symbols. An identity in all of them holds for the formula.
"""

from __future__ import annotations

from typing import Any

import sympy

from codegen.thesis.audit.world import column, diagonal, full, moving, rate, symmetric

n, nu = 2, 3
x, v, v_hat = column("x", n), column("v", n), column("v_hat", n)
g, g_hat, g_v = column("g", n), column("g_hat", n), full("g_v", n, n)
M_inv = symmetric("W", n)
U, U_dot = full("U", n, nu), full("U_dot", n, nu)
a, f, a_dot = column("a", nu), column("f", nu), column("a_dot", nu)
a_hat, f_hat, F_hat = column("a_hat", nu), column("f_hat", nu), column("F_hat", n)
xi, xi_hat, xi_u, xi_f = column("xi", nu), column("xi_hat", nu), column("xi_u", nu), column("xi_f", nu)
s, s_hat, d, d_hat = column("s", nu), column("s_hat", nu), column("d", nu), column("d_hat", nu)
h, h_hat = column("h", nu), column("h_hat", nu)
K_F, K_v, K_1, K_2 = full("K_F", nu, nu), full("K_v", n, n), full("K_1", n, n), full("K_2", n, n)
K_a, K_f1, K_f2 = full("K_a", nu, nu), full("K_f1", nu, n), full("K_f2", nu, n)
K_m1, K_m2 = full("K_m1", nu, n), full("K_m2", nu, n)
z, z_F, z_v, z_a, z_f, z_m = (
    column("z", n),
    column("z_F", nu),
    column("z_v", n),
    column("z_a", nu),
    column("z_f", nu),
    column("z_m", nu),
)
e_v, e_a, e_f, e_F = column("e_v", n), column("e_a", nu), column("e_f", nu), column("e_F", n)
F_dot = column("F_dot", n)

NAMES: dict[str, Any] = {
    "x": x,
    "v": v,
    "v_hat": v_hat,
    "g": g,
    "g_hat": g_hat,
    "g_v": g_v,
    "M_inv": M_inv,
    "F_hat": F_hat,
    "U": U,
    "U_T": U.T,
    "U_dot": U_dot,
    "U_dot_T": U_dot.T,
    "a": a,
    "f": f,
    "a_dot": a_dot,
    "F_dot": F_dot,
    "a_hat": a_hat,
    "f_hat": f_hat,
    "xi": xi,
    "xi_hat": xi_hat,
    "xi_f": diagonal(xi_f),
    "h": h,
    "h_hat": h_hat,
    "S": diagonal(s),
    "S_hat": diagonal(s_hat),
    "D": diagonal(d),
    "D_hat": diagonal(d_hat),
    "K_F": K_F,
    "K_v": K_v,
    "K_1": K_1,
    "K_2": K_2,
    "K_a": K_a,
    "K_f1": K_f1,
    "K_f2": K_f2,
    "K_m1": K_m1,
    "K_m2": K_m2,
    "K_inv": full("K_inv", n, n),
    "z": z,
    "z_F": z_F,
    "z_v": z_v,
    "z_a": z_a,
    "z_f": z_f,
    "z_m": z_m,
    "e_v": e_v,
    "e_a": e_a,
    "e_f": e_f,
    "e_F": e_F,
    "O": sympy.zeros(nu, nu),
    "O_F": sympy.zeros(n, n),
    "diag_a": diagonal(a),
    "diag_f": diagonal(f),
    "diag_e_a": diagonal(e_a),
    "diag_slip": diagonal(U.T * v),
}
STEADY = tuple(U_dot)
SIGNS = dict.fromkeys((*s, *s_hat), (-1, 1))


def plant_flows(force: Any) -> dict[Any, Any]:
    """x, v and U move as the plant does: M v̇ = g − F."""
    return moving(x, v) | moving(v, M_inv * (g - force)) | moving(U, U_dot)


def level_rate(velocity: Any, flows: dict[Any, Any], slope: Any, sign: Any) -> Any:
    """d h(|U'v|)/dt = D S d(U'v)/dt, by the chain rule over U and v both."""
    return diagonal(slope) * diagonal(sign) * rate(U.T * velocity, flows)
