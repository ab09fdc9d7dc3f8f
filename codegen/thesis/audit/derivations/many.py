"""Several coordinates and contacts, chapters 4, 5 and 7: state equations, error dynamics by the chain rule, and Ψ.

The symbols are of two coordinates and three contacts. U may depend on x, so that its elements have time derivatives
(``U_dot``). M⁻¹ is any symmetric matrix; g, h and ξ are symbols, and so are their derivatives g_v, D and ξ_u, ξ_f. A
formula holds if it is an identity in all of them. State equations are derived as in ``one``, with matrices.
"""

from types import SimpleNamespace
from typing import Any

import sympy

from codegen.thesis.audit.derivation import (
    Derivations,
    column,
    diagonal,
    full,
    jacobian_at_zero,
    moving,
    rate,
    symmetric,
)

n, nu = 2, 3
COLUMNS = {
    n: "x v v_hat g g_hat F_hat F_dot z z_v e_v e_F",
    nu: "a a_dot a_hat f f_hat xi xi_hat xi_u xi_f s s_hat d d_hat h h_hat z_F z_a z_f z_m e_a e_f",
}
MATRICES = {(n, n): "g_v K_v K_1 K_2 K_inv", (nu, nu): "K_F K_a", (nu, n): "K_f1 K_f2 K_m1 K_m2", (n, nu): "U U_dot"}
_columns = {name: column(name, size) for size, names in COLUMNS.items() for name in names.split()}
_matrices = {name: full(name, *shape) for shape, names in MATRICES.items() for name in names.split()}
m = SimpleNamespace(**_columns, **_matrices, M_inv=symmetric("W", n))
"""All symbols, as attributes."""
NAMES: dict[str, Any] = vars(m) | {
    "xi_f": diagonal(m.xi_f),
    "S": diagonal(m.s),
    "S_hat": diagonal(m.s_hat),
    "D": diagonal(m.d),
    "D_hat": diagonal(m.d_hat),
    "O": sympy.zeros(nu, nu),
    "O_F": sympy.zeros(n, n),
    "diag_slip": diagonal(m.U.T * m.v),
}
STEADY = tuple(m.U_dot)
SIGNS = dict.fromkeys((*m.s, *m.s_hat), (-1, 1))


def plant_flows(force: Any) -> dict[Any, Any]:
    """Time derivatives of x, v and U in the plant M v̇ = g − F."""
    return moving(m.x, m.v) | moving(m.v, m.M_inv * (m.g - force)) | moving(m.U, m.U_dot)


def level_rate(velocity: Any, flows: dict[Any, Any], slope: Any, sign: Any) -> Any:
    """d h(|U'v|)/dt = D S d(U'v)/dt, by the chain rule over U and v."""
    return diagonal(slope) * diagonal(sign) * rate(m.U.T * velocity, flows)


