"""A rate that no certificate can show, proved: at one exact operating point the sampled error does not fall so fast.

Let Φ be the step there and c the fall of V at the rate α. If a symmetric Q has cQ − Φ'QΦ > 0, then Q > 0 if and only if
Φ/√c is stable (Stein's inertia theorem). A Q that is not positive along some vector therefore proves that V = e'Pe
falls by no factor c for any P > 0; at α → 0 it proves that the error does not decay.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import sympy
from scipy.linalg import matrix_balance, solve_discrete_lyapunov
from scipy.optimize import minimize

from codegen.analysis.analysis import Analysis
from codegen.analysis.polynomials import characteristic_polynomial
from codegen.base.arrays import Array
from codegen.certify.content import lines, one_line
from codegen.certify.family import PI, Family
from codegen.certify.lyapunov import decay_rate_limit
from codegen.certify.prefix import rational_text, rounded, rounded_matrix, texts
from codegen.checker import verify
from codegen.mechanics.casadi_form import function_of
from codegen.mechanics.computed import ComputedEntry

SLACK = (1e-3, 2e-3, 5e-3, 1e-2)
LEAST = 1e-6
DIGITS = (6, 9, 12, 15)
TRIED = 12
EVALUATIONS = 400


@dataclass(frozen=True, eq=False)
class Slowest:
    """The slowest operating point that was found.

    Attributes:
        rate: of V for the best P there, 1/s.
        point: the family's variables, as rationals.
        matrix: A.
    """

    rate: float
    point: Mapping[str, Any]
    matrix: Array


def slowest_point(analysis: Analysis, family: Family) -> Slowest | None:
    """Among the sampled ones, and near the slowest of these if it is stable; None where no point has exact numbers."""
    dynamics, h = analysis.dynamics, float(analysis.dynamics.observer.sample_time)
    function = function_of(family.matrix.subs(family.parameters), [*family.variables])

    def there(known: Mapping[str, float]) -> Slowest | None:
        point = _point(analysis, family, known)
        if point is None:
            return None
        a = np.asarray(function([float(point[v.name]) for v in family.variables] or [0.0]))
        return Slowest(_implicit_rate(a, h) if dynamics.implicit else decay_rate_limit([a], h), point, a)

    def rate(known: Mapping[str, float]) -> float:
        found = there(known)
        return np.inf if found is None else found.rate

    tried = [(found, known) for known in _operating_points(analysis) if (found := there(known)) is not None]
    if not tried:
        return None
    found, known = min(tried, key=lambda item: item[0].rate)
    return found if found.rate <= 0 else there(_slower_near(analysis, known, rate))


def _slower_near(
    analysis: Analysis, known: dict[str, float], rate: Callable[[Mapping[str, float]], float]
) -> dict[str, float]:
    """A slower point of the same signs of velocities, where a simplex finds one; to six digits."""
    dynamics, ranges = analysis.dynamics, analysis.points.ranges
    tied = {n.name: s.name for n, s in dynamics.next_velocity.items()}
    free, bounds = [], []
    for s in analysis.points.variables:
        low, high = (float(x) for x in ranges[s])
        if s in dynamics.observer.signs or s.name in tied or low == high:
            continue
        if s not in dynamics.observer.system.positions and low * high < 0:
            if known[s.name] == 0:  # it stays: on either side the signs of the point would be wrong for some velocities
                continue
            low, high = (0.0, high) if known[s.name] > 0 else (low, 0.0)
        free.append(s.name)
        bounds.append((low, high))
    if not free:
        return known

    def at(x: Array) -> dict[str, float]:
        new = known | {name: float(f"{value:.6g}") for name, value in zip(free, x, strict=True)}
        return new | {n: new[s] for n, s in tied.items() if n in new and s in new}

    start = np.array([known[name] for name in free])
    options = {"maxfev": EVALUATIONS}
    found = minimize(lambda x: rate(at(x)), start, method="Nelder-Mead", bounds=bounds, options=options)
    return at(found.x) if found.fun < rate(at(start)) else known


def refute(analysis: Analysis, slowest: Slowest, frame: Mapping[str, Any]) -> dict[str, Any] | None:
    """The refutation of every rate that is 0.1 % (or what is needed) above the slowest point's own, in the same format.

    None where rounding spoils the proof. What is returned has passed the checker.

    Args:
        frame: the certificate's fields that do not depend on the proof.
    """
    h = analysis.dynamics.period
    for alpha in (max(LEAST, slowest.rate * (1 + slack)) for slack in SLACK):
        if 2 * alpha * h >= 1:
            return None
        for content in _proposals(frame, slowest, alpha, analysis):
            with suppress(verify.Refused):
                verify.check(json.dumps(content))
                return content
    return None


def _proposals(
    frame: Mapping[str, Any], slowest: Slowest, alpha: float, analysis: Analysis
) -> Iterator[dict[str, Any]]:
    rate = rounded(alpha, 5)
    _, (scale, _) = matrix_balance(slowest.matrix, permute=False, separate=True)
    h, implicit = float(analysis.dynamics.observer.sample_time), analysis.dynamics.implicit
    q = _inertia(slowest.matrix * scale[None, :] / scale[:, None], float(rate), h, implicit)
    if q is None:
        return
    values, vectors = np.linalg.eigh(q)
    if values[0] > 0:
        return
    along = [rounded(float(x) * s, 6) for x, s in zip(vectors[:, 0] / np.abs(vectors[:, 0]).max(), scale, strict=True)]
    size = np.sqrt(np.abs(values).max()) / scale
    at = {name: float(value) for name, value in slowest.point.items()}
    words = {"rate": float(rate), "point": at, "observer": analysis.dynamics.observer, "least": LEAST}
    for digits in DIGITS:
        yield {
            **frame,
            "claim": one_line("text/refuted_claim.j2", **words),
            "variables": {name: [rational_text(value)] * 2 for name, value in slowest.point.items()},
            "lyapunov_matrix": texts(rounded_matrix(q / scale[None, :] / scale[:, None], digits, size)),
            "decay_rate": rational_text(rate),
            "along": [rational_text(x) for x in along],
            "assumptions": lines("text/refuted_assumptions.j2", **words),
        }


def _implicit_rate(a: Array, h: float) -> float:
    """The α at which (I − hA)⁻¹ falls by 1/(1 + αh) a sample."""
    radius = float(np.abs(1 / (1 - h * np.linalg.eigvals(a))).max())
    return (1 / radius - 1) / h


def _inertia(a: Array, alpha: float, h: float, implicit: bool) -> Array | None:
    """Q with cQ − Φ'QΦ a positive multiple of I, in the coordinates of ``a``."""
    unit = np.eye(len(a))
    try:
        step = np.linalg.inv(unit - h * a) * (1 + alpha * h) if implicit else unit + h * a
        step = step if implicit else step / np.sqrt(1 - 2 * alpha * h)
        q = solve_discrete_lyapunov(step.T, unit * h)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return (q + q.T) / 2 if np.isfinite(q).all() else None


