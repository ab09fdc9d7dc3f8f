"""Appendix A.1.5: holonomic constraints by Lagrange, on three positions that are polynomials of two coordinates."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.spec.functions import Sgn
from codegen.thesis.audit.world import World, column, diagonal, full, moving, rate, real


def generalised_coordinates() -> World:
    """(A.49)–(A.66), with M_x constant, as it is for masses (A.5), and no time in the constraints."""
    return _world((0, 0, 0))


def time_dependent_constraints() -> World:
    """The same where the constraints ψ(x, t) of (A.47) depend on time, as they are written there."""
    (t,) = real("t")
    return _world((3 * t, t**2, -2 * t))


def _world(driven: tuple[Any, ...]) -> World:
    q, q_dot, q_ddot = column("q", 2), column("q_dot", 2), column("q_ddot", 2)
    (t,) = real("t")
    bent = [2 * q[0] - q[1] + q[0] * q[1], q[0] ** 2 + 3 * q[1], q[1] ** 2 - q[0] + 2 * q[0] * q[1]]
    x = sympy.Matrix([b + d * (1 + q[0]) for b, d in zip(bent, driven, strict=True)])
    M, U_x, A = sympy.diag(*real("m_1", "m_2", "m_3")), full("U_x", 3, 2), diagonal(column("a", 2))
    g_x = column("g_x", 3)
    flows = moving(q, q_dot) | moving(q_dot, q_ddot) | {t: sympy.S.One}
    x_dot = rate(x, flows)
    x_ddot = rate(x_dot, flows)
    energy = sympy.Matrix([(x_dot.T * M * x_dot)[0] / 2])
    T_q = x.jacobian(q)
    T_q_dot = rate(T_q, flows)
    slip = U_x.T * x_dot
    friction = U_x * A * slip.applyfunc(Sgn)
    Phi_x = g_x - friction
    virtual = column("dq", 2)

    def work_of(force: Any) -> Any:
        """Virtual work: Φ_q' δq = Φ_x' δx."""
        return sympy.Matrix([(force.T * (T_q * virtual))[0]]).jacobian(virtual).T

    Phi_q = work_of(Phi_x)
    momentum_rate = rate(energy.jacobian(q_dot).T, flows)
    inertia = momentum_rate - energy.jacobian(q).T
    M_q = sympy.hessian(energy[0], list(q_dot))
    U_q = slip.jacobian(q_dot).T
    free = dict.fromkeys(q_ddot, sympy.S.Zero)
    rest = inertia.xreplace(free)
    pairs = {
        "x_dot": (x_dot, "T_q*q_dot"),
        "x_ddot": (x_ddot, "T_q_dot*q_dot + T_q*q_ddot"),
        "T_q_dot": (x_dot.jacobian(q), "T_q_dot"),
        "energy_q": (energy.jacobian(q), "q_dot_T*T_q_T*M*T_q_dot"),
        "energy_q_dot": (energy.jacobian(q_dot), "q_dot_T*T_q_T*M*T_q"),
        "momentum_rate": (
            momentum_rate,
            "T_q_T*M*T_q_dot*q_dot + T_q_T*M*T_q*q_ddot + T_q_dot_T*M*T_q*q_dot",
        ),
        "balance": (Phi_q, "T_q_T*Phi_x"),
        "virtual_work": (Phi_q, "T_q_T*Phi_x"),
        "inertia_force": (
            Phi_q - rest,
            "-T_q_T*M*T_q_dot*q_dot + T_q_T*g_x - T_q_T*U_x*A*sgn(U_x_T*T_q*q_dot)",
        ),
        "M_q": (M_q, "T_q_T*M*T_q"),
        "U_q": (U_q, "T_q_T*U_x"),
        "g_q": (work_of(g_x) - rest, "T_q_T*g_x - T_q_T*M*T_q_dot*q_dot"),
        "friction": (work_of(friction), "U_q*A*sgn(U_q_T*q_dot)"),
        "energy": (energy, "x_dot_T*M*x_dot/2"),
    }
    derived: dict[str, Any] = {name: value for name, (value, _) in pairs.items()} if any(driven) else {**pairs}
    names: dict[str, Any] = {"q": q, "q_dot": q_dot, "q_ddot": q_ddot, "M": M, "U_x": U_x, "U_x_T": U_x.T, "A": A}
    names |= {"T_q": T_q, "T_q_T": T_q.T, "T_q_dot": T_q_dot, "T_q_dot_T": T_q_dot.T, "g_x": g_x, "x_dot": x_dot}
    names |= {"x_dot_T": x_dot.T, "q_dot_T": q_dot.T, "Phi_x": Phi_x, "M_q": M_q, "U_q": U_q, "U_q_T": U_q.T}
    names |= {"x_t": x.diff(t), "slip": slip}
    if any(driven):
        derived["x_dot"] = x_dot, "T_q*q_dot + x_t"
    derived["motion"] = inertia
    names["balance_force"] = inertia
    return World(names, derived)
