"""Common quadratic Lyapunov functions V = e'Pe of sampled error matrices, found in floating point.

With Φ = I + hA the condition of decay is, in δ form,

    A'P + PA + hA'PA ≤ −2αP    ⇔    Φ'PΦ ≤ (1 − 2αh)P,

which is well conditioned at short sample times too. With h = 0 it is the condition for the implicit step, and implies
V[k+1] ≤ V[k]/(1 + αh)² at any sample time. The linear matrix inequalities in P are solved by Clarabel. The result is a
proposal; the checker verifies it in exact numbers.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse
from scipy.linalg import eigh, matrix_balance, solve_continuous_lyapunov, solve_discrete_lyapunov

from codegen.base.arrays import Array
from codegen.certify.centre import (
    NEAR,
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

SHARE = 0.001
"""Share of the rate that may be lost where the explicit condition is met in place of the implicit one."""
LARGEST_TURNED = 8
"""Largest number of errors for which P is optimised for less growth at reversals."""
RATE_KEPT = 0.95
"""Share of the best rate at which P is chosen for short dwell times. With 5 % less rate the growth at a reversal is
smaller by a quarter to a half, in the shipped specs."""
PROPORTIONS = 100
"""The factor by which log(growth) is reduced is a multiple of 1/PROPORTIONS: coarse, so that rounding seldom changes
it."""
LARGEST_P, SLACK = 1e6, 1e-3
"""Constants of I ≤ P ≤ LARGEST_P I and of L(P) ≥ SLACK t I, the inequalities in which the solver maximises t ≤ 1."""
DUAL_RESIDUAL, PRIMAL_RESIDUAL, SUFFICIENT_SLACK = 1e-5, 1e-8, 0.9
"""Relative residuals at which a dual and a primal point count as feasible, and the share of the largest slack at which
the solver stops."""
LARGEST_CONDITION = 1e8
"""Largest condition number of P, or of the matrix of eigenvectors."""
LOG_WEIGHT_STEP = 0.05
"""Rounding step of the logarithms of the weights w: coarse, so that rounding errors seldom change the result."""
AT_FIRST, ADDED_EACH_TIME, MOST_ROUNDS = 12, 4, 25
"""Constraint generation: the inequalities are solved for AT_FIRST matrices of each group; then the ADDED_EACH_TIME most
violated ones are included, at most MOST_ROUNDS times."""
MOST_KEPT = 24
"""Number of matrices of each group, the most active ones, with which the next search over a similar box starts."""
Active = dict[tuple[int, ...], list[list[int]]]
"""Numbers of matrices of the groups → indices of the matrices for which the inequalities are solved first."""
MOST_ACTIVE = 200
"""Number of matrices, the most active ones, by which a centre is computed where there are more. It is then tested with
all. With fewer the method of centres is faster and comes closer to the best rate, but the others may fail."""
MOST_FOR_NEWTON = 2048
"""Largest number of matrices for the analytic centre: with more, Newton's method may not converge in its number of
steps."""


def decay_rate_limit(matrices: Matrices, h: float) -> float:
    """Upper bound of the rate α of any common P, 1/s: (1 − ρ²)/(2h), ρ the largest spectral radius of all I + hA.

    For h = 0 it is minus the largest spectral abscissa of all A.
    """
    eigenvalues = np.linalg.eigvals(np.asarray(matrices))  # of all at once: a call for each takes ten times as long
    if h == 0:
        return -float(eigenvalues.real.max())
    radius = float(np.abs(1 + h * eigenvalues).max())
    return (1 - radius**2) / (2 * h)


def common_lyapunov(
    matrices: Matrices, h: float, structure: Pattern | None = None, near: float = NEAR
) -> tuple[Array, float] | None:
    """(P, α in 1/s) with Φ'PΦ ≤ (1 − 2αh)P for every Φ = I + hA and nearly the largest α; None if none is found.

    Args:
        matrices: the A, m by m each.
        h: sample time, s; 0 for the implicit step.
        structure: sparsity pattern of P, m by m; None if P is full.
        near: relative tolerance of ``method_of_centres``.
    """
    limit = decay_rate_limit(matrices, h)
    if limit <= 0:
        return None
    scale = balance(matrices)
    stack = _scaled(scale, matrices)
    if len(stack) == 1 and structure is None:
        found = _near_limit(stack[0], h, limit)
    else:
        active: Active = {}
        first = largest_feasible_rate(lambda alpha: _feasible([(stack, alpha)], h, structure, active), limit)
        if first is None:
            return None
        start, alpha = first
        if len(stack) > MOST_ACTIVE:  # those that are most active should not depend on the searches before
            anew = _feasible([(stack, alpha)], h, structure)
            start = start if anew is None else anew
        p = method_of_centres(start, alpha, _most_active(start, stack, h), h, structure, near)
        if least_rate(p, stack, h) < alpha:
            p = start
        found = p, 0.9999 * least_rate(p, stack, h)
    if found is None:
        return None
    return _unscaled(scale, found[0]), found[1]


def common_lyapunov_at(groups: Sequence[Group], h: float, active: Active | None = None) -> Array | None:
    """A common P > 0 with A'P + PA + hA'PA ≤ −2αP for every A of each group, with the group's α; None if none is found.

    Args:
        groups: α in 1/s; α < 0 permits V to grow.
        h: sample time, s; 0 for the implicit step.
        active: where the search starts, updated for the next one. Searches over similar boxes have similar active
            matrices, and find whether there is a P in fewer rounds; which P they find depends on it.
    """
    scale = _scale(groups)
    scaled = [(_scaled(scale, matrices), rate) for matrices, rate in groups]
    matrices, rate = scaled[0]
    if len(groups) == len(matrices) == 1:
        p = _positive_solution(matrices[0], h, rate)
    else:
        p = _feasible(scaled, h, active=active)
    return None if p is None else _unscaled(scale, p)


def analytic_centre_at(groups: Sequence[Group], h: float, p: Array | None) -> Array | None:
    """Analytic centre of the set of all P that meet the conditions of ``common_lyapunov_at``.

    Unlike the P of the solver, it does not depend on the processor. With more than ``MOST_FOR_NEWTON`` matrices only
    the conditions that are most active at ``p`` define the centre, and the others are then tested.

    Args:
        p: one of these P. It is returned if a condition fails at the centre or Newton's method does not converge.
    """
    if p is None:
        return None
    few, scale = groups, _scale(groups)
    if sum(len(matrices) for matrices, _ in groups) > MOST_FOR_NEWTON:
        few = [(_most_active(p, np.asarray(matrices), h), rate) for matrices, rate in groups]
    scaled = [(_scaled(scale, matrices), rate) for matrices, rate in few]
    middle = analytic_centre(scaled, h, p * scale[None, :] * scale[:, None])
    if middle is None:
        return p
    middle = _unscaled(scale, middle)
    holds = all(least_rate(middle, matrices, h) >= rate for matrices, rate in groups)
    return middle if holds else p


def _most_active(p: Array, stack: Array, h: float) -> Array:
    """The ``MOST_ACTIVE`` matrices for which P certifies the smallest rates; all if there are no more."""
    return stack if len(stack) <= MOST_ACTIVE else stack[np.argsort(certified_rates(p, stack, h))[:MOST_ACTIVE]]


def _feasible(
    groups: Sequence[Group], h: float, structure: Pattern | None = None, active: Active | None = None
) -> Array | None:
    """``common_lyapunov_at`` for balanced matrices, by constraint generation.

    The inequalities are solved for some of the matrices; those that the resulting P violates are added, until it
    violates none.
    """
    stacks = [np.asarray(stack) for stack, _ in groups]
    sizes = [max(1.0, float(np.abs(stack).max())) for stack in stacks]
    numbers, active = tuple(map(len, stacks)), {} if active is None else active
    spread = [[*map(int, np.linspace(0, n - 1, min(AT_FIRST, n)))] for n in numbers]
    used = [[*each] for each in active.get(numbers, spread)]
    for _ in range(MOST_ROUNDS):
        conditions = [
            lyapunov_maps(stack[chosen], h, rate) / size
            for stack, size, (_, rate), chosen in zip(stacks, sizes, groups, used, strict=True)
        ]
        p = solve_lmi(np.concatenate(conditions), structure)
        if p is None or np.linalg.eigvalsh(p)[0] <= 0:
            return None
        complete, least = True, list[list[int]]()
        for stack, (_, rate), chosen in zip(stacks, groups, used, strict=True):
            rates = certified_rates(p, stack, h)
            violated = [int(k) for k in np.argsort(rates)[:ADDED_EACH_TIME] if rates[k] < rate]
            if set(violated) & set(chosen):
                return None  # the solver violates a constraint that it was given
            chosen += violated
            complete &= not violated
            least.append(sorted(chosen, key=rates.__getitem__)[:MOST_KEPT])
        if complete:
            active[numbers] = least
            return p
    return None


def solve_lmi(conditions: Array, structure: Pattern | None = None) -> Array | None:
    """The P, t that maximise t ≤ 1 subject to I ≤ P ≤ 10⁶ I and L(P) ≥ 10⁻³ t I for each L; None unless t > 0.

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
    right = [np.zeros(count * n), -unit, LARGEST_P * unit, np.ones(1)]
    import clarabel  # imported here, since a plan of cancellation loads this module and solves nothing

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
    none = info.cost_dual > info.cost_primal / 2 > 0 and info.res_dual < DUAL_RESIDUAL
    return bool(none or (info.cost_primal < -SUFFICIENT_SLACK and info.res_primal < PRIMAL_RESIDUAL))


