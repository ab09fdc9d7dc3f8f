"""A quadratic Lyapunov matrix common to several sampled error matrices, found in floating point.

In δ form, with Φ = I + hA:  A'P + PA + hA'PA ≤ −2αP  is the same as  Φ'PΦ ≤ (1 − 2αh)P, and stays well conditioned
at short sample times. With h = 0 it is the condition of the implicit step, for which it implies V[k+1] ≤ V[k]/(1 + αh)²
at any h. What is found here is only proposed; the exact check decides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, matrix_balance, solve_continuous_lyapunov, solve_discrete_lyapunov
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from codegen.certify.centre import climbed, slower_until
from codegen.certify.lmi import fall, feasible

Array = NDArray[np.float64]
LARGEST_HULL = 4
WELL = 1e8
SAME = 0.05
"""Steps of log w: coarse, so that no last bit decides."""


def decay_rate_limit(matrices: Sequence[Array], h: float) -> float:
    """The largest α that any common P could have: from the spectral radius of each I + hA alone; h = 0: abscissa."""
    eigenvalues = np.linalg.eigvals(np.asarray(matrices))  # of all at once: a call for each takes ten times as long
    if h == 0:
        return -float(eigenvalues.real.max())
    radius = float(np.abs(1 + h * eigenvalues).max())
    return (1 - radius**2) / (2 * h)


def common_lyapunov(
    matrices: Sequence[Array], h: float, structure: NDArray[np.bool_] | None = None
) -> tuple[Array, float] | None:
    """(P, α) with Φ'PΦ ≤ (1 − 2αh)P for every matrix and α close to the largest possible, or None if none is found.

    Args:
        matrices: the A, m by m each.
        h: sample time, s; 0 for the implicit step.
        structure: where P may hold other entries than zero, m by m; None: everywhere.
    """
    limit = decay_rate_limit(matrices, h)
    if limit <= 0:
        return None
    scale = balance(matrices)
    few, scaled = ([a * scale[None, :] / scale[:, None] for a in each] for each in (extreme(matrices), matrices))
    found = (
        _single(few[0], h, limit) if len(few) == 1 and structure is None else _several(few, scaled, h, limit, structure)
    )
    if found is None:
        return None
    p, alpha = found
    p = p / scale[None, :] / scale[:, None]
    return (p + p.T) / 2, alpha


def balance(matrices: Sequence[Array]) -> Array:
    """Scales of the error's components, in which the entries of the A are alike: A_ij scale_j / scale_i."""
    _, (scale, _) = matrix_balance(np.mean(np.abs(matrices), axis=0), permute=False, separate=True)
    return np.asarray(scale)


def extreme(matrices: Sequence[Array]) -> list[Array]:
    """The matrices that are no mixture of others, where that is quick to see: what holds at these holds at all.

    The condition on A is convex for a given P.
    """
    flat = np.array([a.ravel() for a in matrices])
    middle = flat.mean(axis=0)
    _, sizes, axes = np.linalg.svd(flat - middle, full_matrices=False)
    rank = int((sizes > 1e-12 * max(1.0, float(np.abs(flat).max()))).sum())
    if rank == 0:
        return [matrices[0]]
    along = (flat - middle) @ axes[:rank].T
    if rank == 1:
        return [matrices[int(along.argmin())], matrices[int(along.argmax())]]
    if rank > LARGEST_HULL or len(matrices) <= rank + 1:
        return list(matrices)
    return [matrices[k] for k in sorted(ConvexHull(along, qhull_options="QJ").vertices)]


