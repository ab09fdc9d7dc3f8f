"""State equations of the observers of one mass, derived by one principle, to be compared with the printed ones.

An observer estimates a quantity p as p̂ = z + φ, with a state z and a function φ of what is measured. From the wanted
rate of p̂, which the model gives, follows the rate of the state: ż = (dp̂/dt by the model) − dφ/dt. Every unknown in it
is replaced by its estimate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import World, named, rate, real


def one_equations() -> World:
    """Equations of chapters 2, 3 and 6. ``w`` is the input; u = w − F̂ by (2.11) and (6.7)."""
    v, v_hat, x, w, F_hat = real("v", "v_hat", "x", "w", "F_hat")
    names, derived = _equations(x, v, v_hat, w, F_hat)
    return World(names | {"u": w - F_hat}, derived, positive=frozenset({names["mu"]}))


def compensated() -> World:
    """Equations (2.11), (6.7), (8.14): the input w for which v̇ = u if the friction estimate is right."""
    u, w, F_hat, x, x_r, v, g_1, g_2 = real("u", "w", "F_hat", "x", "x_r", "v", "g_1", "g_2")
    plant = w - F_hat  # v̇ at F = F̂
    return World(named((u, F_hat, x, x_r, v, g_1, g_2)), {"input": sympy.solve(plant - u, w)[0]})


def rig_equations() -> World:
    """Equations of chapter 8: angle θ in place of x, ω in place of v, unit inertia as in (8.2); u = w − F̂ by (8.14).

    The thesis names the gains of the Dahl observer k_d, k_d1, k_d2 in place of k_a, k_f1, k_f2, and all velocity gains
    of this chapter k_ω in place of k_v. Each equation is derived with the names of the other chapters and renamed.
    """
    omega, omega_hat, theta, w, F_hat = real("omega", "omega_hat", "theta", "w", "F_hat")
    names, derived = _equations(theta, omega, omega_hat, w, F_hat)
    a_hat, f_hat, c, i, phi_inv = real("a_hat", "f_hat", "c", "i", "phi_inv_f_hat")
    names |= named((c, i, phi_inv))
    dahl = c * omega_hat * Magnitude(1 - f_hat * Sgn(omega_hat)) ** i * Sgn(1 - f_hat * Sgn(omega_hat))
    for model, xi in (("reset", c * (omega_hat - phi_inv)), ("dahl", dahl)):
        for key in ("a_rate", "f_rate"):
            derived[f"{model}_{key}"] = derived[f"estimated_{key}"].subs({names["xi_1_hat"]: xi, F_hat: a_hat * f_hat})
    names["u"] = w - a_hat * f_hat
    dahl_gains = dict(zip(("k_a", "k_f1", "k_f2"), real("k_d", "k_d1", "k_d2"), strict=True))
    (k_omega,) = real("k_omega")
    for key, source in (("dahl_a", "estimated_a"), ("dahl_f", "estimated_f"), *[(k, k) for k in tuple(derived)]):
        rename = {names[old]: new for old, new in dahl_gains.items()} if key.startswith("dahl") else {}
        derived[key] = derived[source].subs(rename | {names["k_v"]: k_omega})
    names |= named(dahl_gains.values()) | {"k_omega": k_omega, "k_v": k_omega}
    derived["printed_coulomb"] = _printed_coulomb(names)
    positive = frozenset({names["mu"], c, i})
    return World(names, derived, positive=positive, ranges={i: (1, 2)})


def _printed_coulomb(names: Mapping[str, Any]) -> Any:
    """Ψ of the errors (e_v, e_F) for plant (8.1)–(8.2) and observer (8.4)–(8.5) as printed, with their signs.

    The slip has one sign s.
    """
    e_v, e_F, omega_dot, s = real("e_v", "e_F", "omega_dot", "s")
    k_F, k_v = names["k_F"], names["k_v"]
    modelled = omega_dot + e_F  # w − F̂, since ω̇ = w − F
    omega_hat_rate = modelled + k_v * e_v
    F_hat_rate = -k_F * modelled * s * s + k_F * s * omega_hat_rate * s
    rates = sympy.Matrix([omega_dot - omega_hat_rate, -F_hat_rate]).expand().subs(s**2, 1)
    return rates.jacobian(sympy.Matrix([e_v, e_F]))


def _equations(x: Any, v: Any, v_hat: Any, w: Any, F_hat: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Symbols by name, and formula of each estimate NAME with the rate of its state, NAME_rate.

    Those with the prefix ``estimated_`` use v̂ in place of a measured velocity.
    """
    k_F, mu, k_1, k_2, k_v, k_a, k_f1, k_f2 = real("k_F", "mu", "k_1", "k_2", "k_v", "k_a", "k_f1", "k_f2")
    z_F, z, z_v, z_a, z_f, f_hat, a_hat = real("z_F", "z", "z_v", "z_a", "z_f", "f_hat", "a_hat")
    x_r, g_1, g_2, xi_1_hat = real("x_r", "g_1", "g_2", "xi_1_hat")
    gains, states = (k_F, mu, k_1, k_2, k_v, k_a, k_f1, k_f2), (z_F, z, z_v, z_a, z_f, f_hat, a_hat)
    names = named((x, v, v_hat, w, F_hat, *gains, *states, x_r, g_1, g_2, xi_1_hat))
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
    return names, derived