def balance(matrices: Matrices) -> Array:
    """Scales d of the error components, length m, such that A_ij d_j/d_i is balanced for the mean of |A|."""
    _, (scale, _) = matrix_balance(np.mean(np.abs(matrices), axis=0), permute=False, separate=True)
    return np.asarray(scale)


def _scale(groups: Sequence[Group]) -> Array:
    """The scales of ``balance`` for the matrices of all groups together."""
    return balance(np.concatenate([np.asarray(matrices) for matrices, _ in groups]))


def _scaled(scale: Array, matrices: Matrices) -> Array:
    """The matrices A_ij d_j/d_i for scales d, N by m by m: the same error dynamics for the errors e_i/d_i."""
    return np.asarray(np.array(matrices) * scale[None, None, :] / scale[None, :, None])


def _unscaled(scale: Array, p: Array) -> Array:
    """P for the errors e, from a P for the errors e_i/d_i; the scales d are powers of two."""
    p = p / scale[None, :] / scale[:, None]
    return np.asarray((p + p.T) / 2)


def _near_limit(a: Array, h: float, limit: float) -> tuple[Array, float] | None:
    """(P, α) of one matrix, α the largest of some shares of ``limit`` at which P is well conditioned; or None."""
    for share in (0.998, 0.99, 0.95, 0.8, 0.5, 0.1):
        alpha = share * limit
        p = _positive_solution(a, h, alpha)
        if p is not None and np.linalg.cond(p) < LARGEST_CONDITION:
            return p / np.abs(p).max(), alpha * 0.999
    return None


