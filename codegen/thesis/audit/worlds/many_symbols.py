"""Several coordinates and contacts: the symbols of chapters 4, 5 and 7, here for two coordinates and three contacts.

U's elements move (``U_dot``), since U may depend on x; M⁻¹ is any symmetric matrix; g, h and ξ are symbols, with their
derivatives g_v, D and ξ_u, ξ_f as further symbols. An identity in all of them holds for the formula.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy

from codegen.thesis.audit.world import column, diagonal, full, moving, rate, symmetric

n, nu = 2, 3
COLUMNS = {
    n: "x v v_hat g g_hat F_hat F_dot z z_v e_v e_F",
    nu: "a a_dot a_hat f f_hat xi xi_hat xi_u xi_f s s_hat d d_hat h h_hat z_F z_a z_f z_m e_a e_f",
}
MATRICES = {
    (n, n): "g_v K_v K_1 K_2 K_inv",
    (nu, nu): "K_F K_a",
    (nu, n): "K_f1 K_f2 K_m1 K_m2",
    (n, nu): "U U_dot",
}
_columns = {name: column(name, size) for size, names in COLUMNS.items() for name in names.split()}
_matrices = {name: full(name, *shape) for shape, names in MATRICES.items() for name in names.split()}
m = SimpleNamespace(**_columns, **_matrices, M_inv=symmetric("W", n))
"""All of them as attributes."""
NAMES: dict[str, Any] = vars(m) | {
    "U_T": m.U.T,
    "U_dot_T": m.U_dot.T,
    "xi_f": diagonal(m.xi_f),
    "S": diagonal(m.s),
    "S_hat": diagonal(m.s_hat),
    "D": diagonal(m.d),
    "D_hat": diagonal(m.d_hat),
    "O": sympy.zeros(nu, nu),
    "O_F": sympy.zeros(n, n),
    "diag_a": diagonal(m.a),
    "diag_f": diagonal(m.f),
    "diag_e_a": diagonal(m.e_a),
    "diag_slip": diagonal(m.U.T * m.v),
}
STEADY = tuple(m.U_dot)
SIGNS = dict.fromkeys((*m.s, *m.s_hat), (-1, 1))


def plant_flows(force: Any) -> dict[Any, Any]:
    """x, v and U move as the plant does: M v̇ = g − F."""
    return moving(m.x, m.v) | moving(m.v, m.M_inv * (m.g - force)) | moving(m.U, m.U_dot)


def level_rate(velocity: Any, flows: dict[Any, Any], slope: Any, sign: Any) -> Any:
    """d h(|U'v|)/dt = D S d(U'v)/dt, by the chain rule over U and v both."""
    return diagonal(slope) * diagonal(sign) * rate(m.U.T * velocity, flows)
