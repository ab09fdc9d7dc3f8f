"""Friction laws, derived from the properties that their authors state."""

from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.derivation import Derivations, real, tidy


def friction_laws() -> Derivations:
    """The laws of chapter 1 and (2.4)–(2.5).

    A zero-memory friction force is odd in v: its level is a function of |v|. The reset integrator's f is at rest for
    f = φ(v), so that the velocity of a given f is φ⁻¹(f). Dahl's law is taken with φ = sgn.
    """
    v, f, c, a, i, n = real("v", "f", "c", "a", "i", "n")
    F_k, F_s, v_c, alpha, phi_inv_f, phi_inv_v = real("F_k", "F_s", "v_c", "alpha", "phi_inv_f", "phi_inv_v")
    a_1, a_2, a_3, a_4, g_1, g_2 = real("a_1", "a_2", "a_3", "a_4", "g_1", "g_2")
    level = a_1 + a_2 * sympy.exp(-a_3 * Magnitude(v)) + a_4 * Magnitude(v)
    dahl = c * v * Magnitude(1 - f * Sgn(v)) ** i * Sgn(1 - f * Sgn(v))
    names = {"phi_inv_v": phi_inv_v, "a_v": level.diff(v), "phi_v": Sgn(v)}
    names["dahl_slope"] = sympy.powsimp(tidy(dahl.diff(f)))

    def odd(expression: Any) -> Any:
        """The odd extension of a law that is given for v > 0."""
        return expression.subs(v, Magnitude(v)) * Sgn(v)

    s = sympy.Symbol("s")
    closed_loop = (s**2 + g_2 * s + g_1).subs({g_1: 200, g_2: 20})
    root = sympy.sqrt(sympy.Poly(closed_loop, s).TC())
    derived = {
        "tustin": odd(F_k + (F_s - F_k) * sympy.exp(-v / v_c)),
        "bo_pavelescu": odd(F_k + (F_s - F_k) * sympy.exp(-((v / alpha) ** n))),
        "dahl": dahl,
        "dahl_slope": dahl.diff(f),
        "reset_integrator": c * (v - phi_inv_f),
        "extended_level": level,
        "extended_slope": level.diff(v),
        "frequency": root,
        "damping": sympy.Poly(closed_loop, s).coeff_monomial(s) / (2 * root),
    }
    positive = frozenset({c, a, i, n, F_k, F_s, v_c, alpha, a_1, a_2, a_3, a_4})
    tries = tuple(sympy.Rational(k, 4) for k in (-4, -3, -2, -1, 1, 2, 3, 4))
    return Derivations(names, derived, positive=positive, ranges={i: (1, 2, 3), n: (1, 2), f: tries})


def piecewise_inverse() -> Derivations:
    """(6.33): the three pieces meet, and the whole is odd, as φ is."""
    f, c, D_1, D_2 = real("f", "c", "D_1", "D_2")
    middle = D_2 * f
    above = middle.subs(f, 1) + D_1 * (f - 1)  # continuous at 1, with slope D_1
    below = -above.subs(f, -f)
    pieces = sympy.Matrix([above, middle, below])
    slopes = pieces.diff(f)
    names = {"c": c} | {f"slope_{k + 1}": slopes[k] for k in range(3)}
    return Derivations(names, {"pieces": pieces, "slopes": slopes}, positive=frozenset({c, D_1, D_2}))
