"""Certificates for any M(x), by the structure of the error equation: a Lyapunov function that decouples into modes.

One mode is certified for an interval of eigenvalues that holds all modes. The extremes of M(x) over the envelope are an
assumption: they are estimated at operating points and not proved.

Measured velocity, a tracker: e[k+1] = (I − h G M⁻¹(x)) e[k], G = −K_2 symmetric and positive definite, so with
f = G^(−1/2) e and N = G^(1/2) M⁻¹ G^(1/2), which is symmetric, f[k+1] = (I − h N(x)) f[k] and V = e'G⁻¹e = |f|²
falls in a sample by (1 − hν)² at least for every eigenvalue ν of N, which are those of G M⁻¹, whatever x does from
sample to sample. It remains to certify the scalar case for all ν in an interval.

Estimated velocity, K_v = k I and an M(x) that moves slowly compared with it: in force errors e_f and velocity errors
e_v the step of a tracker with n contacts on n coordinates is

    e_v[k+1] = e_v − hk e_v − hM⁻¹e_f + hD e_v,    e_f[k+1] = e_f + hkG e_v,

G symmetric, D = M⁻¹∂g/∂v. With u = G^½ e_v, f = G^(−½) e_f, T = G^(−½) M G^(−½) and N = T⁻¹ the function

    V = |f + βu|² + a (u + κf)'T (u + κf),    β = hk/2,

needs three figures of the machine: the interval in which the eigenvalues ν of N (those of G M⁻¹) lie, the growth of M
in a sample, M(x + hv) ≤ (1 + μh) M(x), and |(D + ζI) e|_M ≤ η |e|_M. In the eigenbasis of N the step decouples into
modes, σ = √ν. With r = T^½(u + κf), φ = f + βu and d = T^½G^½(D + ζI)e_v of a mode, Σ|d|² ≤ η² Σ|T^½u|², a sample takes

    (r, φ, d)  to  ((1 + μh/2) r of the step, φ of the step, η T^½u),

and if a|r|² + |φ|² + ρ|d|² falls there by a factor for every mode and every d, V falls by it: the ρ terms together are
not above zero. So one 3 by 3 matrix over σ in an interval is certified.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric
from codegen.certify.content import Frame, lines, one_line
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.certify.machine_extremes import MARGIN, Extremes, extremes
from codegen.certify.prefix import rational_text, rounded, rounded_matrix, texts
from codegen.checker import verify
from codegen.mechanics.system import Matrix
from codegen.spec.model import symbol

SLOWER = 1 - 1e-3
DIGITS = 6
MODES = 40
MOST_CELLS = 400
SLOPES = (0.8, 1.1, 1.4, 1.8)
"""κk over the slowest ν: κ is the share of the force error in r."""
LESS = (0.97, 0.9, 0.75)
FINEST = 1e-3
MODE, SIGMA, P, Q, NU = (symbol(name) for name in ("mode", "sigma", "p", "q", "nu"))
COORDINATES = (
    ("r", "a component of T^(1/2) (u + kappa f), u = G^(1/2) e_v, f = G^(-1/2) e_f"),
    ("phi", "a component of f + beta u"),
    ("d", "a component of T^(1/2) (D + zeta) u, D the slope of M^-1 g in v"),
)


def by_structure(analysis: Analysis, stated: Frame) -> dict[str, Any] | None:
    """The certificate's content, which the checker has accepted; None where the observer is not of this structure."""
    content = _measured(analysis, stated) or _estimated(analysis, stated)
    if content is None:
        return None
    try:
        verify.check(json.dumps(content))
    except verify.Refused:
        return None
    return content


def _measured(analysis: Analysis, stated: Frame) -> dict[str, Any] | None:
    observer, modes = analysis.dynamics.observer, analysis.modes
    form = observer.cascade
    if modes is None or form is None or observer.velocity != "measured" or observer.integration != "euler":
        return None
    if observer.level_errors or not form.weight.is_Identity or not modes.jury:
        return None
    h = float(observer.sample_time)
    low, high = modes.smallest * (1 - MARGIN), modes.largest * (1 + MARGIN)
    if not 0 < low <= high < 2 / h:
        return None
    ends = rounded(low, 4), rounded(high, 4)
    family = Family({NU: ends}, {MODE: NU}, Matrix([[-MODE]]))
    rate = rounded(SLOWER * min(float(end) * (1 - h * float(end) / 2) for end in ends), 4)
    words = {"observer": observer, "rate": float(rate), "period": h, "modes": modes, "ends": [float(e) for e in ends]}
    words |= {"points": len(analysis.points.values), "share": MARGIN}
    return {
        **stated(analysis, family),
        "claim": one_line("text/structure_claim.j2", **words),
        "assumptions": lines("text/structure_assumptions.j2", **words),
        "error": [{"name": "f", "meaning": "a component of G^(-1/2) e, e the force errors, G = -K_2", "unit": "1"}],
        "lyapunov_matrix": [["1"]],
        "decay_rate": rational_text(rate),
    }