def many_equations() -> Derivations:
    """(4.10)–(4.17), (4.25)–(4.28), (4.33), (5.14)–(5.15), (7.10)–(7.14), (7.24)–(7.25)."""
    derived: dict[str, Any] = {}
    for prefix, velocity, g, hat in (("", m.v, m.g, ""), ("estimated_", m.v_hat, m.g_hat, "_hat")):
        model = m.M_inv * (g - m.F_hat)
        flows = moving(m.x, velocity) | moving(velocity, model) | moving(m.U, m.U_dot) | moving(m.f_hat, m.xi_hat)
        contact_model = moving(m.x, velocity) | moving(velocity, m.M_inv * (g - m.U * m.f_hat))
        sign, slope = (m.s_hat, m.d_hat) if hat else (m.s, m.d)
        coulomb = moving(m.F_hat, m.U * diagonal(sign) * m.a_hat)  # F̂ = U S â in place of the symbol F̂
        tracked = m.K_1 * m.x + m.K_2 * velocity
        normalised = m.K_f1 * m.x + m.K_f2 * velocity
        coefficient = m.K_a * diagonal(m.f_hat) * m.U.T * velocity
        by_contact = m.K_m1 * m.x + m.K_m2 * velocity
        g_, v_, S_, D_, h_, slip_ = (f"{name}{hat}" for name in ("g", "v", "S", "D", "h", "diag_slip"))
        acceleration = f"M_inv*({g_} - F_hat)"
        own = {
            "level": (m.z_F - m.K_F * (m.h_hat if hat else m.h), f"z_F - K_F*{h_}"),
            "level_rate": (
                (m.K_F * level_rate(velocity, flows, slope, sign)).xreplace(coulomb),
                f"K_F*{D_}*{S_}*(U_T*M_inv*({g_} - U*{S_}*a_hat) + U_dot_T*{v_})",
            ),
            "force": (m.U * diagonal(sign) * m.a_hat, f"U*{S_}*a_hat"),
            "tracked": (m.z + tracked, f"z + K_1*x + K_2*{v_}"),
            "tracked_rate": (-rate(tracked, flows), f"-K_1*{v_} - K_2*{acceleration}"),
            "coefficient": (m.z_a + coefficient, f"z_a + K_a*diag_f_hat*U_T*{v_}"),
            "coefficient_rate": (
                -rate(coefficient, flows),
                f"-K_a*{slip_}*xi_hat - K_a*diag_f_hat*(U_T*{acceleration} + U_dot_T*{v_})",
            ),
            "normalised": (m.z_f + normalised, f"z_f + K_f1*x + K_f2*{v_}"),
            "normalised_rate": (m.xi_hat - rate(normalised, flows), f"-K_f1*{v_} - K_f2*{acceleration} + xi_hat"),
            "by_contact": (m.z_m + by_contact, f"z_m + K_m1*x + K_m2*{v_}"),
            "by_contact_rate": (-rate(by_contact, contact_model), f"-K_m1*{v_} - K_m2*M_inv*({g_} - U*F_bar_hat)"),
        }
        derived |= {f"{prefix}{name}": one for name, one in own.items()}
    velocity_rate = m.M_inv * (m.g_hat - m.F_hat) - rate(m.K_v * m.x, moving(m.x, m.v_hat))
    derived["velocity"] = m.z_v + m.K_v * m.x, "z_v + K_v*x"
    derived["velocity_rate"] = velocity_rate, "-K_v*v_hat + M_inv*(g_hat - F_hat)"
    derived["product"] = m.U * diagonal(m.a_hat) * m.f_hat, "U*diag_a_hat*f_hat"
    # F̄̂ is any vector of contact forces.
    names = NAMES | {"diag_slip_hat": diagonal(m.U.T * m.v_hat), "F_bar_hat": m.f_hat}
    return Derivations(names, derived, steady=STEADY, ranges=SIGNS)


F = column("F", n)


def many_static() -> Derivations:
    """(4.18)–(4.24), (7.20)–(7.23): GCFO and GTO with measured velocity; dF/dt by the product rule."""
    S = diagonal(m.s)
    force = m.U * S * m.a
    a_hat = m.a - m.e_a
    model = m.M_inv * (m.g - m.U * S * a_hat)
    z_rate = m.K_F * diagonal(m.d) * S * m.U.T * model  # (4.12) as printed
    e_a_dot = m.a_dot - (z_rate - m.K_F * level_rate(m.v, plant_flows(force), m.d, m.s))
    z_tracked = -m.K_1 * m.v - m.K_2 * m.M_inv * (m.g - (F - m.e_F))
    e_F_dot = m.F_dot - (z_tracked + rate(m.K_1 * m.x + m.K_2 * m.v, plant_flows(F)))
    moved = moving(m.U, m.U_dot) | moving(m.a, m.a_dot) | moving(m.f, m.xi)
    dynamic = m.U * diagonal(m.a) * m.f
    derived = {
        "e_a_dot": (e_a_dot, "-K_F*D*S*U_T*M_inv*U*S*e_a + K_F*D*S*U_dot_T*v + a_dot"),
        "e_F_dot": (e_F_dot, "K_2*M_inv*e_F + F_dot"),
        "coulomb_force": (m.U * diagonal(m.a) * m.s, "U*diag_a*sgn_slip"),
        "coulomb_rate": (rate(force, moved), "U_dot*S*a + U*S*a_dot"),
        "dynamic_force": (dynamic, "U*diag_a*f"),
        "dynamic_rate": (rate(dynamic, moved), "U_dot*diag_a*f + U*diag_a_dot*f + U*diag_a*xi"),
    }
    names = {**NAMES, "sgn_slip": m.s, "O_S": sympy.zeros(nu, nu)}
    return Derivations(names, derived, steady=STEADY, ranges=SIGNS)


