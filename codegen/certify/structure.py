"""Certificates by structure, for any M(x): a Lyapunov function under which the error of a tracker decouples into modes.

One mode is certified, for an interval that contains the eigenvalues of all modes. That the mode stands for the whole
error is theorem 8 of docs/certificate_theory.md, which the checker does not check. The extremes of M(x) over the
envelope are an assumption: they are estimated by optimisation, not proved.

**Measured velocity.** With G = −K_2 symmetric and positive definite, f = G^(−½) e and N = G^½ M⁻¹ G^½,

    e[k+1] = (I − h G M⁻¹(x)) e[k]    ⇔    f[k+1] = (I − h N(x)) f[k],    V = e'G⁻¹e = |f|².

N is symmetric with the eigenvalues ν of G M⁻¹, so V[k+1] ≤ max_ν (1 − hν)² V[k], however x moves between samples. The
scalar step 1 − hν is certified for ν in an interval.

**Estimated velocity, K_v = k I.** In velocity errors e_v and force errors e_f the step is

    e_v[k+1] = e_v − h k e_v − h M⁻¹ e_f + h D e_v,    e_f[k+1] = e_f + h k G e_v,

with G symmetric and D = M⁻¹ ∂g/∂v. With u = G^½ e_v, f = G^(−½) e_f, T = G^(−½) M G^(−½), N = T⁻¹ and β = hk/2, let

    V = |f + βu|² + a (u + κf)' T (u + κf).

Three properties of the machine are needed (``Extremes``):

1. the eigenvalues ν of N, which are those of G M⁻¹, lie in an interval;
2. M grows in a sample by a bounded factor, M(x + hv) ≤ (1 + μh) M(x);
3. |(D + ζI) e|_M ≤ η |e|_M.

In the eigenbasis of N the step decouples into modes. With σ = √ν let r, φ and d be one component of T^½(u + κf),
f + βu and T^½G^½(D + ζI)e_v; by property 3, Σ|d|² ≤ η² Σ|T^½u|². The 3 by 3 matrix of ``mode_step`` maps

    (r, φ, d)  to  ((1 + μh/2) r⁺, φ⁺, η T^½u),    r⁺, φ⁺ after a step with M held.

If a|r|² + |φ|² + ρ|d|² decreases under it by a factor, for every σ in the interval and every d, then V decreases by the
same factor, because the terms in ρ add up to at most zero.
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
from codegen.certify.content import Found, Frame, lines, one_line
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.certify.machine_extremes import MARGIN, Extremes, extremes
from codegen.certify.prefix import rational_text, rounded, rounded_matrix, texts
from codegen.checker import verify
from codegen.mechanics.system import Matrix
from codegen.spec.model import symbol

SLOWER = 1 - 1e-3
"""Quotient of the certified rate and the rate found in floating point."""
DIGITS = 6
"""Significant digits of the entries of P."""
MODES = 40
"""Values of σ for which P is searched."""
MOST_CELLS, FINEST = 400, 1e-3
"""Largest number of intervals of σ, and least length of an interval relative to its upper end."""
KAPPAS = (0.8, 1.1, 1.4, 1.8)
"""Values of κk/ν that are tried, ν being the least eigenvalue."""
SHARES = (0.97, 0.9, 0.75)
"""Shares of the rate at the ``MODES`` values that are tried for the whole interval of σ."""
MODE, SIGMA, P, Q, NU = (symbol(name) for name in ("mode", "sigma", "p", "q", "nu"))
"""Parameter of the scalar step, the variable σ, and the parameters p = σ, q = 1/σ and nu = σ² of the 3 by 3 step."""
COORDINATES = (
    ("r", "a component of T^(1/2) (u + kappa f), u = G^(1/2) e_v, f = G^(-1/2) e_f"),
    ("phi", "a component of f + beta u"),
    ("d", "a component of T^(1/2) (D + zeta) u, D the slope of M^-1 g in v"),
)
"""(name, meaning) of each component of the error of one mode in a certificate."""


def by_structure(analysis: Analysis, stated: Frame) -> tuple[dict[str, Any], verify.Report] | None:
    """(certificate's JSON object, report of the checker that accepted it); None if there is no certificate.

    Args:
        stated: (analysis, family) → the fields of a certificate that do not depend on the proof.
    """
    content = _measured(analysis, stated) or _estimated(analysis, stated)
    if content is None:
        return None
    try:
        return content, verify.check(json.dumps(content))
    except verify.Refused:
        return None


def _measured(analysis: Analysis, stated: Frame) -> dict[str, Any] | None:
    """The certificate for measured velocity, from the scalar step 1 − hν; None if the observer has another form."""
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
    """The certificate for estimated velocity with K_v = k I; None if the observer has another form or no V is found."""
    mode = moving_mass(analysis)
    if mode is None:
        return None
    rate = rounded(mode.rate * SLOWER, 4)
    p, splits = mode.p / mode.p[1, 1], mode.splits[SIGMA]
    exact = rounded_matrix(p, DIGITS, np.sqrt(np.diag(p)))
    words = {"mode": mode, "rate": float(rate), "period": float(analysis.dynamics.observer.sample_time)}
    words |= {"a": float(exact[0][0] / exact[1][1]), "ends": [float(e) for e in (splits[0], splits[-1])]}
    words |= {"variables": {s.name: [float(e) for e in ends] for s, ends in analysis.points.ranges.items()}}
    return {
        **stated(analysis, mode.family),
        "claim": one_line("text/moving_mass_claim.j2", **words),
        "assumptions": lines("text/moving_mass_assumptions.j2", **words),
        "error": [{"name": name, "meaning": meaning, "unit": "1"} for name, meaning in COORDINATES],
        "splits": {SIGMA.name: [str(s) for s in splits]},
        "lyapunov_matrix": texts(exact),
        "decay_rate": rational_text(rate),
    }


@dataclass(frozen=True, kw_only=True)
class MovingMass(Found):
    """The certified mode of an observer with estimated velocity: P for the matrix of ``mode_step`` over σ.

    Attributes:
        extremes: the assumed properties of the machine.
        kappa, beta: κ and β of V, exact.
    """

    extremes: Extremes
    kappa: Any
    beta: Any


def moving_mass(analysis: Analysis) -> MovingMass | None:
    """The certified mode of an observer; None if its structure is another one, or if no V is found."""
    gains = _structure(analysis)
    if gains is None:
        return None
    k, gain = gains
    machine = extremes(analysis, float(k), gain)
    return None if machine is None else certified_mode(analysis.dynamics.observer.sample_time, k, machine)


def certified_mode(h: Any, k: Any, machine: Extremes) -> MovingMass | None:
    """The mode with the κ and P that give the largest rate; None if no V is found.

    P is searched for ``MODES`` values of σ, then checked on intervals that cover all of σ (``_splits``).

    Args:
        h, k: sample time in s and velocity gain in 1/s, exact.
    """
    if not (machine.slowest > 0 and k * h < 1):
        return None
    low, high = Fraction(str(math.sqrt(machine.slowest))), Fraction(str(math.sqrt(machine.fastest)))
    ends = Fraction(math.floor(low * 1000), 1000), Fraction(math.ceil(high * 1000), 1000)
    if ends[0] <= 0:
        return None
    best: tuple[float, Any, Matrix, Array] | None = None
    beta = h * k / 2
    for ratio in KAPPAS:
        kappa = rounded(ratio * machine.slowest / float(k), 3)
        step = mode_step(h, k, machine, kappa, beta)
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
    for share in SHARES:
        splits = _splits(step, p, ends, alpha * share, float(h))
        if splits is not None:
            return MovingMass(family, p, alpha * share, {SIGMA: splits}, extremes=machine, kappa=kappa, beta=beta)
    return None


def _structure(analysis: Analysis) -> tuple[Any, Array] | None:
    """(k, G) if the sampled matrix is exactly that of the module's equations for estimated velocity; else None."""
    dynamics = analysis.dynamics
    observer, n = dynamics.observer, dynamics.observer.system.degrees_of_freedom
    if observer.velocity != "estimated" or observer.integration != "euler" or not dynamics.inverse_mass:
        return None
    if observer.level_errors:  # the step in which the estimated slip changes its sign would change the level
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
    """A of the step (r, φ, d) → (I + hA)(r, φ, d) of one mode, 3 by 3 over p = σ, nu = σ² and q = 1/σ.

    For a mode T = 1/σ², so r = (u + κf)/σ and φ = f + βu; these are solved for u and f.

    Args:
        h, k: sample time and velocity gain, exact; ``kappa``, ``beta`` of V.
    """
    r, phi, d, s = sympy.symbols("r phi d s")
    determinant = 1 - kappa * beta
    u, f = (s * r - kappa * phi) / determinant, (phi - beta * s * r) / determinant
    u_next = (1 - h * (k + machine.shift)) * u - h * s**2 * f + h * s * d
    f_next = f + h * k * u
    growth = 1 + machine.growth * h / 2
    after = sympy.Matrix([growth * (u_next + kappa * f_next) / s, f_next + beta * u_next, machine.slope * u / s])
    rates = (after.jacobian([r, phi, d]) - sympy.eye(3)) / h
    return Matrix(rates.applyfunc(lambda e: _multi_affine(e, s)))


def _multi_affine(entry: Any, s: sympy.Symbol) -> Any:
    """A sum of powers σ⁻¹ to σ³, written multi-affinely in p = σ, nu = σ² and q = 1/σ (σ³ as p nu)."""
    powers = (Q, sympy.Integer(1), P, NU, P * NU)
    polynomial = sympy.Poly(sympy.expand(entry * s), s)
    return sum((polynomial.coeff_monomial(s**i) * power for i, power in enumerate(powers)), sympy.Integer(0))


def _splits(step: Matrix, p: Array, ends: tuple[Fraction, Fraction], alpha: float, h: float) -> list[Fraction] | None:
    """Ends of intervals of σ such that P proves the rate at every vertex of the box of (σ, σ², 1/σ) over each; or None.

    Found by bisection. None if more than ``MOST_CELLS`` intervals, or shorter ones than ``FINEST``, would be needed.
    """
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
    """A at the vertices of the box of (σ, σ², 1/σ) for σ in [a, b]."""
    box = sorted(set(product((a, b), (a * a, b * b), (1 / a, 1 / b))))
    return [np.array(function(*corner), dtype=float) for corner in box]
