"""The two-mass system of sections 4.7, 5.4 and 7.7: from its springs by Lagrange, its contacts by Newton's third law.

Spring η₁ connects the lower mass with the wall, η₂ the upper mass, η₃ both masses; contact 1 is between the masses,
contact 2 below.
"""

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.derivation import Derivations, column, diagonal, moving, rate, real
from codegen.thesis.audit.derivations.shipped import shipped_two_mass


def two_mass() -> Derivations:
    """Equations of motion, M, U, g, and every observer of these sections, specialised from its definition."""
    m_1, m_2, w = real("m_1", "m_2", "w")
    eta = real("eta_1", "eta_2", "eta_3")
    x, v, v_hat, F, F_hat = column("x", 2), column("v", 2), column("v_hat", 2), column("F", 2), column("F_hat", 2)
    stored = (eta[1] * x[0] ** 2 + eta[2] * (x[0] - x[1]) ** 2 + eta[0] * x[1] ** 2) / 2
    g = sympy.Matrix([-stored.diff(x[0]), -stored.diff(x[1]) + w]).expand()
    M = sympy.diag(m_1, m_2)
    slips = sympy.Matrix([v[0] - v[1], v[1]])
    U = slips.jacobian(v).T  # power: F'v = F̄'(U'v)
    theirs = shipped_two_mass()
    shipped_names = {theirs.names["m1"]: m_1, theirs.names["m2"]: m_2}
    shipped_names |= {theirs.names[f"eta{k + 1}"]: eta[k] for k in range(3)}
    for key, ours in (("mass", M), ("force", g), ("distribution", U)):
        if (theirs.derived[key].value.subs(shipped_names) - ours).expand() != sympy.zeros(*ours.shape):
            raise ArithmeticError(f"two masses: the spec's {key} is not the one derived here")

    model = M.inv() * (g - F_hat)
    derived = _observers(x, v_hat, U, model, F_hat)
    a, f = column("a", 2), column("f", 2)
    c, phi_inv = column("c", 2), column("phi_inv", 2)
    S = diagonal(slips.applyfunc(Sgn))
    h = slips.applyfunc(Magnitude)
    derived |= {
        "motion": g - F,
        "coulomb": U * diagonal(a) * slips.applyfunc(Sgn),
        "dynamic": U * diagonal(a) * f,
        "xi": diagonal(c) * (slips - phi_inv),
        "force": g,
        "matrices": sympy.Matrix.hstack(M, U, diagonal(a)),
        "h": h,
        "S": S,
        "D": sympy.eye(2),  # ∂h/∂|u| where h is |u|
    }
    return Derivations({}, derived, positive=frozenset({m_1, m_2}))


def _observers(x: Any, v_hat: Any, U: Any, model: Any, F_hat: Any) -> dict[str, Any]:
    k_F, k_1, k_2, k_v = (column(name, 2) for name in ("k_F", "k_1", "k_2", "k_v"))
    K_a, K_f1, K_f2 = (column(name, 2) for name in ("K_a", "K_f1", "K_f2"))
    z_F, z, z_v, z_a, z_f = (column(name, 2) for name in ("z_F", "z_", "z_v", "z_a", "z_f"))
    a_hat, f_hat, xi_hat = column("a_hat", 2), column("f_hat", 2), column("xi_hat", 2)
    slips = U.T * v_hat
    flows = moving(x, v_hat) | moving(v_hat, model) | moving(f_hat, xi_hat)
    level = diagonal(k_F) * slips.applyfunc(Magnitude)
    tracked = diagonal(k_1) * x + diagonal(k_2) * v_hat
    coefficient = diagonal(K_a) * diagonal(f_hat) * slips
    normalised = diagonal(K_f1) * x + diagonal(K_f2) * v_hat
    return {
        "gcfo": U * diagonal(slips.applyfunc(Sgn)) * (z_F - level),
        "gcfo_rate": rate(level, flows),
        "gto": z + tracked,
        "gto_rate": -rate(tracked, flows),
        "K_1": tracked.jacobian(x),
        "K_2": tracked.jacobian(v_hat),
        "velocity": z_v + diagonal(k_v) * x,
        "velocity_rate": model - rate(diagonal(k_v) * x, flows),
        "gdfo_a": z_a + coefficient,
        "gdfo_a_rate": -rate(coefficient, flows),
        "gdfo_f": z_f + normalised,
        "gdfo_f_rate": xi_hat - rate(normalised, flows),
        "gdfo": U * diagonal(a_hat) * f_hat,
    }