def many_static_estimated() -> Derivations:
    """(4.29)–(4.36), (7.29)–(7.31): GCFO and GTO with the velocity observer."""
    S, S_hat, D_hat = diagonal(m.s), diagonal(m.s_hat), diagonal(m.d_hat)
    v_hat, a_hat = m.v - m.e_v, m.a - m.e_a
    model = m.M_inv * (m.g_hat - m.U * S_hat * a_hat)
    v_hat_rate = model + m.K_v * (m.v - v_hat)
    z_rate = m.K_F * D_hat * S_hat * m.U.T * model  # (4.27) as printed
    flows = moving(m.v_hat, v_hat_rate) | moving(m.U, m.U_dot)
    level = level_rate(m.v_hat, flows, m.d_hat, m.s_hat).xreplace(moving(m.v_hat, v_hat))
    q_v, q_a = m.M_inv * (m.g - m.U * S * m.a) - v_hat_rate, m.K_F * level - z_rate
    between = moving(m.s_hat, m.s) | moving(m.d_hat, m.d) | _to_first_order()
    gcfo = jacobian_at_zero(sympy.Matrix([q_v, q_a]), sympy.Matrix([m.e_v, m.e_a]), between)

    tracked_model = m.M_inv * (m.g_hat - (F - m.e_F))
    tracked_v_rate = tracked_model + m.K_v * (m.v - v_hat)
    z_tracked = -m.K_1 * v_hat - m.K_2 * tracked_model
    t_v = m.M_inv * (m.g - F) - tracked_v_rate
    t_F = m.F_dot - (z_tracked + m.K_1 * m.v + m.K_2 * tracked_v_rate)
    gto = jacobian_at_zero(sympy.Matrix([t_v, t_F]), sympy.Matrix([m.e_v, m.e_F]), between)
    derived = {
        "q_v": (q_v, "M_inv*(g - g_hat) - M_inv*U*(S*a - S_hat*(a - e_a)) - K_v*e_v"),
        "q_a": (q_a, "K_F*D_hat*S_hat*U_T*K_v*e_v + K_F*D_hat*S_hat*U_dot_T*(v - e_v)"),
        "gcfo": (gcfo, [["-K_v + M_inv*g_v", "-M_inv*U*S"], ["K_F*D*S*U_T*K_v", "O"]]),
        "tracked_v": (t_v, "M_inv*(g - g_hat) - M_inv*e_F - K_v*e_v"),
        "tracked_F": (t_F, "-(K_1 + K_2*K_v)*e_v + F_dot"),
        "gto": (gto, [["-K_v + M_inv*g_v", "-M_inv"], ["-(K_1 + K_2*K_v)", "O_F"]]),
    }
    return Derivations(NAMES, derived, steady=STEADY, ranges=SIGNS)


def many_dynamic() -> Derivations:
    """(7.15)–(7.19): GDFO with measured velocity, with the same model in observer and plant, as in chapter 7."""
    f_hat = m.f - m.e_f
    true, model = _dynamic_forces(m.g)
    flows = plant_flows(true)
    z_f = -m.K_f1 * m.v - m.K_f2 * model + m.xi_hat
    f_hat_rate = z_f + rate(m.K_f1 * m.x + m.K_f2 * m.v, flows)
    z_a = -m.K_a * diagonal(m.U.T * m.v) * m.xi_hat - m.K_a * diagonal(f_hat) * m.U.T * model
    moved = flows | moving(m.f_hat, f_hat_rate)
    coefficient = rate(m.K_a * diagonal(m.f_hat) * m.U.T * m.v, moved).xreplace(moving(m.f_hat, f_hat))
    e_f_dot, e_a_dot = m.xi - f_hat_rate, -(z_a + coefficient)
    first = moving(m.xi_hat, m.xi - diagonal(m.xi_f) * m.e_f) | dict.fromkeys(STEADY, sympy.S.Zero)
    psi = jacobian_at_zero(sympy.Matrix([e_f_dot, e_a_dot]), sympy.Matrix([m.e_f, m.e_a]), first)
    error = "M_inv*U*(diag_f_hat*e_a + diag_a_hat*e_f + diag_e_a*e_f)"
    gain = "K_a*(diag_slip*K_f2 + diag_f*U_T)"
    psi_form = [
        ["K_f2*M_inv*U*diag_a + xi_f", "K_f2*M_inv*U*diag_f"],
        [f"{gain}*M_inv*U*diag_a", f"{gain}*M_inv*U*diag_f"],
    ]
    derived = {
        "e_f_dot": (e_f_dot, f"K_f2*{error} + xi - xi_hat"),
        "e_a_dot": (e_a_dot, f"K_a*(diag_slip*K_f2 + diag_f_hat*U_T)*{error} - K_a*diag_f_hat*U_dot_T*v"),
        "jacobian": (psi, psi_form),
    }
    return Derivations(_dynamic_names(), derived, steady=STEADY, ranges=SIGNS)


