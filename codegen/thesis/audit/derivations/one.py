"""Observers of one mass: state equations and error dynamics of chapters 2, 3, 6 and 8, and of 4 and 7 for n = 1.

An observer estimates a quantity p as p̂ = z + φ, with a state z and a function φ of measured quantities. The model
gives dp̂/dt, and the state has the rate ż = dp̂/dt − dφ/dt, with every unknown replaced by its estimate.

Error dynamics are derived by the chain rule; errors are true value minus estimate. CFO and TO: v̇ = w − F with
F = a(v) sgn(v). DFO: F = a f, ḟ = ξ(v, f); its model is ξ₁, and ``xi_1_hat`` is ξ₁ at the estimates, which to first
order is ξ₁ − ξ₁v e_v − ξ₁f e_f. ``v_dot`` is v̇, so that w = v̇ + F.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.derivation import Derivations, jacobian_at_zero, rate, real, tidy
from codegen.thesis.audit.derivations.machines import one_mass_jacobian

v, x, a, f, v_dot, a_v, F, F_dot = real("v", "x", "a", "f", "v_dot", "a_v", "F", "F_dot")
k_F, mu, k_1, k_2, k_v, k_a, k_f1, k_f2 = real("k_F", "mu", "k_1", "k_2", "k_v", "k_a", "k_f1", "k_f2")
e_v, e_a, e_f, e_F, lambda_ = real("e_v", "e_a", "e_f", "e_F", "lambda_")
z_F, z, z_a, z_f, v_hat, f_hat = real("z_F", "z", "z_a", "z_f", "v_hat", "f_hat")
xi, xi_1, xi_1_hat, xi_f, xi_v = real("xi", "xi_1", "xi_1_hat", "xi_f", "xi_v")
(s,) = real("s")  # sgn(v) = sgn(v̂) between reversals


def one_equations() -> Derivations:
    """Equations of chapters 2, 3 and 6. ``w`` is the input; u = w − F̂ by (2.11) and (6.7)."""
    v, v_hat, x, w, F_hat = real("v", "v_hat", "x", "w", "F_hat")
    return Derivations({"u": w - F_hat}, _equations(x, v, v_hat, w, F_hat), positive=frozenset({mu}))


def compensated() -> Derivations:
    """(2.11), (6.7), (8.14): the input w for which v̇ = u if the friction estimate is right."""
    u, w, F_hat = real("u", "w", "F_hat")
    plant = w - F_hat  # v̇ at F = F̂
    return Derivations({}, {"input": sympy.solve(plant - u, w)[0]})


def rig_equations() -> Derivations:
    """Equations of chapter 8: angle θ in place of x, ω in place of v, unit inertia as in (8.2); u = w − F̂ by (8.14).

    Chapter 8 calls the gains of the Dahl observer k_d, k_d1, k_d2 and not k_a, k_f1, k_f2, and velocity gains k_ω and
    not k_v. Each equation is derived with the names of the other chapters and renamed.
    """
    omega, omega_hat, theta, w, F_hat = real("omega", "omega_hat", "theta", "w", "F_hat")
    derived = _equations(theta, omega, omega_hat, w, F_hat)
    a_hat, c, i, phi_inv, k_omega = real("a_hat", "c", "i", "phi_inv_f_hat", "k_omega")
    dahl = c * omega_hat * Magnitude(1 - f_hat * Sgn(omega_hat)) ** i * Sgn(1 - f_hat * Sgn(omega_hat))
    for model, xi in (("reset", c * (omega_hat - phi_inv)), ("dahl", dahl)):
        for key in ("a_rate", "f_rate"):
            derived[f"{model}_{key}"] = derived[f"estimated_{key}"].subs({xi_1_hat: xi, F_hat: a_hat * f_hat})
    dahl_gains = dict(zip((k_a, k_f1, k_f2), real("k_d", "k_d1", "k_d2"), strict=True))
    for key, source in (("dahl_a", "estimated_a"), ("dahl_f", "estimated_f"), *[(k, k) for k in tuple(derived)]):
        rename = dahl_gains if key.startswith("dahl") else {}
        derived[key] = derived[source].subs(rename | {k_v: k_omega})
    derived["printed_coulomb"] = _printed_coulomb()
    names = {"u": w - a_hat * f_hat, "k_v": k_omega}
    return Derivations(names, derived, positive=frozenset({mu, c, i}), ranges={i: (1, 2)})


def _printed_coulomb() -> Any:
    """Ψ of the errors (e_v, e_F) for plant (8.1)–(8.2) and observer (8.4)–(8.5) as printed; the slip's sign is s."""
    omega_dot, k_omega = real("omega_dot", "k_omega")
    modelled = omega_dot + e_F  # w − F̂, since ω̇ = w − F
    omega_hat_rate = modelled + k_omega * e_v
    F_hat_rate = -k_F * modelled * s * s + k_F * s * omega_hat_rate * s
    rates = sympy.Matrix([omega_dot - omega_hat_rate, -F_hat_rate]).expand().subs(s**2, 1)
    return rates.jacobian(sympy.Matrix([e_v, e_F]))


