"""The analytic centre of the feasible matrices P, found by Newton's method: the same P on every machine.

A solver stops somewhere in the feasible set. At its boundary the last bit of a product decides where: two processors
gave P that differ by a fifth. The analytic centre is the minimum of a strictly convex function, so it is unique, and
depends continuously on the data. From it the rate is raised to the one that the centre itself certifies, step by step
(the method of centres, Boyd and El Ghaoui 1993).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array

Matrices = Sequence[Array] | Array
Group = tuple[Matrices, float]
Pattern = NDArray[np.bool_]
RATIO = 0.99
LEAST = 1024
"""RATIO to this power is the least share of a limit that is tried."""
CLIMBS = 200
NEAR = 2e-3
"""The method of centres ends where the centre's own rate exceeds the required one by no more than this share."""
STEPS = 80
SURE = 0.1
"""Squared Newton decrement below which a full step stays feasible and decreases the function."""
SETTLED, MORE = 1e-6, 4
"""Squared Newton decrement of quadratic convergence, and the number of steps taken from there on."""


def half_vectorisation(size: int) -> tuple[Array, Array]:
    """(W, D): svec X = W vec X with off-diagonal entries times √2, and vec X = D vech X, of a symmetric matrix X."""
    rows, columns = np.tril_indices(size)
    pick, spread = np.zeros((len(rows), size * size)), np.zeros((size * size, len(rows)))
    for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
        pick[k, i * size + j] = 1.0 if i == j else np.sqrt(2.0)
        spread[[i * size + j, j * size + i], k] = 1.0
    return pick, spread


def lyapunov_maps(stack: Array, h: float, alpha: float) -> Array:
    """−(A'P + PA + hA'PA + 2αP) as linear maps of vec P, N by m² by m²; the P of a solver depends on their last bits.

    Args:
        stack: the A, N by m by m.
    """
    turned, size = stack.transpose(0, 2, 1), stack.shape[1]
    unit = np.eye(size)
    first, second = turned[:, :, None, :, None], turned[:, None, :, None, :]
    now = first * unit[:, None, :] + unit[:, None, :, None] * second + h * (first * second)
    return np.asarray(-(now.reshape(-1, size * size, size * size) + 2 * alpha * np.eye(size * size)))


def certified_rates(p: Array, stack: Array, h: float) -> Array:
    """The largest α for which P > 0 is a Lyapunov matrix, of each matrix of a stack, N by m by m."""
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    turned = stack.transpose(0, 2, 1)
    falls = -(turned @ p + p @ stack + h * turned @ p @ stack)
    return np.asarray(np.linalg.eigvalsh(inverse @ falls @ inverse.T)[:, 0] / 2)


def least_rate(p: Array, matrices: Matrices, h: float) -> float:
    """The largest α for which P > 0 is a Lyapunov matrix of all these matrices."""
    return float(certified_rates(p, np.asarray(matrices), h).min())


def largest_feasible_rate(holds: Callable[[float], Array | None], limit: float) -> tuple[Array, float] | None:
    """(P, α) at the largest of ``limit`` · 0.99, · 0.99², … at which a P is found; None if none is.

    The rates differ by 1 %, so the result seldom depends on a solver's tolerance of a thousandth.
    """
    limit = float(f"{limit:.7g}")
    bad, good, found = 0, 1, None
    while found is None:
        found = holds(limit * RATIO**good)
        if found is None:
            if good >= LEAST:
                return None
            bad, good = good, 2 * good
    while good - bad > 1:
        middle = (good + bad) // 2
        other = holds(limit * RATIO**middle)
        if other is None:
            bad = middle
        else:
            good, found = middle, other
    return found, limit * RATIO**good


def method_of_centres(
    start: Array,
    alpha: float,
    stack: Array,
    h: float,
    where: Pattern | None = None,
    near: float = NEAR,
) -> tuple[Array, float]:
    """(P, its rate): the analytic centre at a rate near the largest feasible one.

    Args:
        start: a P whose rate is above ``alpha``.
        stack: the balanced matrices A, N by m by m.
        where: where P may hold other entries than zero, m by m; None: everywhere.
        near: as ``NEAR``; a smaller one gives a larger rate, and a P closer to the boundary of the feasible set.
    """
    p, rate = start, least_rate(start, stack, h)
    for _ in range(CLIMBS):
        middle = analytic_centre([(stack, alpha)], h, p, where)
        if middle is None:
            break
        p, rate = middle, least_rate(middle, stack, h)
        if rate - alpha < near * alpha:
            break
        alpha += 0.9 * (rate - alpha)
    return p, rate


def analytic_centre(groups: Sequence[Group], h: float, start: Array, where: Pattern | None = None) -> Array | None:
    """The P that minimises −Σ log det F(P) − log det P + tr P; None where ``start`` is not feasible.

    F(P) = −(A'P + PA + hA'PA + 2αP) over all A of all groups, each with its α. The function is strictly convex, so it
    has one minimum; the trace bounds P. Every A has its term, even one inside the convex hull of the others.

    Args:
        start: a P with F > 0 and P > 0.
        where: as in ``method_of_centres``.
    """
    size = len(start)
    rows, columns = np.tril_indices(size)
    free = np.ones(len(rows), dtype=bool) if where is None else np.asarray(where, dtype=bool)[rows, columns]
    spread = half_vectorisation(size)[1][:, free]
    maps = [lyapunov_maps(np.asarray(stack), h, alpha) @ spread for stack, alpha in groups]
    blocks = np.concatenate([*maps, spread[None]]).reshape(-1, size, size, spread.shape[1])
    trace = spread.T @ np.eye(size).ravel()
    x = start[rows, columns][free]
    x = x * (len(blocks) * size / (trace @ x))  # its trace at the minimum
    height = _barrier(blocks @ x)
    if height is None:
        return None
    further = 0
    for _ in range(STEPS):
        inverses = _inverses(blocks @ x)
        slope = trace - np.tensordot(inverses, blocks, axes=([0, 1, 2], [0, 1, 2]))
        turned = (inverses @ blocks.reshape(len(blocks), size, -1)).reshape(blocks.shape)
        bend = np.tensordot(turned, turned.transpose(0, 2, 1, 3), axes=([0, 1, 2], [0, 1, 2]))
        step = -np.linalg.solve(bend, slope)
        left = float(-slope @ step)
        if not np.isfinite(left):
            return None
        share, following = 1.0, _barrier(blocks @ (x + step))
        while left > SURE and (following is None or following + trace @ (share * step) > height - 0.1 * share * left):
            share /= 2  # 1 / (1 + sqrt(left)) would do, and no search is longer than to there
            following = _barrier(blocks @ (x + share * step))
        if following is None:
            return None
        x, height = x + share * step, following
        further += left < SETTLED
        if further == MORE:
            break
    else:
        return None
    p = np.zeros((size, size))
    p[rows[free], columns[free]] = x
    return np.asarray(p + np.tril(p, -1).T)


def _barrier(matrices: Array) -> float | None:
    """−Σ log det of a stack of symmetric matrices; None where one is not positive definite."""
    try:
        factors = np.linalg.cholesky((matrices + matrices.transpose(0, 2, 1)) / 2)
    except np.linalg.LinAlgError:
        return None
    return -2 * float(np.log(np.diagonal(factors, axis1=1, axis2=2)).sum())


def _inverses(matrices: Array) -> Array:
    """Of a stack of symmetric matrices."""
    found = np.linalg.inv(matrices)
    return np.asarray((found + found.transpose(0, 2, 1)) / 2)