def many_dynamic_estimated() -> Derivations:
    """(7.26)–(7.28): GDFO with the velocity observer."""
    v_hat, f_hat = m.v - m.e_v, m.f - m.e_f
    true, model = _dynamic_forces(m.g_hat)
    v_hat_rate = model + m.K_v * (m.v - v_hat)
    z_f = -m.K_f1 * v_hat - m.K_f2 * model + m.xi_hat
    f_hat_rate = z_f + m.K_f1 * m.v + m.K_f2 * v_hat_rate
    z_a = -m.K_a * diagonal(m.U.T * v_hat) * m.xi_hat - m.K_a * diagonal(f_hat) * m.U.T * model
    moved = moving(m.v_hat, v_hat_rate) | moving(m.U, m.U_dot) | moving(m.f_hat, f_hat_rate)
    coefficient = rate(m.K_a * diagonal(m.f_hat) * m.U.T * m.v_hat, moved)
    coefficient = coefficient.xreplace(moving(m.f_hat, f_hat) | moving(m.v_hat, v_hat))
    q_v, q_a, q_f = m.M_inv * (m.g - true) - v_hat_rate, -(z_a + coefficient), m.xi - f_hat_rate
    slope_v, slope_f = diagonal(m.xi_u) * m.U.T, diagonal(m.xi_f)
    first = moving(m.xi_hat, m.xi - slope_v * m.e_v - slope_f * m.e_f) | _to_first_order()
    psi = jacobian_at_zero(sympy.Matrix([q_v, q_a, q_f]), sympy.Matrix([m.e_v, m.e_a, m.e_f]), first)
    error = "M_inv*U*(diag_f_hat*e_a + diag_a_hat*e_f + diag_e_a*e_f)"
    coupling = "diag_f_hat*U_T*K_v*e_v + diag_slip_hat*(K_f1 + K_f2*K_v)*e_v"
    psi_form = [
        ["-K_v + M_inv*g_v", "-M_inv*U*diag_f", "-M_inv*U*diag_a"],
        ["-K_a*(diag_f*U_T*K_v + diag_slip*(K_f1 + K_f2*K_v))", "O", "O"],
        ["xi_v - (K_f1 + K_f2*K_v)", "O", "xi_f"],
    ]
    derived = {
        "q_v": (q_v, f"-K_v*e_v + M_inv*(g - g_hat) - {error}"),
        "q_a": (q_a, f"-K_a*({coupling} + diag_f_hat*U_dot_T*(v - e_v))"),
        "q_f": (q_f, "-(K_f1 + K_f2*K_v)*e_v + xi - xi_hat"),
        "jacobian": (psi, psi_form),
    }
    return Derivations({**_dynamic_names(), "xi_v": slope_v}, derived, steady=STEADY, ranges=SIGNS)


def _to_first_order() -> dict[Any, Any]:
    """ĝ to first order in the velocity error, for constant U."""
    return moving(m.g_hat, m.g - m.g_v * m.e_v) | dict.fromkeys(STEADY, sympy.S.Zero)


def _dynamic_forces(g: Any) -> tuple[Any, Any]:
    """F = U diag(a) f, and the acceleration M⁻¹(g − F̂) of the observer's model."""
    estimate = m.U * diagonal(m.a - m.e_a) * (m.f - m.e_f)
    return m.U * diagonal(m.a) * m.f, m.M_inv * (g - estimate)


def _dynamic_names() -> dict[str, Any]:
    estimates = {"a_hat": m.a - m.e_a, "f_hat": m.f - m.e_f, "v_hat": m.v - m.e_v}
    return {**NAMES, **estimates, "diag_slip_hat": diagonal(m.U.T * estimates["v_hat"])}
