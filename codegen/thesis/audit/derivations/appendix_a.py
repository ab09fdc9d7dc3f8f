"""Appendix A: friction of masses in contact by Newton's third law, for four masses (A.1–A.2), and holonomic constraints
by Lagrange (A.1.5), for three positions that are polynomials of two coordinates.
"""

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.derivation import Derivations, column, diagonal, full, moving, rate, real

N = 4


def contacts_of_masses() -> Derivations:
    """Lemma A.1 and its proof: contact (i, j) acts on mass i with a_ij sgn(v_i − v_j), and on j with the opposite."""
    v = column("v", N)
    level = {(i, j): real(f"a{i + 1}{j + 1}")[0] for i in range(N) for j in range(i + 1, N)}
    ground = [real(f"a{i + 1}0")[0] for i in range(N)]
    force = sympy.Matrix([ground[i] * Sgn(v[i]) for i in range(N)])
    for (i, j), a in level.items():
        force[i] += a * Sgn(v[i] - v[j])
        force[j] -= a * Sgn(v[i] - v[j])
    names: dict[str, Any] = {f"a{j + 1}{i + 1}": a for (i, j), a in level.items()} | {"v": v}
    derived = {"force": force, "action": level[0, 1] * Sgn(v[0] - v[1])}
    derived |= {f"force_{i + 1}": force[i] for i in range(N)}

    blocks, levels, slips, groups = [], [], [], []
    for i in range(N):
        pairs = [(ground[i], v[i])] + [(level[i, j], v[i] - v[j]) for j in range(i + 1, N)]
        group = sympy.Matrix([a * Sgn(u) for a, u in pairs])
        symbols = column(f"d{i + 1}_", len(pairs))
        known = force.subs(dict(zip(group, symbols, strict=True)), simultaneous=True)
        block = known.expand().jacobian(symbols)  # W_i: force of unit contacts i on every mass
        slip = sympy.Matrix([u for _, u in pairs])
        blocks.append(block)
        levels += [a for a, _ in pairs]
        slips.append(slip)
        groups.append(group)
        derived |= {f"W_{i + 1}": block, f"slip_{i + 1}": slip, f"d_{i + 1}": group}
        derived[f"W_{i + 1}_T"] = slip.jacobian(v)
        names |= {f"W_{i + 1}": block, f"d_{i + 1}": group}
    U_o = sympy.Matrix.hstack(*blocks)
    d_o = sympy.Matrix.vstack(*groups)
    contacts = [(i, 0) for i in range(N)] + [(i, j) for i in range(N) for j in range(i + 1, N)]
    derived |= {
        "U_o": sympy.Matrix.vstack(*slips).jacobian(v).T,  # by power: F'v = Σ λ u
        "d_o": d_o,
        "A_o": diagonal(levels),
        "columns": sympy.Matrix([len(contacts)]),
        "entries": sympy.Matrix([sorted(set(U_o))]),
    }
    kept = [k for k, a in enumerate(levels) if a not in (level[0, 2], level[1, 3], ground[0])]
    names |= {"U_o": U_o, "A_o": diagonal(levels), "d_o": d_o, "n": sympy.Integer(N)}
    names |= {"U": U_o[:, kept], "A": diagonal([levels[k] for k in kept])}
    dropped = dict.fromkeys((level[0, 2], level[1, 3], ground[0]), sympy.S.Zero)
    derived["sparse_force"] = force.subs(dropped)
    return Derivations(names, derived)


def rotated_coordinates() -> Derivations:
    """(A.37): x = T x̄ with T unitary, a rotation with half-angle tangent t, by invariance of energy and power."""
    (t,) = real("t")
    T = sympy.Matrix([[1 - t**2, -2 * t], [2 * t, 1 - t**2]]) / (1 + t**2)
    v = column("v", 2)
    M_bar, U_bar, g, F = sympy.diag(*real("m_1", "m_2")), full("U_bar", 2, 2), column("g", 2), column("F", 2)
    v_bar = T.inv().applyfunc(sympy.factor) * v
    energy = (v_bar.T * M_bar * v_bar)[0] / 2
    slips = U_bar.T * v_bar
    u_bar = column("v_bar", 2)
    power = [(f.T * T * u_bar)[0] for f in (g, F)]
    derived = {
        "mass": (sympy.hessian(energy, list(v)), "T*M_bar*T_T"),
        "distribution": (slips.jacobian(v).T, "T*U_bar"),
        "force_bar": (sympy.Matrix([power[0]]).jacobian(u_bar).T, "T_T*g"),
        "friction_bar": (sympy.Matrix([power[1]]).jacobian(u_bar).T, "T_T*F"),
    }
    return Derivations({"T": T, "M_bar": M_bar, "U_bar": U_bar, "g": g, "F": F}, derived)


