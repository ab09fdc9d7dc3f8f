"""Analytic centre of the set of feasible Lyapunov matrices P, by Newton's method, and the method of centres.

The P that a solver of linear matrix inequalities returns depends on rounding: on two processors it differed by a fifth.
The analytic centre is the minimum of a strictly convex function, so it is unique and depends continuously on the data.
The method of centres (Boyd and El Ghaoui 1993) repeats two steps: find the centre for a required rate α, then raise α
towards the rate that this centre certifies.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array

Matrices = Sequence[Array] | Array
"""Error matrices A, m by m each."""
Group = tuple[Matrices, float]
"""Error matrices with the decay rate α, 1/s, that is required for all of them."""
Pattern = NDArray[np.bool_]
"""Sparsity pattern of P, m by m: False where an entry is zero."""
RATIO = 0.99
"""Quotient of successive rates tried by ``largest_feasible_rate``."""
LEAST = 1024
"""RATIO to this power is the least share of a limit that is tried."""
MOST_CENTRES = 200
"""Largest number of iterations of the method of centres."""
NEAR = 2e-3
"""Relative tolerance of the method of centres: it ends when (rate of the centre − required rate) is below this share of
the required rate."""
STEPS = 80
"""Largest number of Newton steps for one centre."""
SURE = 0.1
"""Squared Newton decrement below which a full step stays feasible and decreases the function."""
QUADRATIC, MORE = 1e-6, 4
"""Squared Newton decrement below which convergence is quadratic, and the number of steps taken from there on."""


def half_vectorisation(size: int) -> tuple[Array, Array]:
    """(W, D) with svec X = W vec X and vec X = D vech X for a symmetric X, ``size`` by ``size``.

    vech X is the lower triangle row by row, n = size (size + 1)/2 entries; svec X is vech X with the off-diagonal
    entries times √2. W is n by size², D is size² by n.
    """
    rows, columns = np.tril_indices(size)
    pick, spread = np.zeros((len(rows), size * size)), np.zeros((size * size, len(rows)))
    for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
        pick[k, i * size + j] = 1.0 if i == j else np.sqrt(2.0)
        spread[[i * size + j, j * size + i], k] = 1.0
    return pick, spread


def lyapunov_maps(stack: Array, h: float, alpha: float) -> Array:
    """The Lyapunov operators −(A'P + PA + hA'PA + 2αP) as matrices that act on vec P, N by m² by m²; ``stack``: the A.

    The P of a solver depends on their last bits, so the order of operations must not change.
    """
    transposed, size = stack.transpose(0, 2, 1), stack.shape[1]
    unit = np.eye(size)
    first, second = transposed[:, :, None, :, None], transposed[:, None, :, None, :]
    now = first * unit[:, None, :] + unit[:, None, :, None] * second + h * (first * second)
    return np.asarray(-(now.reshape(-1, size * size, size * size) + 2 * alpha * np.eye(size * size)))


def certified_rates(p: Array, stack: Array, h: float) -> Array:
    """For each A of a stack, N by m by m, the largest α with A'P + PA + hA'PA ≤ −2αP, in 1/s; P > 0.

    Raises:
        numpy.linalg.LinAlgError: if P is not positive definite.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    transposed = stack.transpose(0, 2, 1)
    falls = -(transposed @ p + p @ stack + h * transposed @ p @ stack)
    return np.asarray(np.linalg.eigvalsh(inverse @ falls @ inverse.T)[:, 0] / 2)


def least_rate(p: Array, matrices: Matrices, h: float) -> float:
    """The largest α, 1/s, with A'P + PA + hA'PA ≤ −2αP for all these matrices A; P > 0."""
    return float(certified_rates(p, np.asarray(matrices), h).min())


