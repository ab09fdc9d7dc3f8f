"""Refutation of a decay rate: a proof, at one exact operating point, that no P certifies the rate α or a larger one.

Let Φ be the step matrix at the point and c the factor of V per sample for α, such as c = 1 − 2αh. If a symmetric Q
satisfies cQ − Φ'QΦ > 0, then Q > 0 if and only if Φ/√c is stable (Stein's inertia theorem). So a Q with x'Qx ≤ 0 for
some x ≠ 0 proves that Φ'PΦ ≤ cP holds for no P > 0. As α → 0 it proves that the error does not decay.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import matrix_balance

from codegen.analysis.analysis import Analysis
from codegen.base.arrays import Array
from codegen.certify.certificate_text import rational_text, rounded, rounded_matrix, texts
from codegen.certify.content import lines, one_line
from codegen.certify.family import PI, Family
from codegen.certify.lyapunov import decay_rate_limit, solution
from codegen.checker import verify
from codegen.mechanics.casadi_form import function_of

SLACK = (1e-3, 2e-3, 5e-3, 1e-2)
"""Relative distances from the rate at the point to the refuted rate, tried in turn."""
LEAST = 1e-6
"""Least refuted rate, 1/s; it is the one for an unstable point."""
DIGITS = (6, 9, 12, 15)
"""Numbers of significant digits of Q that are tried in turn."""
POINTS_COMPARED = 12
"""Number of sampled operating points that are compared, those of the largest spectral radius."""
EVALUATIONS = 400
"""Largest number of evaluations in the search near the slowest point."""


@dataclass(frozen=True, eq=False)
class Slowest:
    """The operating point of slowest decay that was found.

    Attributes:
        rate: the largest α of any P there, 1/s.
        point: name of each variable of the family → value, rational.
        matrix: A there, m by m.
    """

    rate: float
    point: Mapping[str, Any]
    matrix: Array


def slowest_point(analysis: Analysis, family: Family) -> Slowest | None:
    """The operating point of slowest decay; None if no point has rational values of all variables.

    The slowest sampled one or, if that is stable, one that a local search finds from there.
    """
    dynamics, h = analysis.dynamics, float(analysis.dynamics.observer.sample_time)
    function = function_of(family.matrix.subs(family.parameters), [*family.variables])

    def decay_at(known: Mapping[str, float]) -> Slowest | None:
        """The decay at an operating point; None if it has no rational values."""
        point = _point(analysis, family, known)
        if point is None:
            return None
        a = np.asarray(function([float(point[v.name]) for v in family.variables] or [0.0]))
        if dynamics.implicit:  # α with spectral radius of (I − hA)⁻¹ = 1/(1 + αh)
            return Slowest((float(np.abs(1 - h * np.linalg.eigvals(a)).min()) - 1) / h, point, a)
        return Slowest(decay_rate_limit([a], h), point, a)

    def rate(known: Mapping[str, float]) -> float:
        found = decay_at(known)
        return np.inf if found is None else found.rate

    tried = [(found, known) for known in _operating_points(analysis) if (found := decay_at(known)) is not None]
    if not tried:
        return None
    found, known = min(tried, key=lambda item: item[0].rate)
    return found if found.rate <= 0 else decay_at(_slower_near(analysis, known, rate))


def _slower_near(
    analysis: Analysis, known: dict[str, float], rate: Callable[[Mapping[str, float]], float]
) -> dict[str, float]:
    """An operating point of slower decay near ``known``, by Nelder–Mead; ``known`` itself if none is found.

    Velocities keep their signs. The values have six digits.
    """
    dynamics, ranges = analysis.dynamics, analysis.points.ranges
    tied = {n.name: s.name for n, s in dynamics.next_velocity.items()}
    free, bounds = [], []
    for s in analysis.points.variables:
        low, high = (float(x) for x in ranges[s])
        if s in dynamics.observer.signs or s.name in tied or low == high:
            continue
        if s not in dynamics.observer.system.positions and low * high < 0:
            if known[s.name] == 0:  # held at zero: a change would need another sign of the slip
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
    from scipy.optimize import minimize  # imported here: it takes a fifth of a second

    found = minimize(lambda x: rate(at(x)), start, method="Nelder-Mead", bounds=bounds, options=options)
    return at(found.x) if found.fun < rate(at(start)) else known


def refute(analysis: Analysis, slowest: Slowest, frame: Mapping[str, Any]) -> dict[str, Any] | None:
    """The refutation of all rates from 0.1 % to 1 % above that of the slowest point, which the checker has accepted.

    None if the checker refuses all attempts, because of rounding. ``frame``: as of ``content.frame``.
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
    """Refutations of the rate α, with Q rounded to more and more digits; none if Q is positive definite."""
    rate = rounded(alpha, 5)
    _, (scale, _) = matrix_balance(slowest.matrix, permute=False, separate=True)
    h, implicit = float(analysis.dynamics.observer.sample_time), analysis.dynamics.implicit
    q = solution(slowest.matrix * scale[None, :] / scale[:, None], h, float(rate), implicit)
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


def _operating_points(analysis: Analysis) -> Iterator[dict[str, float]]:
    """Sampled operating points: variable → value. The worst come first, each also with its positions at zero."""
    names = [s.name for s in analysis.points.variables]
    angles = {x.name for x in analysis.dynamics.observer.system.positions}
    neighbours = {n.name: s.name for n, s in analysis.dynamics.next_velocity.items()}
    for row in analysis.points.values[[0, *np.argsort(-analysis.radii)[:POINTS_COMPARED]]]:
        for at_zero in (False, True):
            known = {n: 0.0 if at_zero and n in angles else float(x) for n, x in zip(names, row, strict=True)}
            # The next velocity v[k+1] is taken equal to v[k].
            yield known | {n: known[s] for n, s in neighbours.items() if n in known and s in known}


def _point(analysis: Analysis, family: Family, known: Mapping[str, float]) -> dict[str, Any] | None:
    """Name of each variable of the family → rational value at an operating point, within its range; or None."""
    system = analysis.dynamics.observer.system
    result: dict[str, Any] = {}
    slips = dict(zip([c.slip for c in system.contacts], system.slip_velocity, strict=True))
    for v, (low, high) in sorted(family.variables.items(), key=lambda item: item[0] in family.bounded):
        if v == PI:
            return None
        if v.name in known:
            value = rounded(known[v.name], 6)
        elif v in slips and {s.name for s in slips[v].free_symbols} <= set(known):
            value = slips[v].subs({s: rounded(known[s.name], 6) for s in slips[v].free_symbols})
        elif v in family.bounded:
            atom = family.bounded[v]
            value = atom.subs({s: result[s.name] for s in atom.free_symbols if s.name in result})
        else:
            return None
        if not value.is_Rational:
            return None
        result[v.name] = min(max(value, low), high)
    return result
