"""Common quadratic Lyapunov functions V = e'Pe of sampled error matrices, found in floating point.

In δ form, with Φ = I + hA:  A'P + PA + hA'PA ≤ −2αP  is the same as  Φ'PΦ ≤ (1 − 2αh)P, and stays well conditioned
at short sample times. With h = 0 it is the condition of the implicit step, for which it implies V[k+1] ≤ V[k]/(1 + αh)²
at any h. Linear matrix inequalities in P are solved by Clarabel. What is found is proposed; the exact check decides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import clarabel
import numpy as np
import scipy.sparse
from scipy.linalg import eigh, matrix_balance, solve_continuous_lyapunov, solve_discrete_lyapunov
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from codegen.base.arrays import Array
from codegen.certify.centre import (
    Group,
    Matrices,
    Pattern,
    analytic_centre,
    certified_rates,
    half_vectorisation,
    largest_feasible_rate,
    least_rate,
    lyapunov_maps,
    method_of_centres,
)

Worst = list[list[int]]
"""Of each group of matrices the indices of the active constraints."""
LARGEST_HULL = 4
LARGEST_TURNED = 8
"""Number of errors above which no P of least growth at reversals is searched for."""
LARGEST, SLACK = 1e6, 1e-3
"""I ≤ P ≤ 10⁶ I, and how far from its edge an inequality is asked for."""
CLOSE, CLOSER, ENOUGH = 1e-5, 1e-8, 0.9
"""Relative residuals at which a dual and a primal point are taken as feasible, and the share of the largest slack that
is enough."""
WELL = 1e8
SAME = 0.05
"""Steps of log w: coarse, so that no last bit decides."""
FEW, FIRST, ADDED, ROUNDS, TIGHT = 64, 12, 4, 25, 16
"""With more than FEW matrices the inequality is solved for FIRST of them, then with the worst ADDED that P violates; a
similar problem starts with the TIGHT ones of the last P."""
NEAR = 2e-5
"""Relative tolerance of ``method_of_centres`` for one family: its rate is within 1 % of the proved limit."""
NEARER = (0.75, 0.5, 0.25)
CLIMBED = 2**19
"""Matrices times m⁴ up to which the method of centres is used: for 1024 of order 6 it takes 3 s for 0.2 % of a rate."""
SETTLED, TIGHTEST = 2048, 400
"""With more matrices, and a growth among the conditions, Newton's method does not converge in its number of steps; the
TIGHTEST of each group then stand for all."""


def decay_rate_limit(matrices: Matrices, h: float) -> float:
    """The largest α that any common P could have: from the spectral radius of each I + hA alone; h = 0: abscissa."""
    eigenvalues = np.linalg.eigvals(np.asarray(matrices))  # of all at once: a call for each takes ten times as long
    if h == 0:
        return -float(eigenvalues.real.max())
    radius = float(np.abs(1 + h * eigenvalues).max())
    return (1 - radius**2) / (2 * h)


def common_lyapunov(matrices: Matrices, h: float, structure: Pattern | None = None) -> tuple[Array, float] | None:
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
    few, stack = _in(scale, extreme_points(matrices)), _in(scale, matrices)
    if len(few) == 1 and structure is None:
        found = _single(few[0], h, limit)
    else:
        first = largest_feasible_rate(lambda alpha: _feasible([(few, alpha)], h, structure), limit)
        if first is None:
            return None
        p, shown = method_of_centres(*first, stack, h, structure)
        found = p, shown * 0.9999
    if found is None:
        return None
    p = found[0] / scale[None, :] / scale[:, None]
    return (p + p.T) / 2, found[1]


def common_lyapunov_of_many(matrices: Matrices, h: float, near: float = NEAR) -> tuple[Array, float] | None:
    """As ``common_lyapunov``, for families of very many matrices; α is 0.1 % below the rate of P.

    Args:
        near: as in ``method_of_centres``.
    """
    limit = decay_rate_limit(matrices, h)
    if limit <= 0:
        return None
    worst: Worst = []
    first = largest_feasible_rate(lambda alpha: common_lyapunov_at([(matrices, alpha)], h, worst), limit)
    if first is None:
        return None
    for share in NEARER:  # the method of centres is slow with many matrices: start near the largest feasible rate
        alpha = first[1] + share * (limit - first[1])
        if (p := common_lyapunov_at([(matrices, alpha)], h, worst)) is not None:
            first = p, alpha
            break
    if len(matrices) * len(first[0]) ** 4 > CLIMBED:
        return first[0], least_rate(first[0], matrices, h) * 0.999
    scale = balance(matrices)
    stack, start = _in(scale, matrices), first[0] * scale[None, :] * scale[:, None]
    p, shown = method_of_centres(start, first[1], stack, h, near=near)
    return p / scale[None, :] / scale[:, None], shown * 0.999


def common_lyapunov_at(groups: Sequence[Group], h: float, worst: Worst | None = None) -> Array | None:
    """A common P > 0 with A'P + PA + hA'PA ≤ −2αP for every A of each group, at its own α; None if none is found.

    Args:
        groups: (matrices m by m, α in 1/s) each; where α is below zero V may grow.
        worst: indices of the matrices of each group that were active in a similar problem; it is updated.
    """
    scale = _scale(groups)
    scaled = [
        (_in(scale, extreme_points(list(matrices)) if len(matrices) <= FEW else matrices), rate)
        for matrices, rate in groups
    ]
    alone = len(groups) == len(scaled[0][0]) == 1
    p = _of_one(scaled[0][0][0], h, scaled[0][1]) if alone else _feasible(scaled, h, first=FIRST, worst=worst)
    if p is None:
        return None
    p = p / scale[None, :] / scale[:, None]
    return np.asarray((p + p.T) / 2)


def analytic_centre_at(groups: Sequence[Group], h: float, p: Array | None) -> Array | None:
    """The analytic centre of all P as of ``common_lyapunov_at``, of which ``p`` is one: the same on every machine.

    With more than ``SETTLED`` matrices it is that of the conditions which ``p`` meets most tightly, if all others hold
    there too. Where the centre is not reached, or ``p`` is None, it is ``p``.
    """
    if p is None:
        return None
    few, scale = groups, _scale(groups)
    if sum(len(matrices) for matrices, _ in groups) > SETTLED:
        few = [(_tightest(p, np.asarray(matrices), h, TIGHTEST), rate) for matrices, rate in groups]
    scaled = [(_in(scale, matrices), rate) for matrices, rate in few]
    middle = analytic_centre(scaled, h, p * scale[None, :] * scale[:, None])
    if middle is None:
        return p
    middle = middle / scale[None, :] / scale[:, None]
    holds = all(least_rate(middle, matrices, h) >= rate for matrices, rate in groups)
    return middle if holds else p


def _tightest(p: Array, stack: Array, h: float, count: int) -> Array:
    """The matrices for which P shows the smallest rates."""
    return np.asarray(stack[np.argsort(certified_rates(p, stack, h))[:count]])


def _feasible(
    groups: Sequence[Group],
    h: float,
    structure: Pattern | None = None,
    first: int | None = None,
    worst: Worst | None = None,
) -> Array | None:
    """``common_lyapunov_at`` for balanced matrices, by constraint generation.

    A large family is solved for some of its matrices; those whose inequality the P found violates are then added.

    Args:
        first: how many of each group are taken at first; None: all.
        worst: as of ``common_lyapunov_at``.
    """
    stacks = [np.asarray(stack) for stack, _ in groups]
    largest = max(1.0, *(float(np.abs(stack).max()) for stack in stacks))
    worst = [[] for _ in stacks] if worst is None else worst
    worst += [[] for _ in stacks[len(worst) :]]
    used = []
    for stack, known in zip(stacks, worst, strict=True):
        count, last = min(first or len(stack), len(stack)), len(stack) - 1
        begun = known if len(known) >= count else [*known, *map(int, np.linspace(0, last, count))]
        used.append(sorted({k for k in begun if k <= last}))
    for _ in range(ROUNDS):
        asked = [
            lyapunov_maps(stack[chosen], h, rate) / largest
            for stack, (_, rate), chosen in zip(stacks, groups, used, strict=True)
        ]
        p = solve_lmi(np.concatenate(asked), structure)
        if p is None or np.linalg.eigvalsh(p)[0] <= 0:
            return None
        missing = False
        for stack, (_, rate), chosen, known in zip(stacks, groups, used, worst, strict=True):
            shown = certified_rates(p, stack, h)
            slow = [int(k) for k in np.argsort(shown)[:ADDED] if shown[k] < rate]
            missing |= bool(slow)
            if set(slow) & set(chosen):
                return None  # the solver violates a constraint that it was given
            chosen += slow
            known += slow
        if not missing:
            for stack, chosen, known in zip(stacks, used, worst, strict=True):
                known[:] = (chosen[k] for k in np.argsort(certified_rates(p, stack[chosen], h))[:TIGHT])
            return p
    return None


def solve_lmi(conditions: Array, structure: Pattern | None = None) -> Array | None:
    """P with I ≤ P ≤ 10⁶ I and L(P) > 0 for each condition, of largest slack; None if none is found.

    Args:
        conditions: the L as of ``lyapunov_maps``, scaled to entries of about 1.
        structure: where P may hold other entries than zero; None: everywhere.
    """
    size = math.isqrt(conditions.shape[1])
    pick, spread = half_vectorisation(size)
    unit, count = pick @ np.eye(size).ravel(), len(conditions)
    n = len(unit)
    blocks = np.zeros((count + 2, n, n + 1))
    blocks[:count, :, :n] = -pick @ conditions @ spread
    blocks[:count, :, n] = SLACK * unit
    blocks[count:, :, :n] = -pick @ spread, pick @ spread
    rows = [blocks.reshape(-1, n + 1), np.eye(n + 1)[-1:]]  # the slack is at most 1
    right = [np.zeros(count * n), -unit, LARGEST * unit, np.ones(1)]
    cones = [*[clarabel.PSDTriangleConeT(size)] * (count + 2), clarabel.NonnegativeConeT(1)]
    zeros = [] if structure is None else [*np.flatnonzero(~structure[np.tril_indices(size)])]
    if zeros:
        rows.append(np.eye(n + 1)[zeros])
        right.append(np.zeros(len(zeros)))
        cones.append(clarabel.ZeroConeT(len(zeros)))
    settings = clarabel.DefaultSettings()
    settings.verbose = settings.iterative_refinement_enable = False
    empty, matrix = scipy.sparse.csc_matrix((n + 1, n + 1)), scipy.sparse.csc_matrix(np.vstack(rows))
    target = -np.eye(n + 1)[-1]
    solver = clarabel.DefaultSolver(empty, target, matrix, np.concatenate(right), cones, settings)
    solver.set_termination_callback(_decided)
    found = solver.solve()
    x = np.array(found.x)
    if not np.isfinite(x).all() or x[-1] <= 0:
        return None
    p = (spread @ x[:n]).reshape(size, size)
    return p if structure is None else np.where(structure, p, 0.0)


def _decided(info: Any) -> bool:
    """Whether the dual bounds the slack below zero, or the slack is near its largest: no more iterations are needed."""
    none = info.cost_dual > info.cost_primal / 2 > 0 and info.res_dual < CLOSE
    return bool(none or (info.cost_primal < -ENOUGH and info.res_primal < CLOSER))


def balance(matrices: Matrices) -> Array:
    """Scales of the error's components that balance the matrices: A_ij scale_j / scale_i."""
    _, (scale, _) = matrix_balance(np.mean(np.abs(matrices), axis=0), permute=False, separate=True)
    return np.asarray(scale)