def solution(a: Array, h: float, alpha: float, implicit: bool = False) -> Array | None:
    """Symmetric P with Φ'PΦ − cP = −hc I for Φ = I + hA and c = 1 − 2αh; for h = 0 with A'P + PA + 2αP = −I.

    None if the equation is singular in floating point, with α its limit.

    Args:
        implicit: whether Φ = (I − hA)⁻¹ and c = 1/(1 + αh)².
    """
    unit = np.eye(len(a))
    try:
        if h == 0:
            p = solve_continuous_lyapunov(a.T + alpha * unit, -unit)
        elif implicit:
            p = solve_discrete_lyapunov((np.linalg.inv(unit - h * a) * (1 + alpha * h)).T, unit * h)
        else:
            p = solve_discrete_lyapunov((unit + h * a).T / np.sqrt(1 - 2 * alpha * h), unit * h)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return (p + p.T) / 2 if np.isfinite(p).all() else None


def _positive_solution(a: Array, h: float, alpha: float) -> Array | None:
    """The P of ``solution`` if it is positive definite, else None."""
    p = solution(a, h, alpha)
    return p if p is not None and np.linalg.eigvalsh(p)[0] > 0 else None


def short_step(matrix: Array) -> float:
    """A sample time at which the condition of the explicit step can serve for the implicit one, s; A must be stable.

    The explicit condition A'P + PA + hA'PA ≤ −2αP implies the implicit one, since hA'PA ≥ 0. Per eigenvalue λ of A its
    rate is lower by h|λ|²/2; at this h that is at most ``SHARE`` of −Re λ of the slowest.
    """
    eigenvalues = np.linalg.eigvals(matrix)
    return float(2 * SHARE * -eigenvalues.real.max() / (np.abs(eigenvalues) ** 2).max())


