"""Several coordinates: the observers' state equations by the principle of one_equations, matrix by matrix."""

from __future__ import annotations

from typing import Any

from codegen.thesis.audit.world import World, diagonal, moving, rate
from codegen.thesis.audit.worlds.many_symbols import NAMES, SIGNS, STEADY, level_rate, m


def many_equations() -> World:
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
    names = NAMES | {
        "diag_f_hat": diagonal(m.f_hat),
        "diag_a_hat": diagonal(m.a_hat),
        "diag_slip_hat": diagonal(m.U.T * m.v_hat),
        "F_bar_hat": m.f_hat,  # any vector of contact forces
    }
    return World(names, derived, steady=STEADY, ranges=SIGNS)