def _equations(x: Any, v: Any, v_hat: Any, w: Any, F_hat: Any) -> dict[str, Any]:
    """The formula of each estimate NAME, and the rate of its state, NAME_rate.

    Formulas with the prefix ``estimated_`` use v̂ in place of a measured velocity.
    """
    z_v, a_hat, x_r, g_1, g_2 = real("z_v", "a_hat", "x_r", "g_1", "g_2")
    modelled = w - F_hat  # the model's acceleration
    derived: dict[str, Any] = {}
    for prefix, speed in (("", v), ("estimated_", v_hat)):
        rates: Mapping[Any, Any] = {x: speed, speed: modelled, f_hat: xi_1_hat}
        estimates = {  # name: state z, function φ of what is measured, rate of the estimate by the model
            "level": (z_F, -k_F * Magnitude(speed) ** (1 if prefix else mu), 0),
            "force": (z, k_1 * x + k_2 * speed, 0),
            "f": (z_f, k_f1 * x + k_f2 * speed, xi_1_hat),
            "a": (z_a, k_a * f_hat * speed, 0),
        }
        for name, (state, phi, by_model) in estimates.items():
            derived[f"{prefix}{name}"] = state + phi
            derived[f"{prefix}{name}_rate"] = by_model - rate(phi, rates)
        derived[f"{prefix}coulomb_force"] = derived[f"{prefix}level"] * Sgn(speed)
        derived[f"{prefix}level_to_force"] = a_hat * Sgn(speed)
        derived[f"{prefix}servo"] = -g_1 * (x - x_r) - g_2 * speed
    derived["velocity"] = z_v + k_v * x
    derived["velocity_rate"] = modelled - rate(k_v * x, {x: v_hat})
    derived["product"] = a_hat * f_hat
    return derived


def one_coulomb() -> Derivations:
    """(2.12)–(2.13), (6.17): CFO with measured velocity."""
    estimate = z_F - k_F * Magnitude(v) ** mu
    F_estimate = (a - e_a) * Sgn(v)
    w = v_dot + a * Sgn(v)
    z_rate = k_F * mu * Magnitude(v) ** (mu - 1) * (w - F_estimate) * Sgn(v)
    flows = {v: v_dot, z_F: z_rate, x: v}
    e_a_dot = tidy(a_v * v_dot - rate(estimate, flows))
    estimate_F = estimate * Sgn(v)
    F_rate = rate(estimate_F, flows).subs(e_a, e_F * Sgn(v))
    (zdot,) = real("zdot_F")
    step = F_dot - rate(estimate_F, {v: v_dot, z_F: zdot})
    names = {"e_rest": sympy.solve(e_a_dot, e_a)[0]}  # the level error in steady state under (∂a/∂v) v̇
    derived = {
        "e_a_dot": e_a_dot,
        "e_F_dot": tidy(F_dot - F_rate),
        "e_F_dot_step": tidy(step),
        "jacobian": e_a_dot.coeff(e_a),
    }
    halves = tuple(sympy.Rational(k, 2) for k in (-4, -2, -1, 1, 2, 3, 4, 6))
    return Derivations(names, derived, ranges={mu: halves})


def one_tracking() -> Derivations:
    """(2.17)–(2.18), (6.18): TO with measured velocity."""
    w = v_dot + F
    z_rate = -k_1 * v - k_2 * (w - (F - e_F))
    estimate_rate = rate(z + k_1 * x + k_2 * v, {z: z_rate, x: v, v: v_dot})
    e_F_dot = sympy.expand(F_dot - estimate_rate)
    return Derivations({}, {"e_F_dot": e_F_dot, "jacobian": e_F_dot.diff(e_F)})


