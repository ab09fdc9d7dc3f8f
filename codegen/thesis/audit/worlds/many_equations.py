"""Several coordinates: the observers' state equations by the principle of one_equations, matrix by matrix."""

from __future__ import annotations

from typing import Any

from codegen.thesis.audit.world import Derived, World, diagonal, moving, rate
from codegen.thesis.audit.worlds import many_symbols as m


def many_equations() -> World:
    """(4.10)–(4.17), (4.25)–(4.28), (4.33), (5.14)–(5.15), (7.10)–(7.14), (7.24)–(7.25)."""
    derived: dict[str, Derived] = {}
    for prefix, velocity, g, hat in (("", m.v, m.g, ""), ("estimated_", m.v_hat, m.g_hat, "_hat")):
        model = m.M_inv * (g - m.F_hat)
        flows = moving(m.x, velocity) | moving(velocity, model) | moving(m.U, m.U_dot) | moving(m.f_hat, m.xi_hat)
        sign, slope = (m.s_hat, m.d_hat) if hat else (m.s, m.d)
        level = -m.K_F * (m.h_hat if hat else m.h)
        tracked = m.K_1 * m.x + m.K_2 * velocity
        normalised = m.K_f1 * m.x + m.K_f2 * velocity
        coefficient = m.K_a * diagonal(m.f_hat) * m.U.T * velocity
        by_contact = m.K_m1 * m.x + m.K_m2 * velocity
        named = f"g{hat}", f"v{hat}", f"S{hat}", f"D{hat}"
        derived |= {
            f"{prefix}level": Derived(m.z_F + level, f"z_F - K_F*h{hat}"),
            f"{prefix}level_rate": Derived(
                m.K_F * m.level_rate(velocity, flows, slope, sign),
                "K_F*{3}*{2}*(U_T*M_inv*({0} - U*{2}*a_hat) + U_dot_T*{1})".format(*named),
            ),
            f"{prefix}force": Derived(m.U * diagonal(sign) * m.a_hat, f"U*S{hat}*a_hat"),
            f"{prefix}tracked": Derived(m.z + tracked, f"z + K_1*x + K_2*v{hat}"),
            f"{prefix}tracked_rate": Derived(
                -rate(tracked, flows), "-K_1*{1} - K_2*M_inv*({0} - F_hat)".format(*named)
            ),
            f"{prefix}coefficient": Derived(m.z_a + coefficient, f"z_a + K_a*diag_f_hat*U_T*v{hat}"),
            f"{prefix}coefficient_rate": Derived(
                -rate(coefficient, flows),
                "-K_a*diag_slip{4}*xi_hat - K_a*diag_f_hat*(U_T*M_inv*({0} - F_hat) + U_dot_T*{1})".format(*named, hat),
            ),
            f"{prefix}normalised": Derived(m.z_f + normalised, f"z_f + K_f1*x + K_f2*v{hat}"),
            f"{prefix}normalised_rate": Derived(
                m.xi_hat - rate(normalised, flows), "-K_f1*{1} - K_f2*M_inv*({0} - F_hat) + xi_hat".format(*named)
            ),
            f"{prefix}by_contact": Derived(m.z_m + by_contact, f"z_m + K_m1*x + K_m2*v{hat}"),
        }
        derived[f"{prefix}level_rate"] = _with_coulomb(derived[f"{prefix}level_rate"], sign)
        contact_model = moving(m.x, velocity) | moving(velocity, m.M_inv * (g - m.U * m.f_hat))
        derived[f"{prefix}by_contact_rate"] = Derived(
            -rate(by_contact, contact_model), "-K_m1*{1} - K_m2*M_inv*({0} - U*F_bar_hat)".format(*named)
        )
    observed = moving(m.x, m.v_hat)
    derived["velocity"] = Derived(m.z_v + m.K_v * m.x, "z_v + K_v*x")
    derived["velocity_rate"] = Derived(
        m.M_inv * (m.g_hat - m.F_hat) - rate(m.K_v * m.x, observed), "-K_v*v_hat + M_inv*(g_hat - F_hat)"
    )
    derived["product"] = Derived(m.U * diagonal(m.a_hat) * m.f_hat, "U*diag_a_hat*f_hat")
    names: dict[str, Any] = {
        **m.NAMES,
        "diag_f_hat": diagonal(m.f_hat),
        "diag_a_hat": diagonal(m.a_hat),
        "diag_slip_hat": diagonal(m.U.T * m.v_hat),
        "F_bar_hat": m.f_hat,  # any vector of contact forces
    }
    return World(names, derived, steady=m.STEADY, ranges=m.SIGNS)


def _with_coulomb(derived: Derived, sign: Any) -> Derived:
    """F̂ = U S â in place of the symbol F̂."""
    force = m.U * diagonal(sign) * m.a_hat
    return Derived(derived.value.xreplace(moving(m.F_hat, force)), derived.form)