def _single(a: Array, h: float, limit: float) -> tuple[Array, float] | None:
    """For one matrix: the discrete Lyapunov equation of Φ/ρ with ρ a little above the spectral radius."""
    m = len(a)
    step = np.eye(m) + h * a
    for share in (0.998, 0.99, 0.95, 0.8, 0.5, 0.1):
        alpha = share * limit
        if h == 0:
            p = solve_continuous_lyapunov(a.T + alpha * np.eye(m), -np.eye(m))
        else:
            rho = np.sqrt(1 - 2 * alpha * h)
            p = solve_discrete_lyapunov(step.T / rho, np.eye(m) * h)
        p = (p + p.T) / 2
        if np.linalg.eigvalsh(p)[0] > 0 and np.linalg.cond(p) < 1e8:
            return p / np.abs(p).max(), alpha * 0.999
    return None


def _several(
    few: Sequence[Array], matrices: Sequence[Array], h: float, limit: float, structure: NDArray[np.bool_] | None
) -> tuple[Array, float] | None:
    """For a family: the linear matrix inequality at falling α, and from the first that is met on by centres.

    Args:
        few: of the matrices, those that are no mixture of others; which these are may hang on the last bit.
    """
    first = slower_until(lambda alpha: _feasible(few, h, alpha, structure), limit)
    if first is None:
        return None
    p, shown = climbed(*first, np.array(matrices), h, lambda p: rate_of(p, matrices, h), structure)
    return p, shown * 0.9999


def rate_of(p: Array, matrices: Sequence[Array], h: float) -> float:
    """The largest α that P > 0 shows of every matrix: the least eigenvalue of −(A'P + PA + hA'PA) against 2P."""
    falls = (eigh(-(a.T @ p + p @ a + h * a.T @ p @ a), 2 * p, eigvals_only=True)[0] for a in matrices)
    return float(min(falls))


def _feasible(matrices: Sequence[Array], h: float, alpha: float, structure: NDArray[np.bool_] | None) -> Array | None:
    rate = max(1.0, float(np.abs(matrices).max()))
    found = feasible([{0: fall(a, h, alpha) / rate} for a in matrices], 1, len(matrices[0]), structure)
    if found is None:
        return None
    value = found[0]
    worst = min(
        float(np.linalg.eigvalsh(-(a.T @ value + value @ a + h * a.T @ value @ a + 2 * alpha * value))[0])
        for a in matrices
    )
    return value if worst > 0 and np.linalg.eigvalsh(value)[0] > 0 else None


def gentle(matrix: Array, h: float, turned: Sequence[Sequence[int]], largest: int = 8) -> Array | None:
    """P of one matrix at its best rate that a change of sign of some errors makes grow least; None if none is seen.

    Every P = Σ w_i Re(l̄_i l_i'), l_i the left eigenvectors of I + hA, w_i > 0, falls at the best rate; of these the one
    with the least largest growth of J'PJ over P, J −1 at each of ``turned``, by Nelder and Mead's search of log w.

    Args:
        turned: for each turn the indices of the errors that change their sign.
        largest: no search with more errors.
    """
    if h == 0 or len(matrix) > largest or not turned:
        return None
    values, right = np.linalg.eig(np.eye(len(matrix)) + h * matrix)
    if np.linalg.cond(right) > WELL:
        return None
    left = np.linalg.inv(right)
    parts = [np.real(np.outer(row.conj(), row)) for row, z in zip(left, values, strict=True) if z.imag >= 0]
    signs = [np.where(np.isin(np.arange(len(matrix)), list(each)), -1.0, 1.0) for each in turned]

    def together(logs: Array) -> Array:
        return np.asarray(sum(np.exp(w) * part for w, part in zip((0.0, *logs), parts, strict=True)))

    def growth(logs: Array) -> float:
        try:
            p = together(logs)
            return max(float(np.log(eigh(s[:, None] * p * s, p, eigvals_only=True)[-1])) for s in signs)
        except (np.linalg.LinAlgError, ValueError):
            return math.inf

    found = minimize(growth, np.zeros(len(parts) - 1), method="Nelder-Mead") if len(parts) > 1 else None
    logs = np.zeros(0) if found is None else np.round(found.x / SAME) * SAME
    if not math.isfinite(growth(logs)):
        return None
    p = together(logs)
    return (p + p.T) / 2
