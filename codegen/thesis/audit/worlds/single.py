"""The formulas of chapters 4 and 7 at n = 1 must be those of chapters 2, 3 and 6: one mass of 1 kg, U = 1."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import Derived, World, real
from codegen.thesis.audit.worlds.one_dynamic import one_dynamic, one_dynamic_estimated
from codegen.thesis.audit.worlds.one_equations import one_equations
from codegen.thesis.audit.worlds.one_errors import one_coulomb, one_tracking

GAINS = {"K_F": "k_F", "K_1": "k_1", "K_2": "k_2", "K_v": "k_v", "K_a": "k_a", "K_f1": "k_f1", "K_f2": "k_f2"}
PAIRS = {  # what many_equations calls it → what one_equations calls it
    "level": "level",
    "level_rate": "level_rate",
    "tracked": "force",
    "tracked_rate": "force_rate",
    "coefficient": "a",
    "coefficient_rate": "a_rate",
    "normalised": "f",
    "normalised_rate": "f_rate",
}


def single_equations() -> World:
    """State equations: the general names, as 1 by 1 matrices of the one mass' symbols."""
    one = one_equations()
    v, v_hat, mu, w, F_hat, a_hat = (one.names[k] for k in ("v", "v_hat", "mu", "w", "F_hat", "a_hat"))
    derived: dict[str, Derived] = {}
    for prefix, speed in (("", v), ("estimated_", v_hat)):
        for general, special in PAIRS.items():
            value = one.derived[f"{prefix}{special}"].value
            coulomb = {F_hat: a_hat * Sgn(speed)} if general == "level_rate" else {}
            derived[f"{prefix}{general}"] = Derived(value.xreplace(coulomb))
    derived |= {key: one.derived[key] for key in ("velocity", "velocity_rate", "product")}
    names = _matrices({**{k: s for k, s in one.names.items() if k != "u"}, **_gains(one.names)})
    f_hat, xi = one.names["f_hat"], one.names["xi_1_hat"]
    names |= _matrices({"M_inv": 1, "U": 1, "U_T": 1, "g": w, "g_hat": w, "xi_hat": xi, "diag_f_hat": f_hat})
    names |= _matrices({"diag_a_hat": a_hat, "diag_slip": v, "diag_slip_hat": v_hat, "S": Sgn(v), "S_hat": Sgn(v_hat)})
    names |= _matrices(
        {"h": Magnitude(v) ** mu, "D": mu * Magnitude(v) ** (mu - 1), "h_hat": Magnitude(v_hat), "D_hat": 1}
    )
    return World(names, derived, positive=one.positive)


def single_errors() -> World:
    """Error dynamics and Ψ."""
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
    names = _matrices({"e_a": symbols["e_a"], "e_F": symbols["e_F"], "F_dot": symbols["F_dot"], **_gains(symbols)})
    names |= _matrices(
        {"M_inv": 1, "U": 1, "U_T": 1, "S": Sgn(v), "D": mu * Magnitude(v) ** (mu - 1), "g_v": 0, "O": 0}
    )
    names |= _matrices({"diag_a": a, "diag_f": f, "diag_slip": v, "xi_v": xi_v, "xi_f": xi_f, "K_inv": k_inv})
    names |= _matrices({"a_dot": symbols["a_v"] * symbols["v_dot"]})
    return World(names, derived, ranges=coulomb.ranges)


def _gains(names: Any) -> dict[str, Any]:
    return {general: names[special] for general, special in GAINS.items() if special in names}


def _matrices(entries: dict[str, Any]) -> dict[str, Any]:
    return {name: sympy.Matrix([[value]]) for name, value in entries.items()}