def one_coulomb_estimated() -> Derivations:
    """(3.13)–(3.21), (6.26)–(6.28): CFO with μ = 1 and the velocity observer; the sign of slip is s = ±1."""
    v_hat_rate = v_dot + e_F + k_v * e_v
    level_rate = k_F * (v_dot + e_F) * s - k_F * s * v_hat_rate  # d|v̂|/dt = sgn(v̂) dv̂/dt
    F_true_rate = a_v * v_dot * s
    e_F_dot = sympy.expand(F_true_rate - level_rate * s).subs(s**2, 1)
    rates = sympy.Matrix([sympy.expand(v_dot - v_hat_rate), e_F_dot])
    constant = rates.subs(a_v, 0)
    names = {"q_2": constant[1], "q_1": constant[0], "sgn_v": s}
    return Derivations(names, _estimated(rates, constant, "cfo"), ranges={s: (-1, 1)})


def one_tracking_estimated() -> Derivations:
    """(3.22)–(3.26), (6.29): TO with the velocity observer."""
    v_hat_rate = v_dot + e_F + k_v * e_v
    z_rate = -k_1 * (v - e_v) - k_2 * (v_dot + e_F)
    estimate_rate = rate(z + k_1 * x + k_2 * v_hat, {z: z_rate, x: v, v_hat: v_hat_rate})
    rates = sympy.Matrix([v_dot - v_hat_rate, F_dot - estimate_rate]).expand()
    return Derivations({}, _estimated(rates, rates.subs(F_dot, 0), "to"))


def _estimated(rates: Any, constant: Any, kind: str) -> dict[str, Any]:
    """The error rates with their Jacobian, which must equal that of ``derive_error_dynamics``.

    Args:
        rates: (ė_v, ė_F), by the chain rule.
        constant: the same for constant friction.
        kind: of the observer, ``cfo`` or ``to``.
    """
    jacobian = jacobian_at_zero(rates, sympy.Matrix([e_v, e_F]), {})
    of_the_tool = one_mass_jacobian(kind)
    if (jacobian - of_the_tool).expand() != sympy.zeros(2, 2):
        raise ArithmeticError(f"{kind}: the chain rule gives {jacobian}, derive_error_dynamics {of_the_tool}")
    return {
        "e_v_dot": rates[0],
        "e_F_dot": rates[1],
        "constant": constant,
        "constant_v": constant[0],
        "constant_F": constant[1],
        "jacobian": jacobian,
        "polynomial": (lambda_ * sympy.eye(2) - jacobian).det(),
    }


def one_dynamic() -> Derivations:
    """The DFO (6.13)–(6.15) with measured velocity; its error dynamics are (6.19)–(6.23) of the thesis."""
    w, F_hat = v_dot + a * f, (a - e_a) * (f - e_f)
    z_a_rate, z_f_rate = _dynamic_states(v, w - F_hat)
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v, {z_f: z_f_rate, x: v, v: v_dot})
    a_hat_rate = rate(z_a + k_a * f_hat * v, {z_a: z_a_rate, f_hat: f_hat_rate, v: v_dot}).subs(f_hat, f - e_f)
    derived = _dynamic({"e_f_dot": xi - f_hat_rate, "e_a_dot": -a_hat_rate}, (e_f, e_a), {xi_1_hat: xi_1 - xi_f * e_f})
    return Derivations({}, derived)


def one_dynamic_estimated() -> Derivations:
    """The DFO with the velocity observer (6.24)–(6.25); its error dynamics are (6.30)–(6.32), with their Jacobian Ψ."""
    w, F_hat = v_dot + a * f, (a - e_a) * (f - e_f)
    v_hat_rate = (w - F_hat) + k_v * e_v
    z_a_rate, z_f_rate = _dynamic_states(v - e_v, w - F_hat)
    f_hat_rate = rate(z_f + k_f1 * x + k_f2 * v_hat, {z_f: z_f_rate, x: v, v_hat: v_hat_rate})
    flows = {z_a: z_a_rate, f_hat: f_hat_rate, v_hat: v_hat_rate}
    a_hat_rate = rate(z_a + k_a * f_hat * v_hat, flows).subs({f_hat: f - e_f, v_hat: v - e_v})
    rates = {"e_v_dot": v_dot - v_hat_rate, "e_a_dot": -a_hat_rate, "e_f_dot": xi - f_hat_rate}
    derived = _dynamic(rates, (e_v, e_a, e_f), {xi_1_hat: xi_1 - xi_v * e_v - xi_f * e_f})
    return Derivations({"e_F": a * f - F_hat}, derived)


