"""Machines of the thesis' examples: two masses and a two-link arm, and what the project derives of its shipped specs.

The two-mass system of sections 4.7, 5.4 and 7.7 is derived from its springs by Lagrange, its contacts by Newton's third
law. Spring η₁ connects the lower mass with the wall, η₂ the upper mass, η₃ both masses; contact 1 is between the
masses, contact 2 below. The arm of section 4.8 is derived by Lagrange; θ₁ is measured from the horizontal, θ₂ relative
to the first link. For shipped specs: spec → System → Observer → derive_error_dynamics.
"""

from dataclasses import replace
from typing import Any

import sympy

from codegen.analysis.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.base.resources import resource_folder
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.reader import read_spec
from codegen.thesis.audit.derivation import Derivations, column, diagonal, full, moving, rate, real

ONE_MASS: dict[str, dict[str, Any]] = {
    "cfo": {"K_F": "10", "K_v": "100"},
    "to": {"K_1": "1", "K_2": "-100", "K_v": "100"},
}
TWO_MASS: dict[str, dict[str, Any]] = {
    "gcfo": {"K_F": ["500", "700"], "K_v": ["10", "10"]},
    "gto": {"K_1": ["1", "1"], "K_2": ["-1000", "-5000"], "K_v": ["10", "10"]},
}


def _error_dynamics(name: str, kind: str, gains: dict[str, Any]) -> ErrorDynamics:
    """The error dynamics of a shipped system under another observer, velocity estimated."""
    spec = read_spec(resource_folder("specs") / f"{name}.yaml")
    spec = replace(spec, observer=replace(spec.required_observer, kind=kind, velocity="estimated", gains=gains))
    return derive_error_dynamics(build_observer(spec, build_system(spec)))


def one_mass_jacobian(kind: str) -> Any:
    """Ψ of force errors for one mass of 1 kg, in the thesis' symbols."""
    dynamics = _error_dynamics("one_mass", kind, ONE_MASS[kind])
    rename = {"K_F": "k_F", "K_v": "k_v", "K_1": "k_1", "K_2": "k_2"}
    psi = dynamics.in_force(dynamics.jacobian)
    known = {s: real(rename[s.name])[0] for s in psi.free_symbols if s.name in rename}
    return sympy.Matrix(psi.subs(known).subs(real("m")[0], 1))


def shipped_one_mass() -> Derivations:
    """Ψ of the shipped one-mass spec."""
    return Derivations({}, {kind: one_mass_jacobian(kind) for kind in ONE_MASS})


def shipped_two_mass() -> Derivations:
    """M, g, U and Ψ of the shipped two-mass spec."""
    system = build_system(read_spec(resource_folder("specs") / "two_mass.yaml"))
    parts = {"mass": system.mass_matrix, "force": system.force, "distribution": system.distribution}
    psi = {kind: _error_dynamics("two_mass", kind, gains).jacobian for kind, gains in TWO_MASS.items()}
    return Derivations({}, {name: sympy.Matrix(part) for name, part in (parts | psi).items()})


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