def _estimated(analysis: Analysis, stated: Frame) -> dict[str, Any] | None:
    found = moving_mass(analysis)
    if found is None:
        return None
    rate = rounded(found.alpha * SLOWER, 4)
    p = found.matrix / found.matrix[1, 1]
    exact = rounded_matrix(p, DIGITS, np.sqrt(np.diag(p)))
    words = {"found": found, "rate": float(rate), "period": float(analysis.dynamics.observer.sample_time)}
    words |= {"a": float(exact[0][0] / exact[1][1]), "ends": [float(e) for e in (found.splits[0], found.splits[-1])]}
    words |= {"variables": {s.name: [float(e) for e in ends] for s, ends in analysis.points.ranges.items()}}
    return {
        **stated(analysis, found.family),
        "claim": one_line("text/moving_mass_claim.j2", **words),
        "assumptions": lines("text/moving_mass_assumptions.j2", **words),
        "error": [{"name": name, "meaning": meaning, "unit": "1"} for name, meaning in COORDINATES],
        "splits": {SIGMA.name: [str(s) for s in found.splits]},
        "lyapunov_matrix": texts(exact),
        "decay_rate": rational_text(rate),
    }


@dataclass(frozen=True)
class MovingMass:
    """A family of one mode that is certified in place of the whole matrix, and what was found for it.

    Attributes:
        family: over σ.
        matrix: P, 3 by 3.
        splits: of σ, exact.
        alpha: 1/s.
        extremes: what is assumed of the machine.
        kappa, beta: of V, exact.
    """

    family: Family
    matrix: Array
    splits: list[Fraction]
    alpha: float
    extremes: Extremes
    kappa: Any
    beta: Any


def moving_mass(analysis: Analysis) -> MovingMass | None:
    """What can be certified so; None where the observer has another structure, or nothing is found."""
    gains = _structure(analysis)
    if gains is None:
        return None
    k, gain = gains
    found = extremes(analysis, float(k), gain)
    return None if found is None else certified_mode(analysis.dynamics.observer.sample_time, k, found)


def certified_mode(h: Any, k: Any, found: Extremes) -> MovingMass | None:
    """The mode of a machine with these figures, with the κ and P that show the largest rate; None if none is found.

    Args:
        h, k: sample time in s and velocity gain in 1/s, exact.
    """
    if not (found.slowest > 0 and k * h < 1):
        return None
    low, high = Fraction(str(math.sqrt(found.slowest))), Fraction(str(math.sqrt(found.fastest)))
    ends = Fraction(math.floor(low * 1000), 1000), Fraction(math.ceil(high * 1000), 1000)
    if ends[0] <= 0:
        return None
    best: tuple[float, Any, Matrix, Array] | None = None
    beta = h * k / 2
    for share in SLOPES:
        kappa = rounded(share * found.slowest / float(k), 3)
        step = mode_step(h, k, found, kappa, beta)
        function = _numbers(step)
        sampled = [_corners(function, s, s)[0] for s in geometric(float(ends[0]), float(ends[1]), MODES)]
        proposal = common_lyapunov(sampled, float(h), np.eye(3, dtype=bool))
        if proposal is not None and (best is None or proposal[1] > best[0]):
            best = proposal[1], kappa, step, proposal[0]
    if best is None:
        return None
    alpha, kappa, step, p = best
    exact = (sympy.Rational(ends[0]), sympy.Rational(ends[1]))
    family = Family({SIGMA: exact}, {P: SIGMA, NU: SIGMA**2, Q: 1 / SIGMA}, step)
    for less in LESS:
        splits = _splits(step, p, ends, alpha * less, float(h))
        if splits is not None:
            return MovingMass(family, p, splits, alpha * less, found, kappa, beta)
    return None