def _operating_points(analysis: Analysis) -> Iterator[dict[str, float]]:
    """Sampled ones, slowest first, each also with its positions at zero."""
    names = [s.name for s in analysis.points.variables]
    angles = {x.name for x in analysis.dynamics.observer.system.positions}
    neighbours = {n.name: s.name for n, s in analysis.dynamics.next_velocity.items()}
    for row in analysis.points.values[[0, *np.argsort(-analysis.radii)[:TRIED]]]:
        for turned in (False, True):
            known = {n: 0.0 if turned and n in angles else float(x) for n, x in zip(names, row, strict=True)}
            # nothing jumps in a sample
            yield known | {n: known[s] for n, s in neighbours.items() if n in known and s in known}


def rational_matrix(analysis: Analysis, family: Family) -> Any:
    """A at the slowest operating point at which it is rational, exact; None where there is none."""
    for known in _operating_points(analysis):
        point = _point(analysis, family, known)
        if point is not None:
            exact = family.at({v: point[v.name] for v in family.variables})
            if all(e.is_Rational for e in exact):
                return exact
    return None


def _point(analysis: Analysis, family: Family, known: Mapping[str, float]) -> dict[str, Any] | None:
    """The family's variables at an operating point, as rationals."""
    system = analysis.dynamics.observer.system
    result: dict[str, Any] = {}
    slips = dict(zip([c.slip for c in system.contacts], system.slip_velocity, strict=True))
    for v, (low, high) in sorted(family.variables.items(), key=lambda item: item[0] in family.bounded):
        if v == PI:
            return None
        if v.name in known:
            value = sympy.Rational(Fraction(f"{known[v.name]:.6g}"))
        elif v in slips and {s.name for s in slips[v].free_symbols} <= set(known):
            value = slips[v].subs({s: sympy.Rational(f"{known[s.name]:.6g}") for s in slips[v].free_symbols})
        elif v in family.bounded:
            atom = family.bounded[v]
            value = atom.subs({s: result[s.name] for s in atom.free_symbols if s.name in result})
        else:
            return None
        if not value.is_Rational:
            return None
        result[v.name] = min(max(value, low), high)
    return result


def unstable_point(analysis: Analysis) -> dict[str, str] | None:
    """The worst sampled point as rationals, if I + hA is proved unstable there; else None.

    Where A is rational at the point the proof is exact: the polynomial of I + hA fails the Jury table in rationals. A
    point where A holds sines or roots is not given as proved.
    """
    dynamics = analysis.dynamics
    observer = dynamics.observer
    point = {name: sympy.Rational(str(round(value, 6))) for name, value in analysis.worst.items()}
    values = {**observer.values, sympy.Symbol("h", real=True): observer.sample_time}
    values |= {s: point[s.name] for s in analysis.points.variables}
    matrix = dynamics.in_force(dynamics.sampled).xreplace(dynamics.slopes).xreplace(values)
    if dynamics.inverse_mass:
        mass = observer.system.mass_matrix.subs(values)
        if mass.has(ComputedEntry):
            return None
        inverse = mass.inv()
        matrix = matrix.subs({w: inverse[i, j] for w, (i, j) in dynamics.inverse_mass.items()})
    if not all(e.is_Rational for e in matrix):
        return None
    unit, change = sympy.eye(matrix.rows), observer.sample_time * matrix
    if dynamics.implicit and (unit - change).det() == 0:
        return None
    step = (unit - change).inv() if dynamics.implicit else unit + change
    coefficients = [Fraction(int(c.p), int(c.q)) for c in characteristic_polynomial(step)]
    return {name: str(value) for name, value in point.items()} if not schur_stable(coefficients) else None


def schur_stable(coefficients: list[Fraction]) -> bool:
    """Whether all roots lie inside the unit circle: the Schur–Cohn (Jury) recursion in exact numbers.

    Args:
        coefficients: highest power first.
    """
    row = list(coefficients)
    while len(row) > 1:
        if abs(row[-1]) >= abs(row[0]):
            return False
        factor = row[-1] / row[0]
        row = [a - factor * b for a, b in zip(row[:-1], row[:0:-1], strict=True)]
    return True