def _dynamic_states(speed: Any, modelled: Any) -> tuple[Any, Any]:
    """ż_a and ż_f, with the velocity and the acceleration that the observer uses."""
    z_a_rate = -k_a * speed * xi_1_hat - k_a * (f - e_f) * modelled
    return z_a_rate, -k_f1 * speed - k_f2 * modelled + xi_1_hat


def _dynamic(rates: Mapping[str, Any], errors: Sequence[Any], first_order: Mapping[Any, Any]) -> dict[str, Any]:
    """The rates with their Jacobian at zero error."""
    jacobian = jacobian_at_zero(sympy.Matrix(list(rates.values())), sympy.Matrix(errors), first_order)
    expanded = {name: sympy.expand(r) for name, r in rates.items()}
    return {**expanded, "jacobian": jacobian.applyfunc(sympy.factor)}


GAINS = {"K_F": "k_F", "K_1": "k_1", "K_2": "k_2", "K_v": "k_v", "K_a": "k_a", "K_f1": "k_f1", "K_f2": "k_f2"}
PAIRS = {"level": "level", "tracked": "force", "coefficient": "a", "normalised": "f"}
"""Name in ``many_equations`` → name in ``one_equations``."""


def single_equations() -> Derivations:
    """State equations with the names of ``many_equations``, as 1 by 1 matrices in the symbols of one mass."""
    one = one_equations()
    v, v_hat, mu, w, F_hat, a_hat, f_hat = (one.names[k] for k in ("v", "v_hat", "mu", "w", "F_hat", "a_hat", "f_hat"))
    derived = {key: one.derived[key].value for key in ("velocity", "velocity_rate", "product")}
    for prefix, speed in (("", v), ("estimated_", v_hat)):
        for general, special in PAIRS.items():
            for end in ("", "_rate"):
                derived[f"{prefix}{general}{end}"] = one.derived[f"{prefix}{special}{end}"].value
        level_rate = f"{prefix}level_rate"
        derived[level_rate] = derived[level_rate].xreplace({F_hat: a_hat * Sgn(speed)})
    names = {k: s for k, s in one.names.items() if k != "u"} | _gains()
    names |= {"M_inv": 1, "U": 1, "U_T": 1, "g": w, "g_hat": w, "xi_hat": names["xi_1_hat"], "diag_f_hat": f_hat}
    names |= {"diag_a_hat": a_hat, "diag_slip": v, "diag_slip_hat": v_hat, "S": Sgn(v), "S_hat": Sgn(v_hat)}
    names |= {"h": Magnitude(v) ** mu, "D": mu * Magnitude(v) ** (mu - 1), "h_hat": Magnitude(v_hat), "D_hat": 1}
    return Derivations(_matrices(names), derived, positive=one.positive)


def single_errors() -> Derivations:
    """Error dynamics and Ψ with the names of ``many``, for one mass."""
    coulomb, tracking, dynamic, estimated = one_coulomb(), one_tracking(), one_dynamic(), one_dynamic_estimated()
    symbols = {**estimated.names, **coulomb.names}
    v, a, f, mu = (symbols[k] for k in ("v", "a", "f", "mu"))
    xi_v, xi_f, k_inv = real("xi_v", "xi_f", "K_inv")
    derived = {
        "e_a_dot": coulomb.derived["e_a_dot"],
        "e_F_dot": tracking.derived["e_F_dot"],
        "measured": dynamic.derived["jacobian"],
        "estimated": estimated.derived["jacobian"],
    }
    names = {key: symbols[key] for key in ("e_a", "e_F", "F_dot")} | _gains()
    names |= {"M_inv": 1, "U": 1, "U_T": 1, "S": Sgn(v), "D": mu * Magnitude(v) ** (mu - 1), "g_v": 0, "O": 0}
    names |= {"diag_a": a, "diag_f": f, "diag_slip": v, "xi_v": xi_v, "xi_f": xi_f, "K_inv": k_inv}
    names["a_dot"] = symbols["a_v"] * symbols["v_dot"]
    return Derivations(_matrices(names), derived, ranges=coulomb.ranges)


def _gains() -> dict[str, Any]:
    return dict(zip(GAINS, real(*GAINS.values()), strict=True))


def _matrices(entries: dict[str, Any]) -> dict[str, Any]:
    return {name: sympy.Matrix([[value]]) for name, value in entries.items()}
