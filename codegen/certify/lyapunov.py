"""Common quadratic Lyapunov functions V = e'Pe of sampled error matrices, found in floating point.

With Φ = I + hA the condition of decay is, in δ form,

    A'P + PA + hA'PA ≤ −2αP    ⇔    Φ'PΦ ≤ (1 − 2αh)P,

which is well conditioned at short sample times too. With h = 0 it is the condition for the implicit step, and implies
V[k+1] ≤ V[k]/(1 + αh)² at any sample time. The linear matrix inequalities in P are solved by Clarabel. The result is a
proposal; the checker verifies it in exact numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import clarabel
import numpy as np
import scipy.sparse
from scipy.linalg import eigh, matrix_balance, solve_continuous_lyapunov, solve_discrete_lyapunov

from codegen.base.arrays import Array
from codegen.certify.centre import (
    Group,
    Matrices,
    Pattern,
    analytic_centre,
    certified_rates,
    first_found,
    half_vectorisation,
    largest_feasible_rate,
    least_rate,
    lyapunov_maps,
    method_of_centres,
)

Worst = list[list[int]]
"""For each group of matrices the indices of the active constraints."""
LARGEST_HULL = 4
"""Largest dimension of the affine hull of the matrices for which the vertices of the convex hull are computed."""
LARGEST_TURNED = 8
"""Largest number of errors for which P is optimised for less growth at reversals."""
RATE_KEPT = 0.95
"""Share of the best rate at which P is chosen for short dwell times: 5 % less rate reduces the growth at a reversal by
a quarter to a half. (Growth, dwell in samples) at the best rate and at this share: one_mass (4.44, 67), (3.19, 54);
rig (18.0, 10), (9.18, 8)."""
PROPORTIONS = 100
"""Number of steps for the proportion by which log(growth) is reduced: coarse, so that rounding seldom changes it."""
LARGEST, SLACK = 1e6, 1e-3
"""Constants of I ≤ P ≤ LARGEST I and of L(P) ≥ SLACK t I, the inequalities in which the solver maximises t ≤ 1."""
CLOSE, CLOSER, ENOUGH = 1e-5, 1e-8, 0.9
"""Relative residuals at which a dual and a primal point count as feasible, and the share of the largest slack at which
the solver stops."""
WELL = 1e8
"""Largest condition number of P, or of the matrix of eigenvectors."""
SAME = 0.05
"""Rounding step of the logarithms of the weights w: coarse, so that rounding errors seldom change the result."""
FEW, FIRST, ADDED, ROUNDS, TIGHT = 64, 12, 4, 25, 16
"""Constraint generation: with more than FEW matrices the inequalities are solved for FIRST of them; then the ADDED most
violated ones are included, at most ROUNDS times. The TIGHT most active ones are kept for a similar problem."""
NEAR = 2e-5
"""Relative tolerance of ``method_of_centres`` for one family: its rate is within 1 % of the proved limit."""
NEARER = (0.75, 0.5, 0.25)
"""Shares of the distance from the rate found to the limit at which the method of centres may start."""
MOST_FOR_CENTRES = 2**19
"""Largest (number of matrices) · m⁴ for the method of centres; for 1024 of order 6 it takes 3 s and gains 0.2 % of the
rate."""
MOST_FOR_NEWTON, TIGHTEST = 2048, 400
"""Largest number of matrices for the analytic centre, if some V may grow: with more, Newton's method does not converge
in its number of steps, and the centre is computed with the TIGHTEST most active ones of each group."""


def decay_rate_limit(matrices: Matrices, h: float) -> float:
    """Upper bound of the rate α of any common P, 1/s: (1 − ρ²)/(2h), ρ the largest spectral radius of all I + hA.

    For h = 0 it is minus the largest spectral abscissa of all A.
    """
    eigenvalues = np.linalg.eigvals(np.asarray(matrices))  # of all at once: a call for each takes ten times as long
    if h == 0:
        return -float(eigenvalues.real.max())
    radius = float(np.abs(1 + h * eigenvalues).max())
    return (1 - radius**2) / (2 * h)


def common_lyapunov(matrices: Matrices, h: float, structure: Pattern | None = None) -> tuple[Array, float] | None:
    """(P, α) with Φ'PΦ ≤ (1 − 2αh)P for every Φ = I + hA, α close to the largest possible; None if none is found.

    Args:
        matrices: the A, m by m each.
        h: sample time, s; 0 for the implicit step.
        structure: sparsity pattern of P, m by m; None if P is full.
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
    """(P, α) as of ``common_lyapunov``, for thousands of matrices; α is 0.1 % below the rate of P.

    Args:
        matrices: the A, m by m each.
        h: sample time, s; 0 for the implicit step.
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
    if len(matrices) * len(first[0]) ** 4 > MOST_FOR_CENTRES:
        return first[0], least_rate(first[0], matrices, h) * 0.999
    scale = balance(matrices)
    stack, start = _in(scale, matrices), first[0] * scale[None, :] * scale[:, None]
    p, shown = method_of_centres(start, first[1], stack, h, near=near)
    return p / scale[None, :] / scale[:, None], shown * 0.999


def common_lyapunov_at(groups: Sequence[Group], h: float, worst: Worst | None = None) -> Array | None:
    """A common P > 0 with A'P + PA + hA'PA ≤ −2αP for every A of each group, at its own α; None if none is found.

    Args:
        groups: (matrices m by m, α in 1/s) each; with α < 0, V may grow.
        h: sample time, s; 0 for the implicit step.
        worst: indices of the matrices of each group that were active in a similar problem; updated in place.
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
    """Analytic centre of the set of all P that meet the conditions of ``common_lyapunov_at``; ``p`` is one of them.

    It does not depend on the processor, as ``p`` does. With more than ``MOST_FOR_NEWTON`` matrices only the conditions
    that are most active at ``p`` define the centre, and the others are then verified. ``p`` itself is returned if this
    fails or Newton's method does not converge, and None if ``p`` is None.
    """
    if p is None:
        return None
    few, scale = groups, _scale(groups)
    if sum(len(matrices) for matrices, _ in groups) > MOST_FOR_NEWTON:
        few = [(_tightest(p, np.asarray(matrices), h, TIGHTEST), rate) for matrices, rate in groups]
    scaled = [(_in(scale, matrices), rate) for matrices, rate in few]
    middle = analytic_centre(scaled, h, p * scale[None, :] * scale[:, None])
    if middle is None:
        return p
    middle = middle / scale[None, :] / scale[:, None]
    holds = all(least_rate(middle, matrices, h) >= rate for matrices, rate in groups)
    return middle if holds else p