def _scale(groups: Sequence[Group]) -> Array:
    return balance(np.concatenate([np.asarray(matrices) for matrices, _ in groups]))


def _in(scale: Array, matrices: Matrices) -> Array:
    """Matrices A in these scales, N by m by m."""
    return np.asarray(np.array(matrices) * scale[None, None, :] / scale[None, :, None])


def extreme_points(matrices: Matrices) -> list[Array]:
    """The vertices of the convex hull of the matrices, or all where the hull is expensive.

    The condition on A is convex for a given P, so it holds for all matrices if it holds at the vertices.
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
    """For one matrix: P at a rate a little below the limit."""
    for share in (0.998, 0.99, 0.95, 0.8, 0.5, 0.1):
        alpha = share * limit
        p = _of_one(a, h, alpha)
        if p is not None and np.linalg.cond(p) < WELL:
            return p / np.abs(p).max(), alpha * 0.999
    return None


def _of_one(a: Array, h: float, alpha: float) -> Array | None:
    """For one matrix: the Lyapunov equation at a rate below its limit, discrete or of the implicit step.

    None where it has no positive definite solution, or where rounding makes it singular: then the rate is the limit.
    """
    unit = np.eye(len(a))
    try:
        if h == 0:
            p = solve_continuous_lyapunov(a.T + alpha * unit, -unit)
        else:
            p = solve_discrete_lyapunov((unit + h * a).T / np.sqrt(1 - 2 * alpha * h), unit * h)
    except np.linalg.LinAlgError:
        return None
    p = (p + p.T) / 2
    return p if np.linalg.eigvalsh(p)[0] > 0 else None


def least_growth_at_reversals(matrix: Array, h: float, turned: Sequence[Sequence[int]]) -> Array | None:
    """P of one matrix at its spectral rate, with the least growth of V at a reversal; None if none is found.

    Every P = Σ w_i Re(l̄_i l_i'), l_i the left eigenvectors of I + hA and w_i > 0, has the spectral rate. Of these the
    weights that minimise the largest growth of J'PJ over P, J = −1 at each of ``turned``, by Nelder–Mead over log w.

    Args:
        turned: for each reversal the indices of the errors that change their sign.
    """
    if h == 0 or len(matrix) > LARGEST_TURNED or not turned:
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