def directions() -> Derivations:
    """(A.38)–(A.44): three directions stacked, for two masses; each vector has an entry for each mass and direction."""
    g = [column(f"g_{axis}", 2) for axis in "xyz"]
    F = [full(f"U_{axis}", 2, 2) * column(f"f_{axis}", 2) for axis in "xyz"]
    M_bar = sympy.diag(*real("m_1", "m_2"))
    acceleration = [column(f"a_{axis}", 2) for axis in "xyz"]
    everything = sympy.Matrix.vstack(*acceleration)
    inertia = sympy.Matrix.vstack(*[M_bar * a for a in acceleration]).jacobian(everything)
    derived = {
        "mass": (inertia, [["M_bar", "O", "O"], ["O", "M_bar", "O"], ["O", "O", "M_bar"]]),
        "force": (sympy.Matrix.vstack(*g), ["g_x", "g_y", "g_z"]),
        "friction": (sympy.Matrix.vstack(*F), ["F_x", "F_y", "F_z"]),
    }
    names = {f"g_{axis}": value for axis, value in zip("xyz", g, strict=True)}
    names |= {f"F_{axis}": value for axis, value in zip("xyz", F, strict=True)}
    return Derivations({**names, "M_bar": M_bar, "O": sympy.zeros(2, 2), "o": sympy.zeros(2, 1)}, derived)


def extended_friction() -> Derivations:
    """(4.7)–(4.9), (A.68)–(A.76): extended Coulomb and extended dynamic friction, for three contacts."""
    nu = 3
    U, v, f = full("U", 2, nu), column("v", 2), column("f", nu)
    slip = U.T * v
    a = full("a", nu, 4)
    speeds = slip.applyfunc(Magnitude)
    level = sympy.Matrix([a[i, 0] + a[i, 1] * sympy.exp(-a[i, 2] * speeds[i]) + a[i, 3] * speeds[i] for i in range(nu)])
    A = [diagonal(a[:, k]) for k in range(4)]
    abs_slip = diagonal(speeds)
    (u,) = real("u")
    first = a[0, 0] + a[0, 1] * sympy.exp(-a[0, 2] * Magnitude(u)) + a[0, 3] * Magnitude(u)  # the first contact's level
    derived = {
        "level": level,
        "levels": (diagonal(level), "A_1 + A_2*exp_slip + A_4*diag_abs_slip"),
        "A_2": A[1],
        "force": (U * diagonal(level) * slip.applyfunc(Sgn), "U*A_v*sgn(slip)"),
        "dynamic": (U * diagonal(level) * f, "U*A_v*f"),
        "plain_dynamic": (U * diagonal(a[:, 0]) * f, "U*A_1*f"),
        "slope": sympy.Matrix([rate(first, moving([u], real("u_dot1"))).subs(u, slip[0])]),
    }
    names: dict[str, Any] = {f"A_{k + 1}": A[k] for k in range(4)}
    names |= {"diag_abs_slip": abs_slip, "exp_slip": (-A[2] * abs_slip).exp(), "A_v": diagonal(level), "U": U, "f": f}
    names |= {f"u_{i + 1}": slip[i] for i in range(nu)} | {"slip": slip}
    names |= {"A_4_abs": A[3] * abs_slip, "A_3_abs": A[2] * abs_slip}
    u_dot = column("u_dot", nu)
    names |= {f"u_dot_{i + 1}": u_dot[i] for i in range(nu)}
    return Derivations(names, derived, positive=frozenset(a))


def generalised_coordinates(on_time: bool = False) -> Derivations:
    """(A.49)–(A.66), with M_x constant, as for masses (A.5), for three positions x_i = ψ_i(q) + τ_i(t) (1 + q_1).

    ``on_time``: whether the constraints depend on time, as in (A.47); else τ = 0.
    """
    q, q_dot, q_ddot = column("q", 2), column("q_dot", 2), column("q_ddot", 2)
    (t,) = real("t")
    driven = (3 * t, t**2, -2 * t) if on_time else (0, 0, 0)
    curves = [2 * q[0] - q[1] + q[0] * q[1], q[0] ** 2 + 3 * q[1], q[1] ** 2 - q[0] + 2 * q[0] * q[1]]
    x = sympy.Matrix([b + d * (1 + q[0]) for b, d in zip(curves, driven, strict=True)])
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
        "momentum_rate": (momentum_rate, "T_q_T*M*T_q_dot*q_dot + T_q_T*M*T_q*q_ddot + T_q_dot_T*M*T_q*q_dot"),
        "balance": (Phi_q, "T_q_T*Phi_x"),
        "virtual_work": (Phi_q, "T_q_T*Phi_x"),
        "inertia_force": (Phi_q - rest, "-T_q_T*M*T_q_dot*q_dot + T_q_T*g_x - T_q_T*U_x*A*sgn(U_x_T*T_q*q_dot)"),
        "M_q": (M_q, "T_q_T*M*T_q"),
        "U_q": (U_q, "T_q_T*U_x"),
        "g_q": (work_of(g_x) - rest, "T_q_T*g_x - T_q_T*M*T_q_dot*q_dot"),
        "friction": (work_of(friction), "U_q*A*sgn(U_q_T*q_dot)"),
        "energy": (energy, "x_dot_T*M*x_dot/2"),
    }
    derived: dict[str, Any] = {name: value for name, (value, _) in pairs.items()} if on_time else {**pairs}
    names: dict[str, Any] = {"q_dot": q_dot, "q_ddot": q_ddot, "M": M, "U_x": U_x, "A": A, "T_q": T_q}
    names |= {"T_q_dot": T_q_dot, "g_x": g_x, "x_dot": x_dot, "Phi_x": Phi_x, "U_q": U_q}
    names["x_t"] = x.diff(t)
    if on_time:
        derived["x_dot"] = x_dot, "T_q*q_dot + x_t"
    derived["motion"] = inertia
    names["balance_force"] = inertia
    return Derivations(names, derived)