def _tightest(p: Array, stack: Array, h: float, count: int) -> Array:
    """The ``count`` matrices for which P certifies the smallest rates."""
    return np.asarray(stack[np.argsort(certified_rates(p, stack, h))[:count]])


def _feasible(
    groups: Sequence[Group],
    h: float,
    structure: Pattern | None = None,
    first: int | None = None,
    worst: Worst | None = None,
) -> Array | None:
    """``common_lyapunov_at`` for balanced matrices, by constraint generation.

    The inequalities are solved for some of the matrices; those that the resulting P violates are added, and so on.

    Args:
        structure: sparsity pattern of P, m by m; None if P is full.
        first: number of matrices of each group at the start; None for all.
        worst: as in ``common_lyapunov_at``.
    """
    stacks = [np.asarray(stack) for stack, _ in groups]
    largest = max(1.0, *(float(np.abs(stack).max()) for stack in stacks))
    worst = [[] for _ in stacks] if worst is None else worst
    worst += [[] for _ in stacks[len(worst) :]]
    used = []
    for stack, known in zip(stacks, worst, strict=True):
        count, last = min(first or len(stack), len(stack)), len(stack) - 1
        start = known if len(known) >= count else [*known, *map(int, np.linspace(0, last, count))]
        used.append(sorted({k for k in start if k <= last}))
    for _ in range(ROUNDS):
        conditions = [
            lyapunov_maps(stack[chosen], h, rate) / largest
            for stack, (_, rate), chosen in zip(stacks, groups, used, strict=True)
        ]
        p = solve_lmi(np.concatenate(conditions), structure)
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
    """P with I ≤ P ≤ 10⁶ I and L(P) ≥ 10⁻³ t I for each condition L, with the largest t ≤ 1; None unless t > 0.

    Args:
        conditions: the linear maps L as of ``lyapunov_maps``, N by m² by m², scaled to entries of about 1.
        structure: sparsity pattern of P, m by m; None if P is full.
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
    """Stopping criterion of the solver: t ≤ 0 by a dual feasible point, or a primal feasible one with t near 1."""
    none = info.cost_dual > info.cost_primal / 2 > 0 and info.res_dual < CLOSE
    return bool(none or (info.cost_primal < -ENOUGH and info.res_primal < CLOSER))


def balance(matrices: Matrices) -> Array:
    """Scales d of the error components, length m, such that A_ij d_j/d_i is balanced for the mean of |A|."""
    _, (scale, _) = matrix_balance(np.mean(np.abs(matrices), axis=0), permute=False, separate=True)
    return np.asarray(scale)


def _scale(groups: Sequence[Group]) -> Array:
    """The scales of ``balance`` for the matrices of all groups together."""
    return balance(np.concatenate([np.asarray(matrices) for matrices, _ in groups]))


def _in(scale: Array, matrices: Matrices) -> Array:
    """The matrices A_ij d_j/d_i for scales d, N by m by m."""
    return np.asarray(np.array(matrices) * scale[None, None, :] / scale[None, :, None])


def extreme_points(matrices: Matrices) -> list[Array]:
    """The matrices at the vertices of the convex hull of all; all matrices if the hull is expensive to compute.

    For given P > 0 the condition on A is convex, so it holds on the hull if it holds at the vertices.
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
    from scipy.spatial import ConvexHull  # imported here: few families need it

    return [matrices[k] for k in sorted(ConvexHull(along, qhull_options="QJ").vertices)]


