"""The formulas of chapters 4 and 7 at n = 1 must be those of chapters 2, 3 and 6: one mass of 1 kg, U = 1."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import World, real
from codegen.thesis.audit.worlds.one_equations import one_equations
from codegen.thesis.audit.worlds.one_errors import one_coulomb, one_dynamic, one_dynamic_estimated, one_tracking

GAINS = {"K_F": "k_F", "K_1": "k_1", "K_2": "k_2", "K_v": "k_v", "K_a": "k_a", "K_f1": "k_f1", "K_f2": "k_f2"}
PAIRS = {"level": "level", "tracked": "force", "coefficient": "a", "normalised": "f"}
"""What many_equations calls it → what one_equations calls it."""


def single_equations() -> World:
    """State equations: the general names, as 1 by 1 matrices of the one mass' symbols."""
    one = one_equations()
    v, v_hat, mu, w, F_hat, a_hat, f_hat = (one.names[k] for k in ("v", "v_hat", "mu", "w", "F_hat", "a_hat", "f_hat"))
    derived = {key: one.derived[key].value for key in ("velocity", "velocity_rate", "product")}
    for prefix, speed in (("", v), ("estimated_", v_hat)):
        for general, special in PAIRS.items():
            for rate in ("", "_rate"):
                derived[f"{prefix}{general}{rate}"] = one.derived[f"{prefix}{special}{rate}"].value
        level_rate = f"{prefix}level_rate"
        derived[level_rate] = derived[level_rate].xreplace({F_hat: a_hat * Sgn(speed)})
    names = {k: s for k, s in one.names.items() if k != "u"} | _gains(one.names)
    names |= {"M_inv": 1, "U": 1, "U_T": 1, "g": w, "g_hat": w, "xi_hat": names["xi_1_hat"], "diag_f_hat": f_hat}
    names |= {"diag_a_hat": a_hat, "diag_slip": v, "diag_slip_hat": v_hat, "S": Sgn(v), "S_hat": Sgn(v_hat)}
    names |= {"h": Magnitude(v) ** mu, "D": mu * Magnitude(v) ** (mu - 1), "h_hat": Magnitude(v_hat), "D_hat": 1}
    return World(_matrices(names), derived, positive=one.positive)


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
    names = {key: symbols[key] for key in ("e_a", "e_F", "F_dot")} | _gains(symbols)
    names |= {"M_inv": 1, "U": 1, "U_T": 1, "S": Sgn(v), "D": mu * Magnitude(v) ** (mu - 1), "g_v": 0, "O": 0}
    names |= {"diag_a": a, "diag_f": f, "diag_slip": v, "xi_v": xi_v, "xi_f": xi_f, "K_inv": k_inv}
    names["a_dot"] = symbols["a_v"] * symbols["v_dot"]
    return World(_matrices(names), derived, ranges=coulomb.ranges)


def _gains(names: Any) -> dict[str, Any]:
    return {general: names[special] for general, special in GAINS.items() if special in names}


def _matrices(entries: dict[str, Any]) -> dict[str, Any]:
    return {name: sympy.Matrix([[value]]) for name, value in entries.items()}