def _structure(analysis: Analysis) -> tuple[Any, Array] | None:
    """(k, G) where the sampled matrix is that of the module's head with these, exactly; else None."""
    dynamics = analysis.dynamics
    observer, n = dynamics.observer, dynamics.observer.system.degrees_of_freedom
    if observer.velocity != "estimated" or observer.integration != "euler" or not dynamics.inverse_mass:
        return None
    if observer.level_errors:  # a sample in which the sign of the estimated slip turns moves the level
        return None
    a = Matrix(dynamics.in_force(dynamics.sampled).xreplace(dict(observer.values)))
    if a.rows != 2 * n or any(e != 0 for e in a[n:, n:]) or a[:n, n:] != -dynamics.inverse_mass_matrix:
        return None
    velocity = -a[:n, :n].xreplace(dict.fromkeys(dynamics.inverse_mass, sympy.Integer(0)))
    k = velocity[0, 0]
    if velocity != k * sympy.eye(n) or not k.is_Rational or k <= 0:
        return None
    gain = a[n:, :n] / k
    if any(not e.is_Rational for e in gain) or gain != gain.T:
        return None
    numbers = np.array(gain.tolist(), dtype=float)
    return (k, numbers) if np.linalg.eigvalsh(numbers)[0] > 0 else None


def mode_step(h: Any, k: Any, machine: Extremes, kappa: Any, beta: Any) -> Matrix:
    """A of one mode in (r, φ, d), 3 by 3 over p = σ, nu = σ², q = 1/σ: a sample takes (r, φ, d) to (I + hA)(r, φ, d).

    Args:
        h, k: sample time and velocity gain, exact; ``kappa``, ``beta`` of V.
    """
    r, phi, d, s = sympy.symbols("r phi d s")
    share = 1 - kappa * beta
    u, f = (s * r - kappa * phi) / share, (phi - beta * s * r) / share
    u_next = (1 - h * (k + machine.shift)) * u - h * s**2 * f + h * s * d
    f_next = f + h * k * u
    growth = 1 + machine.growth * h / 2
    after = sympy.Matrix([growth * (u_next + kappa * f_next) / s, f_next + beta * u_next, machine.slope * u / s])
    rates = (after.jacobian([r, phi, d]) - sympy.eye(3)) / h
    return Matrix(rates.applyfunc(lambda e: _named(e, s)))


def _named(entry: Any, s: sympy.Symbol) -> Any:
    """A sum of powers of σ from −1 to 3 over p = σ, nu = σ² and q = 1/σ, multi-affine."""
    words = (Q, sympy.Integer(1), P, NU, P * NU)
    polynomial = sympy.Poly(sympy.expand(entry * s), s)
    return sum((polynomial.coeff_monomial(s**i) * word for i, word in enumerate(words)), sympy.Integer(0))


def _splits(step: Matrix, p: Array, ends: tuple[Fraction, Fraction], alpha: float, h: float) -> list[Fraction] | None:
    """Cuts of σ between which p, 1/σ and σ² are close enough to one another; None where they would be too many."""
    waiting, done, function = [ends], [ends[0]], _numbers(step)
    while waiting and len(done) + len(waiting) <= MOST_CELLS:
        a, b = waiting.pop()
        steps = np.eye(3) + h * np.array(_corners(function, float(a), float(b)))
        gaps = (1 - 2 * alpha * h) * p - steps.transpose(0, 2, 1) @ p @ steps
        if np.linalg.eigvalsh(gaps)[:, 0].min() > 0:
            done.append(b)
        elif b - a < FINEST * b:
            return None
        else:
            middle = Fraction(round(float(a + b) * 5000), 10000)
            waiting += [(middle, b), (a, middle)]
    return None if waiting else done


def _numbers(step: Matrix) -> Callable[..., Any]:
    """A over (σ, σ², 1/σ) in floating point."""
    function: Callable[..., Any] = sympy.lambdify((P, NU, Q), step, "numpy")
    return function


def _corners(function: Callable[..., Any], a: float, b: float) -> list[Array]:
    """A at the vertices of the box around σ in [a, b]."""
    box = sorted(set(product((a, b), (a * a, b * b), (1 / a, 1 / b))))
    return [np.array(function(*corner), dtype=float) for corner in box]