def _single(a: Array, h: float, limit: float) -> tuple[Array, float] | None:
    """(P, α) of one matrix from a Lyapunov equation, α as near to the limit as the condition number of P permits."""
    for share in (0.998, 0.99, 0.95, 0.8, 0.5, 0.1):
        alpha = share * limit
        p = _of_one(a, h, alpha)
        if p is not None and np.linalg.cond(p) < WELL:
            return p / np.abs(p).max(), alpha * 0.999
    return None


def _of_one(a: Array, h: float, alpha: float) -> Array | None:
    """P > 0 of one matrix at the rate α from the discrete Lyapunov equation, or the continuous one for h = 0.

    None if the solution is not positive definite, or if the equation is singular in floating point, α being the limit.
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


def recovery_at_reversals(p: Array, matrix: Array, h: float, flips: Sequence[Sequence[int]]) -> Array:
    """Dwell times in samples, not rounded, after which V = e'Pe is back at its value before each reversal.

    log(g)/−log(1 − 2αh), where g is the least number with J'PJ ≤ gP and α the rate of P for this matrix; h > 0.

    Args:
        matrix: A.
        flips: for each reversal the indices of the errors that change their sign.

    Raises:
        numpy.linalg.LinAlgError: if P is not positive definite.
    """
    factor = 1 - 2 * least_rate(p, [matrix], h) * h
    if not 0 < factor < 1:
        return np.full(len(flips), math.inf)
    return np.log(_growths(p, flips)) / -math.log(factor)


def _signs(size: int, flips: Sequence[Sequence[int]]) -> list[Array]:
    """The diagonal of J for each reversal, with −1 at the errors that change their sign."""
    return [np.where(np.isin(np.arange(size), list(each)), -1.0, 1.0) for each in flips]


def _growths(p: Array, flips: Sequence[Sequence[int]]) -> Array:
    """The growth of V at each reversal: the largest generalised eigenvalue of (J'PJ, P)."""
    return np.array([eigh(s[:, None] * p * s, p, eigvals_only=True)[-1] for s in _signs(len(p), flips)])


def short_recovery(
    matrix: Array, h: float, flips: Sequence[Sequence[int]], fastest: Array
) -> tuple[Array, float] | None:
    """(P, its rate in 1/s) of one matrix with shorter dwell times at reversals, at ``RATE_KEPT`` of the best rate.

    log(growth) is reduced at all reversals by the same proportion, as far as the linear matrix inequalities in P are
    feasible. J'PJ ≤ gP has the form of the decay condition with Φ = J and 1 − 2αh = g. None if the longest dwell time
    is not shorter than that of ``fastest``, and for more than ``LARGEST_TURNED`` errors.

    Args:
        matrix: A.
        flips: as in ``least_growth_at_reversals``.
        fastest: a P with about the best rate.
    """
    limit = decay_rate_limit([matrix], h)
    if h == 0 or limit <= 0 or len(matrix) > LARGEST_TURNED or not flips:
        return None
    scale, rate = balance([matrix]), RATE_KEPT * limit
    (scaled,), start = _in(scale, [matrix]), fastest * scale[None, :] * scale[:, None]
    try:
        p = _in_proportion(scaled, h, rate, flips, _growths(start, flips))
        if p is None:
            return None
        before, after = (recovery_at_reversals(each, scaled, h, flips).max() for each in (start, p))
    except (np.linalg.LinAlgError, ValueError):
        return None
    if not after < before:
        return None
    p = p / scale[None, :] / scale[:, None]
    p = (p + p.T) / 2
    return p, least_rate(p, [matrix], h) * 0.9999


def _in_proportion(
    matrix: Array, h: float, rate: float, flips: Sequence[Sequence[int]], growths: Array
) -> Array | None:
    """The analytic centre of all P with this rate and with growths ≤ ``growths``^s, s ≤ 1 the least feasible; or None.

    s is a multiple of 1/``PROPORTIONS`` and found by bisection.
    """
    reversals = [np.diag(signs - 1) for signs in _signs(len(matrix), flips)]
    decay_maps = lyapunov_maps(matrix[None], h, rate) / max(1.0, float(np.abs(matrix).max()))

    def at(step: int) -> Array | None:
        bounds = growths ** (step / PROPORTIONS)
        growth_maps = [lyapunov_maps(turn[None], 1.0, (1 - g) / 2) for turn, g in zip(reversals, bounds, strict=True)]
        p = solve_lmi(np.concatenate([decay_maps, *growth_maps]))
        if p is None or np.linalg.eigvalsh(p)[0] <= 0 or least_rate(p, [matrix], h) < rate:
            return None
        return p if (_growths(p, flips) <= bounds).all() else None

    found = at(PROPORTIONS)
    if found is None:
        return None
    good, found = first_found(at, 0, PROPORTIONS, found)
    bounds = growths ** (good / PROPORTIONS)
    groups = [([matrix], rate), *(([turn / h], (1 - g) / 2 / h) for turn, g in zip(reversals, bounds, strict=True))]
    return analytic_centre(groups, h, found)


def least_growth_at_reversals(matrix: Array, h: float, flips: Sequence[Sequence[int]]) -> Array | None:
    """P of one matrix at its spectral rate with the least growth of V at reversals; None if none is found.

    P = Σ w_i Re(l̄_i l_i') has the spectral rate for all weights w_i > 0, l_i being the left eigenvectors of I + hA.
    The weights minimise the largest g over the reversals, J'PJ ≤ gP, by Nelder–Mead over log w. For more than
    ``LARGEST_TURNED`` errors all w_i are 1.

    Args:
        matrix: A.
        flips: for each reversal the indices of the errors that change their sign.
    """
    if h == 0 or not flips:
        return None
    values, right = np.linalg.eig(np.eye(len(matrix)) + h * matrix)
    if np.linalg.cond(right) > WELL:
        return None
    left = np.linalg.inv(right)
    parts = [np.real(np.outer(row.conj(), row)) for row, z in zip(left, values, strict=True) if z.imag >= 0]

    def lyapunov_matrix(logs: Array) -> Array:
        return np.asarray(sum(np.exp(w) * part for w, part in zip((0.0, *logs), parts, strict=True)))

    def growth(logs: Array) -> float:
        try:
            return float(np.log(_growths(lyapunov_matrix(logs), flips)).max())
        except (np.linalg.LinAlgError, ValueError):
            return math.inf

    logs = np.zeros(len(parts) - 1)
    if len(parts) > 1 and len(matrix) <= LARGEST_TURNED:
        from scipy.optimize import minimize  # imported here: it takes a fifth of a second

        logs = np.round(minimize(growth, logs, method="Nelder-Mead").x / SAME) * SAME
    if not math.isfinite(growth(logs)):
        return None
    p = lyapunov_matrix(logs)
    return (p + p.T) / 2
