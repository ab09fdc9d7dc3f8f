"""The two-link arm of section 4.8 by Lagrange; θ₁ is measured from the horizontal, θ₂ relative to the first link."""

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.derivation import Derivations, column, full, moving, rate, real


def two_link_arm() -> Derivations:
    """M, Coriolis and centrifugal forces and gravity, the GCFO with h(|ω|) = |ω|, and the velocity observer."""
    m_1, m_2, l_1, b_1, b_2, I_1, I_2, gravity = real("m_1", "m_2", "l_1", "b_1", "b_2", "I_1", "I_2", "gravity")
    theta, omega, omega_dot = column("theta_", 2), column("omega_", 2), column("omega_dot_", 2)
    flows = moving(theta, omega) | moving(omega, omega_dot)
    both = theta[0] + theta[1]
    first = b_1 * sympy.Matrix([sympy.cos(theta[0]), sympy.sin(theta[0])])
    elbow = l_1 * sympy.Matrix([sympy.cos(theta[0]), sympy.sin(theta[0])])
    second = elbow + b_2 * sympy.Matrix([sympy.cos(both), sympy.sin(both)])
    speeds = [rate(p, flows) for p in (first, second)]
    kinetic = (m_1 * speeds[0].dot(speeds[0]) + m_2 * speeds[1].dot(speeds[1])) / 2
    kinetic += (I_1 * omega[0] ** 2 + I_2 * (omega[0] + omega[1]) ** 2) / 2
    potential = gravity * (m_1 * first[1] + m_2 * second[1])
    momentum = sympy.Matrix([kinetic]).jacobian(omega).T
    balance = rate(momentum, flows) - sympy.Matrix([kinetic - potential]).jacobian(theta).T
    M = balance.jacobian(omega_dot).applyfunc(sympy.simplify)
    gravity_force = balance.subs(moving(omega, [0, 0]) | moving(omega_dot, [0, 0])).applyfunc(sympy.simplify)
    coriolis = (balance.subs(moving(omega_dot, [0, 0])) - gravity_force).applyfunc(sympy.simplify)

    omega_hat, a, a_hat, z_F, z_omega = (column(n, 2) for n in ("omega_hat_", "a_", "a_hat_", "z_F", "z_omega"))
    F_c, F_g, w, u, F_hat = (column(n, 2) for n in ("F_c", "F_g", "w_", "u_", "F_hat"))
    M_inv, K_F, K_omega = full("W", 2, 2), full("K_F", 2, 2), full("K_omega", 2, 2)
    M_inv = M_inv.subs(M_inv[1, 0], M_inv[0, 1])
    model = M_inv * (w - F_c - F_g - F_hat)
    level = K_F * omega_hat.applyfunc(Magnitude)
    S_hat = sympy.diag(*omega_hat.applyfunc(Sgn))
    observed = moving(theta, omega_hat) | moving(omega_hat, model)
    derived = {
        "mass": M,
        "coriolis": coriolis,
        "gravity": gravity_force,
        "motion": balance,
        "friction": sympy.diag(*a) * omega.applyfunc(Sgn),
        "level": (z_F - level, "z_F - K_F*abs(omega_hat)"),
        "level_rate": (rate(level, observed), "K_F*S_hat*M_inv*(w - F_c - F_g - F_hat)"),
        "force": (S_hat * a_hat, "S_hat*a_hat"),
        "velocity": (z_omega + K_omega * theta, "z_omega + K_omega*theta"),
        "velocity_rate": (model - rate(K_omega * theta, observed), "M_inv*(w - F_c - F_g - F_hat) - K_omega*omega_hat"),
    }
    names = {"theta": theta, "omega_hat": omega_hat, "z_F": z_F, "z_omega": z_omega}
    names |= {"F_c": F_c, "F_g": F_g, "w": w, "u": u, "F_hat": F_hat, "M_inv": M_inv, "K_F": K_F, "K_omega": K_omega}
    names |= {"S_hat": S_hat, "a_hat": a_hat, "M": M, "omega_dot": omega_dot}
    names |= {"coriolis": coriolis, "gravity_force": gravity_force}
    return Derivations(names, derived)