def largest_feasible_rate(holds: Callable[[float], Array | None], limit: float) -> tuple[Array, float] | None:
    """(P, α) at the largest α = ``limit`` · 0.99^k, k = 1, 2, …, for which ``holds`` finds a P; None if there is none.

    k is found by doubling and bisection. The rates differ by 1 %, so the result seldom depends on a solver's tolerance
    of a thousandth.
    """
    limit = float(f"{limit:.7g}")
    bad, good, found = 0, 1, None
    while found is None:
        found = holds(limit * RATIO**good)
        if found is None:
            if good >= LEAST:
                return None
            bad, good = good, 2 * good
    good, found = first_found(lambda k: holds(limit * RATIO**k), bad, good, found)
    return found, limit * RATIO**good


def first_found(at: Callable[[int], Array | None], bad: int, good: int, found: Array) -> tuple[int, Array]:
    """(k, P) for the least k in (``bad``, ``good``] where ``at`` finds one, by bisection; ``good`` has ``found``."""
    while good - bad > 1:
        middle = (good + bad) // 2
        other = at(middle)
        if other is None:
            bad = middle
        else:
            good, found = middle, other
    return good, found


def method_of_centres(
    start: Array, alpha: float, stack: Array, h: float, where: Pattern | None = None, near: float = NEAR
) -> Array:
    """The analytic centre P for a required rate near the largest feasible one.

    Args:
        start: a P whose rate is above ``alpha``, the first required rate, 1/s.
        stack: the balanced matrices A, N by m by m.
        where: sparsity pattern of P, m by m; None if P is full.
        near: as ``NEAR``; a smaller one gives a larger rate, and a P closer to the boundary of the feasible set.
    """
    p = start
    for _ in range(MOST_CENTRES):
        middle = analytic_centre([(stack, alpha)], h, p, where)
        if middle is None:
            break
        p, more = middle, least_rate(middle, stack, h) - alpha
        if more < near * alpha:
            break
        alpha += 0.9 * more
    return p


def analytic_centre(groups: Sequence[Group], h: float, start: Array, where: Pattern | None = None) -> Array | None:
    """The P that minimises −Σ log det F(P) − log det P + tr P; None if ``start`` is infeasible or Newton fails.

    The sum is over all A of all groups, F(P) = −(A'P + PA + hA'PA + 2αP) with the α of the group. The function is
    strictly convex, so its minimum is unique; tr P bounds P. Each A has its term, even one inside the convex hull of
    the others.

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
    value = _barrier(blocks @ x)
    if value is None:
        return None
    further = 0
    for _ in range(STEPS):
        inverses = np.linalg.inv(blocks @ x)
        inverses = (inverses + inverses.transpose(0, 2, 1)) / 2
        gradient = trace - np.tensordot(inverses, blocks, axes=([0, 1, 2], [0, 1, 2]))
        products = (inverses @ blocks.reshape(len(blocks), size, -1)).reshape(blocks.shape)
        hessian = np.tensordot(products, products.transpose(0, 2, 1, 3), axes=([0, 1, 2], [0, 1, 2]))
        step = -np.linalg.solve(hessian, gradient)
        decrement = float(-gradient @ step)
        if not np.isfinite(decrement):
            return None
        length, next_value = 1.0, _barrier(blocks @ (x + step))
        while decrement > SURE and (
            next_value is None or next_value + trace @ (length * step) > value - 0.1 * length * decrement
        ):
            length /= 2  # the damped Newton step 1 / (1 + sqrt(decrement)) meets the condition, so the search ends
            next_value = _barrier(blocks @ (x + length * step))
        if next_value is None:
            return None
        x, value = x + length * step, next_value
        further += decrement < QUADRATIC
        if further == MORE:
            break
    else:
        return None
    p = np.zeros((size, size))
    p[rows[free], columns[free]] = x
    return np.asarray(p + np.tril(p, -1).T)


def _barrier(matrices: Array) -> float | None:
    """The barrier −Σ log det X of a stack of symmetric matrices X; None if one is not positive definite."""
    try:
        factors = np.linalg.cholesky((matrices + matrices.transpose(0, 2, 1)) / 2)
    except np.linalg.LinAlgError:
        return None
    return -2 * float(np.log(np.diagonal(factors, axis1=1, axis2=2)).sum())
