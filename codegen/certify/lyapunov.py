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
"""Number of errors above which no weights and no inequalities of P are searched for less growth at reversals."""
RATE_KEPT = 0.95
"""Share of the best rate at which P is chosen where a slip turns: the last 5 % of the rate cost a quarter to a half of
the growth at a reversal. Growth and dwell at the best rate and here: one_mass 4.44, 67 samples and 3.19, 54; rig 18.0,
10 and 9.18, 8."""
PROPORTIONS = 100
"""Steps of the proportion by which P shortens the dwell times: coarse, as those of a rate."""
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


def recovery_at_reversals(p: Array, matrix: Array, h: float, turned: Sequence[Sequence[int]]) -> Array:
    """The time in samples, not rounded, after which V = e'Pe is below its value before each of the reversals.

    log(growth) / −log(1 − 2αh), growth the largest of J'PJ over P and α the rate of P for this matrix; h > 0.

    Raises:
        numpy.linalg.LinAlgError: if P is not positive definite.
    """
    fall = 1 - 2 * least_rate(p, [matrix], h) * h
    if not 0 < fall < 1:
        return np.full(len(turned), math.inf)
    return np.log(_growths(p, turned)) / -math.log(fall)


def _signs(size: int, turned: Sequence[Sequence[int]]) -> list[Array]:
    """The diagonals of J, −1 at each of ``turned``."""
    return [np.where(np.isin(np.arange(size), list(each)), -1.0, 1.0) for each in turned]


def _growths(p: Array, turned: Sequence[Sequence[int]]) -> Array:
    """The largest growth of V at each reversal, of J'PJ over P."""
    return np.array([eigh(s[:, None] * p * s, p, eigvals_only=True)[-1] for s in _signs(len(p), turned)])


def short_recovery(
    matrix: Array, h: float, turned: Sequence[Sequence[int]], fastest: Array
) -> tuple[Array, float] | None:
    """(P, its rate) of one matrix at ``RATE_KEPT`` of its best rate, for shorter dwell times at reversals.

    log(growth) is reduced at all reversals by the same proportion, as far as inequalities in P allow:
    J'PJ ≤ gP is the condition of a decay with Φ = J and 1 − 2αh = g. None where the longest dwell time is not shorter
    than of ``fastest``, and for more than ``LARGEST_TURNED`` errors.

    Args:
        turned: as of ``least_growth_at_reversals``.
        fastest: a P with about the best rate.
    """
    limit = decay_rate_limit([matrix], h)
    if h == 0 or limit <= 0 or len(matrix) > LARGEST_TURNED or not turned:
        return None
    scale, rate = balance([matrix]), RATE_KEPT * limit
    (scaled,), start = _in(scale, [matrix]), fastest * scale[None, :] * scale[:, None]
    try:
        p = _in_proportion(scaled, h, rate, turned, _growths(start, turned))
        if p is None:
            return None
        before, after = (recovery_at_reversals(each, scaled, h, turned).max() for each in (start, p))
    except (np.linalg.LinAlgError, ValueError):
        return None
    if not after < before:
        return None
    p = p / scale[None, :] / scale[:, None]
    p = (p + p.T) / 2
    return p, least_rate(p, [matrix], h) * 0.9999


def _in_proportion(
    matrix: Array, h: float, rate: float, turned: Sequence[Sequence[int]], growths: Array
) -> Array | None:
    """The analytic centre of all P with this rate and growths of at most ``growths`` to the least power, below 1."""
    turns = [np.diag(signs - 1) for signs in _signs(len(matrix), turned)]
    falls = lyapunov_maps(matrix[None], h, rate) / max(1.0, float(np.abs(matrix).max()))

    def at(step: int) -> Array | None:
        asked = growths ** (step / PROPORTIONS)
        rises = [lyapunov_maps(turn[None], 1.0, (1 - g) / 2) for turn, g in zip(turns, asked, strict=True)]
        p = solve_lmi(np.concatenate([falls, *rises]))
        if p is None or np.linalg.eigvalsh(p)[0] <= 0 or least_rate(p, [matrix], h) < rate:
            return None
        return p if (_growths(p, turned) <= asked).all() else None

    bad, good, found = 0, PROPORTIONS, at(PROPORTIONS)
    if found is None:
        return None
    while good - bad > 1:
        middle = (good + bad) // 2
        other = at(middle)
        if other is None:
            bad = middle
        else:
            good, found = middle, other
    asked = growths ** (good / PROPORTIONS)
    groups = [([matrix], rate), *(([turn / h], (1 - g) / 2 / h) for turn, g in zip(turns, asked, strict=True))]
    return analytic_centre(groups, h, found)


def least_growth_at_reversals(matrix: Array, h: float, turned: Sequence[Sequence[int]]) -> Array | None:
    """P of one matrix at its spectral rate, with the least growth of V at a reversal; None if none is found.

    Every P = Σ w_i Re(l̄_i l_i'), l_i the left eigenvectors of I + hA and w_i > 0, has the spectral rate. Of these the
    weights that minimise the largest growth of J'PJ over P, J = −1 at each of ``turned``, by Nelder–Mead over log w;
    for more than ``LARGEST_TURNED`` errors all w_i = 1.

    Args:
        turned: for each reversal the indices of the errors that change their sign.
    """
    if h == 0 or not turned:
        return None
    values, right = np.linalg.eig(np.eye(len(matrix)) + h * matrix)
    if np.linalg.cond(right) > WELL:
        return None
    left = np.linalg.inv(right)
    parts = [np.real(np.outer(row.conj(), row)) for row, z in zip(left, values, strict=True) if z.imag >= 0]

    def together(logs: Array) -> Array:
        return np.asarray(sum(np.exp(w) * part for w, part in zip((0.0, *logs), parts, strict=True)))

    def growth(logs: Array) -> float:
        try:
            return float(np.log(_growths(together(logs), turned)).max())
        except (np.linalg.LinAlgError, ValueError):
            return math.inf

    logs = np.zeros(len(parts) - 1)
    if len(parts) > 1 and len(matrix) <= LARGEST_TURNED:
        logs = np.round(minimize(growth, logs, method="Nelder-Mead").x / SAME) * SAME
    if not math.isfinite(growth(logs)):
        return None
    p = together(logs)
    return (p + p.T) / 2
