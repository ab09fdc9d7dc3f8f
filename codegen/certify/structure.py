"""Certificates by structure, for any M(x): a Lyapunov function under which the error of a tracker decouples into modes.

One mode is certified, for an interval that contains the eigenvalues ν of all modes, those of G M⁻¹, G = −K_2 symmetric
and positive definite. That the mode represents the whole error is theorem 8 of docs/certificate_theory.md, which the
checker does not check, and which defines r, φ, d, T, κ, μ, ζ and η. What the theorem needs of M(x) over the envelope
(``Extremes``) is an assumption: it is estimated by optimisation, not proved.

- Measured velocity: e[k+1] = (I − h G M⁻¹(x)) e[k]. The scalar step 1 − hν is certified.
- Estimated velocity, K_v = k I: with velocity errors e_v, force errors e_f and D = M⁻¹ ∂g/∂v the step is

      e_v[k+1] = e_v − h k e_v − h M⁻¹ e_f + h D e_v,    e_f[k+1] = e_f + h k G e_v,

  and V = |f + βu|² + a (u + κf)' T (u + κf), β = hk/2. The 3 by 3 step of (r, φ, d) is certified (``mode_step``).

M⁻¹ and ∂g/∂v are taken from the sampled error matrix: its upper right block is −M⁻¹(x), its upper left block
−k I + M⁻¹∂g/∂v. L is the Cholesky factor, M = L L', and |e|_M = √(e'Me).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.operating_points import matrix_function
from codegen.base.arrays import Array
from codegen.base.exact_numbers import geometric, powers_of_ten
from codegen.certify.certificate_text import rounded
from codegen.certify.content import Found, Frame, lines, one_line, proved
from codegen.certify.cover import with_cover
from codegen.certify.enclosure import Enclosure
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.checker import verify
from codegen.mechanics.casadi_form import at_points
from codegen.mechanics.system import Matrix
from codegen.spec.model import symbol

MODES = 40
"""Values of σ for which P is searched."""
KAPPAS = (0.8, 1.1, 1.4, 1.8)
"""Values of κk/ν that are tried, ν being the least eigenvalue."""
MODE, SIGMA, P, Q, NU = (symbol(name) for name in ("mode", "sigma", "p", "q", "nu"))
"""Parameter of the scalar step, the variable σ, and the parameters p = σ, q = 1/σ and nu = σ² of the 3 by 3 step."""
SCALAR = (("f", "a component of G^(-1/2) e, e the force errors, G = -K_2"),)
COORDINATES = (
    ("r", "a component of T^(1/2) (u + kappa f), u = G^(1/2) e_v, f = G^(-1/2) e_f"),
    ("phi", "a component of f + beta u"),
    ("d", "a component of T^(1/2) (D + zeta) u, D the slope of M^-1 g in v"),
)
"""(name, meaning) of each component of the error of one mode in a certificate: measured and estimated velocity."""
POINTS = 4000
"""Random points of the envelope."""
KEPT, TRIALS, ROUNDS = 20, 10, 30
"""Random search: number of best points that each round starts from, of trial points about each of them, of rounds."""
DECADES = 4
"""A third of the points have their velocities scaled by 10^-s, s uniform in [0, DECADES]."""
SCALED = 0.3
"""Share of trial points that are scaled rather than shifted."""
MARGIN = 0.1
"""Relative margin on the extremes found."""
SHIFTS = np.linspace(0, 1, 21)
"""Values of ζ that are tried, as shares of the largest norm of M⁻¹∂g/∂v."""
DIGITS = 3
"""Significant digits of the extremes in the certificate."""


def by_structure(analysis: Analysis, stated: Frame) -> tuple[dict[str, Any], verify.Report] | None:
    """(certificate's JSON object, report of the checker that accepted it); None if there is no certificate."""
    if (found := _measured(analysis) or moving_mass(analysis)) is None:
        return None

    def finish(_: Found, content: dict[str, Any]) -> dict[str, Any]:
        """The certificate with the mode's own errors, claim and assumptions."""
        template, errors, words = _of_all(analysis, found, content["lyapunov_matrix"])
        words |= {"rate": float(Fraction(content["decay_rate"])), "period": float(Fraction(content["sample_time"]))}
        return content | {
            "claim": one_line(f"text/{template}_claim.j2", **words),
            "assumptions": lines(f"text/{template}_assumptions.j2", **words),
            "error": [{"name": name, "meaning": meaning, "unit": "1"} for name, meaning in errors],
        }

    with suppress(verify.Refused):
        return proved([(stated(analysis, found.family), found)], analysis, finish)[0]
    return None


def without_formula(analysis: Analysis) -> str:
    """What a refused observer of a robot file lacks for a certificate by structure, in words."""
    if _structure(analysis) is None:
        form = "a symmetric K_2, `integration: euler`, and velocity measured or the same K_v at all joints"
        return f"without a formula only a `gto` with {form} can have a certificate, if its error decays fast enough"
    return "a certificate by structure was tried, and no V found: other gains, as `stiction gains` suggests, may help"


def _measured(analysis: Analysis) -> Found | None:
    """The certified mode of measured velocity, the scalar step 1 − hν; None if the observer has another form."""
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
    return Found(family, np.eye(1), min(float(end) * (1 - h * float(end) / 2) for end in ends))


def _of_all(analysis: Analysis, found: Found, p: list[list[str]]) -> tuple[str, Any, dict[str, Any]]:
    """(beginning of the templates' names, (name, meaning) of the mode's errors, templates' variables) for the claim."""
    if not isinstance(found, MovingMass):
        words = {"modes": analysis.modes, "points": len(analysis.points.values), "share": MARGIN}
        return "structure", SCALAR, words | {"ends": [float(e) for e in found.family.variables[NU]]}
    ranges = {s.name: [float(e) for e in ends] for s, ends in analysis.points.ranges.items()}
    ends = [float(e) for e in found.family.variables[SIGMA]]
    return (
        "moving_mass",
        COORDINATES,
        {"mode": found, "a": float(Fraction(p[0][0]) / Fraction(p[1][1])), "ends": ends, "variables": ranges},
    )


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

    P is searched for ``MODES`` values of σ, then verified on a cover of all of σ (``with_cover``).

    Args:
        h, k: sample time in s and velocity gain in 1/s, exact.
    """
    if not (machine.slowest > 0 and k * h < 1):
        return None
    low, high = Fraction(str(math.sqrt(machine.slowest))), Fraction(str(math.sqrt(machine.fastest)))
    ends = Fraction(math.floor(low * 1000), 1000), Fraction(math.ceil(high * 1000), 1000)
    if ends[0] <= 0:
        return None
    found = []
    beta, exact = h * k / 2, (sympy.Rational(ends[0]), sympy.Rational(ends[1]))
    values = [Fraction(s) for s in geometric(float(ends[0]), float(ends[1]), MODES)]
    for ratio in KAPPAS:
        kappa = rounded(ratio * machine.slowest / float(k), 3)
        step = mode_step(h, k, machine, kappa, beta)
        family = Family({SIGMA: exact}, {P: SIGMA, NU: SIGMA**2, Q: 1 / SIGMA}, step)
        sampled = Enclosure(family).vertices({SIGMA: (s, s)} for s in values)
        proposal = common_lyapunov(sampled, float(h), np.eye(3, dtype=bool))
        if proposal is not None:
            found.append((kappa, Found(family, proposal[0] / proposal[0][1, 1], proposal[1])))
    if not found:
        return None
    kappa, best = max(found, key=lambda each: each[1].rate)
    covered = with_cover(best, h)
    if covered is None:
        return None
    words = {"extremes": machine, "kappa": kappa, "beta": beta}
    return MovingMass(best.family, best.p, covered.rate, cover=covered.cover, **words)


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
    numbers = np.array(gain, dtype=float)
    return (k, numbers) if np.linalg.eigvalsh(numbers)[0] > 0 else None


def mode_step(h: Any, k: Any, machine: Extremes, kappa: Any, beta: Any) -> Matrix:
    """A of the step (r, φ, d) → (I + hA)(r, φ, d) of one mode, 3 by 3 over p = σ, nu = σ² and q = 1/σ; h, k exact.

    For a mode T = 1/σ², so r = (u + κf)/σ and φ = f + βu; these are solved for u and f.
    """
    r, phi, d, s = sympy.symbols("r phi d s")
    determinant = 1 - kappa * beta
    u, f = (s * r - kappa * phi) / determinant, (phi - beta * s * r) / determinant
    u_next = (1 - h * (k + machine.shift)) * u - h * s**2 * f + h * s * d
    f_next = f + h * k * u
    growth = 1 + machine.growth * h / 2
    after = sympy.Matrix([growth * (u_next + kappa * f_next) / s, f_next + beta * u_next, machine.slope * u / s])
    rates = [sympy.Poly(sympy.expand(e * s / h), s) for e in after.jacobian([r, phi, d]) - sympy.eye(3)]
    powers = (Q, sympy.Integer(1), P, NU, P * NU)  # σ⁻¹ to σ³, multi-affine
    return Matrix(3, 3, [sum(e.coeff_monomial(s**i) * power for i, power in enumerate(powers)) for e in rates])


@dataclass(frozen=True)
class Extremes:
    """The properties of the machine that a certificate by structure assumes, as estimated, with a margin of 10 %.

    Attributes:
        slowest, fastest: range of the eigenvalues ν of G M⁻¹, 1/s; G is the gain of the force estimate.
        growth: μ of M(x + hv) ≤ (1 + μh) M(x), 1/s, exact.
        shift, slope: ζ and η of |(M⁻¹∂g/∂v + ζI) e|_M ≤ η |e|_M, 1/s, exact.
        points: number of evaluations.
    """

    slowest: float
    fastest: float
    growth: Any
    shift: Any
    slope: Any
    points: int


def extremes(analysis: Analysis, k: float, gain: Array) -> Extremes | None:
    """The extremes over the envelope; None if M depends on a position whose velocity is no variable of A.

    The search starts from random points of the envelope. A third of them has every velocity at an end of its range,
    where the slope of the Coriolis forces is largest; a third has velocities scaled toward zero, where friction laws
    are most nonlinear. For each extreme a random search with decreasing step size and a fixed seed follows.

    Args:
        k, gain: K_v = k I, 1/s, and G, n by n, symmetric and positive definite.
    """
    machine = _Machine(analysis, k, gain)
    if machine.moves is None:
        return None
    random = np.random.default_rng(3)
    first = machine.sampled_points(random)
    slopes = machine.slopes(first)
    shift = float(min(SHIFTS * float(_norms(slopes).max()), key=lambda z: float(_norms(slopes, z).max())))

    def largest(measure: Callable[[Array], Array]) -> float:
        return machine.maximised(measure, first, random)

    slowest = -largest(lambda x: -machine.modes(x)[:, 0])
    fastest = largest(lambda x: machine.modes(x)[:, -1])
    growth = max(largest(machine.growths), 0.0)
    slope = largest(lambda x: _norms(machine.slopes(x), shift))
    return Extremes(
        slowest=slowest * (1 - MARGIN),
        fastest=fastest * (1 + MARGIN),
        growth=_up(growth * (1 + MARGIN)),
        shift=rounded(shift, DIGITS) if shift else sympy.Integer(0),
        slope=_up(slope * (1 + MARGIN)),
        points=POINTS + 4 * ROUNDS * KEPT * TRIALS,
    )


def _bell_shaped(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Random numbers of mean 0 and variance 1, each the sum of three uniform ones in [−1, 1].

    Normally distributed ones are computed with a logarithm, which processors round differently.
    """
    return np.asarray(random.uniform(-1, 1, (3, *shape)).sum(axis=0))


def _up(value: float) -> Any:
    """A decimal of ``DIGITS`` digits, as an exact number, that is not below the value."""
    return rounded(value * (1 + 10.0 ** (1 - DIGITS)), DIGITS) if value else sympy.Integer(0)


def _norms(slopes: Array, shift: float = 0.0) -> Array:
    """The smallest η at each point for a given ζ: |S + ζI|₂, S being ``_Machine.slopes`` there."""
    return np.asarray(np.linalg.norm(slopes + shift * np.eye(slopes.shape[1]), 2, axis=(1, 2)))


class _Machine:
    """M⁻¹ and the slopes of the forces at points of the envelope, points by n by n each.

    A point has a value for each variable of the error matrix (positions and velocities).

    Attributes:
        moves: columns (position, velocity) of each coordinate that varies; None if such a velocity is no variable.
        speeds: columns of the velocities.
        ends: (low, high) of each variable.
        root: √G.
    """

    def __init__(self, analysis: Analysis, k: float, gain: Array) -> None:
        self.analysis, self.k, self.n = analysis, k, len(gain)
        values, vectors = np.linalg.eigh(gain)
        self.root = vectors * np.sqrt(values) @ vectors.T
        variables, system = analysis.points.variables, analysis.dynamics.observer.system
        self.ends = np.array([[float(e) for e in analysis.points.ranges[s]] for s in variables]).reshape(-1, 2)
        column = {s: i for i, s in enumerate(variables)}
        pairs = [(x, v) for x, v in zip(system.positions, system.velocities, strict=True) if x in column]
        self.moves = [(column[x], column[v]) for x, v in pairs] if all(v in column for _, v in pairs) else None
        self.speeds = [column[v] for v in system.velocities if v in column]
        self.h, dynamics = float(analysis.dynamics.observer.sample_time), analysis.dynamics
        self.function = matrix_function(dynamics, dynamics.in_force(dynamics.sampled), variables)

    def sampled_points(self, random: np.random.Generator) -> Array:
        """The random points with which ``extremes`` starts, and those of the analysis; points by variables."""
        points = random.uniform(self.ends[:, 0], self.ends[:, 1], (POINTS, len(self.ends)))
        third, count = POINTS // 3, len(self.speeds)
        ends = random.integers(0, 2, (third, count))
        points[:third, self.speeds] = self.ends[self.speeds, :][np.arange(count), ends]
        points[third : 2 * third, self.speeds] *= powers_of_ten(-random.uniform(0, DECADES, (third, count)))
        return np.asarray(np.vstack([points, self.analysis.points.values]))

    def maximised(self, measure: Callable[[Array], Array], points: Array, random: np.random.Generator) -> float:
        """The largest value that a random search finds, started at the best ``KEPT`` of these points."""
        best = points[np.argsort(measure(points))[-KEPT:]]
        for size in geometric(0.2, 0.005, ROUNDS):
            width = size * (self.ends[:, 1] - self.ends[:, 0])
            trial = np.repeat(best, TRIALS, axis=0)
            step = size * _bell_shaped(random, trial.shape)
            scaled = trial * (1 + step + step**2 / 2)  # about e^step: a relative step, for points near standstill
            shifted = trial + width * _bell_shaped(random, trial.shape)
            trial = np.where(random.random((len(trial), 1)) < SCALED, scaled, shifted)
            trial = np.clip(trial, self.ends[:, 0], self.ends[:, 1])
            both = np.vstack([best, trial])
            best = both[np.argsort(measure(both))[-KEPT:]]
        return float(measure(best).max())

    def modes(self, points: Array) -> Array:
        """The eigenvalues ν of G M⁻¹, ascending, points by n."""
        return np.linalg.eigvalsh(self.root @ self._blocks(points)[1] @ self.root)

    def growths(self, points: Array) -> Array:
        """The smallest μ at each point: (λ_max(L⁻¹ M(x + hv) L⁻ᵀ) − 1)/h with M(x) = L L'."""
        after = points.copy()
        for x, v in self.moves or ():
            after[:, x] += self.h * points[:, v]
        mass, mass_after = (np.linalg.inv(self._blocks(at)[1]) for at in (points, after))
        inverse = np.linalg.inv(np.linalg.cholesky(mass))
        relative = inverse @ mass_after @ inverse.transpose(0, 2, 1)
        return np.asarray((np.linalg.eigvalsh(relative)[:, -1] - 1) / self.h)

    def slopes(self, points: Array) -> Array:
        """L' (M⁻¹∂g/∂v) L'⁻¹ with M = L L', points by n by n: its 2-norm is the norm of M⁻¹∂g/∂v induced by |e|_M."""
        slope, inverse = self._blocks(points)
        root = np.linalg.cholesky(np.linalg.inv(inverse)).transpose(0, 2, 1)
        return np.asarray(root @ slope @ np.linalg.inv(root))

    def _blocks(self, points: Array) -> tuple[Array, Array]:
        """(M⁻¹∂g/∂v, M⁻¹)."""
        a = at_points(self.function, np.column_stack([points, np.full(len(points), self.h)]))
        return a[:, : self.n, : self.n] + self.k * np.eye(self.n), -a[:, : self.n, self.n :]