def recovery_at_reversals(p: Array, matrix: Array, h: float, flips: Sequence[Sequence[int]]) -> Array:
    """For each reversal the dwell time in samples, not rounded, after which V = e'Pe is back at its value before.

    It is log(g)/−log(1 − 2αh), where g is the growth, the least number with J'PJ ≤ gP, and α the rate of P. J is
    diagonal, with −1 for the errors that change their sign at the reversal and 1 for the others. Raises
    numpy.linalg.LinAlgError if P is not positive definite.

    Args:
        h: sample time, s; above 0.
        flips: for each reversal the indices of the errors that change their sign.
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

    The growths g_i of ``fastest``, a P with about the best rate, are reduced to g_i^s with one exponent s ≤ 1 for all
    reversals, the least for which the linear matrix inequalities in P are feasible. None if the longest dwell time is
    then not shorter than that of ``fastest``, and for more than ``LARGEST_TURNED`` errors.

    Args:
        h: sample time, s; above 0 (``short_step`` for the implicit step).
        flips: as in ``recovery_at_reversals``.
    """
    limit = decay_rate_limit([matrix], h)
    if limit <= 0 or len(matrix) > LARGEST_TURNED or not flips:
        return None
    scale, rate = balance([matrix]), RATE_KEPT * limit
    (scaled,), start = _scaled(scale, [matrix]), fastest * scale[None, :] * scale[:, None]
    # J'PJ ≤ gP is the decay condition Φ'PΦ ≤ (1 − 2αh)P with Φ = I + hA for A = (J − I)/h and α = (1 − g)/(2h).
    jumps = [np.diag(signs - 1) / h for signs in _signs(len(matrix), flips)]

    def groups_at(step: int) -> list[Group]:
        """The conditions on P with s = step/PROPORTIONS."""
        bounds = growths ** (step / PROPORTIONS)
        return [([scaled], rate), *(([jump], (1 - g) / (2 * h)) for jump, g in zip(jumps, bounds, strict=True))]

    try:
        growths = _growths(start, flips)
        found = _feasible(groups_at(PROPORTIONS), h)
        if found is None:
            return None
        least, found = first_found(lambda step: _feasible(groups_at(step), h), 0, PROPORTIONS, found)
        p = analytic_centre(groups_at(least), h, found)
        times = [recovery_at_reversals(each, scaled, h, flips).max() for each in (start, p) if each is not None]
    except (np.linalg.LinAlgError, ValueError):
        return None
    if p is None or not times[1] < times[0]:
        return None
    p = _unscaled(scale, p)

    return p, least_rate(p, [matrix], h) * 0.9999


def least_growth_at_reversals(matrix: Array, h: float, flips: Sequence[Sequence[int]]) -> Array | None:
    """P of one matrix at its spectral rate, with small growth of V at reversals; None if none is found.

    P = Σ w_i Re(l̄_i l_i') has the spectral rate for all weights w_i > 0, l_i being the left eigenvectors of I + hA.
    The weights minimise the largest g over the reversals, J'PJ ≤ gP, by Nelder–Mead over log w. For more than
    ``LARGEST_TURNED`` errors all w_i are 1. The arguments are those of ``short_recovery``.
    """
    if not flips:
        return None
    values, right = np.linalg.eig(np.eye(len(matrix)) + h * matrix)
    if np.linalg.cond(right) > LARGEST_CONDITION:
        return None
    left = np.linalg.inv(right)
    parts = [np.real(np.outer(row.conj(), row)) for row, z in zip(left, values, strict=True) if z.imag >= 0]

    def lyapunov_matrix(logs: Array) -> Array:
        """P for the logarithms of w_2, w_3, …, with w_1 = 1."""
        return np.asarray(sum(np.exp(w) * part for w, part in zip((0.0, *logs), parts, strict=True)))

    def growth(logs: Array) -> float:
        """The logarithm of the largest growth over the reversals; infinite if P is not positive definite."""
        try:
            return float(np.log(_growths(lyapunov_matrix(logs), flips)).max())
        except (np.linalg.LinAlgError, ValueError):
            return math.inf

    logs = np.zeros(len(parts) - 1)
    if len(parts) > 1 and len(matrix) <= LARGEST_TURNED:
        from scipy.optimize import minimize  # imported here: it takes a fifth of a second

        logs = np.round(minimize(growth, logs, method="Nelder-Mead").x / LOG_WEIGHT_STEP) * LOG_WEIGHT_STEP
    if not math.isfinite(growth(logs)):
        return None
    p = lyapunov_matrix(logs)
    return (p + p.T) / 2
