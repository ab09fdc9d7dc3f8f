"""Linear matrix inequalities in a few symmetric matrices, by Clarabel: what it finds is only proposed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import clarabel
import numpy as np
import scipy.sparse
from numpy.typing import NDArray

Array = NDArray[np.float64]
LARGEST = 1e6
SLACK = 1e-3


def half(size: int) -> tuple[Array, Array]:
    """(W, D): the scaled lower half of a symmetric matrix X is W vec X, and vec X is D of its unscaled lower half."""
    rows, columns = np.tril_indices(size)
    pick, spread = np.zeros((len(rows), size * size)), np.zeros((size * size, len(rows)))
    for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
        pick[k, i * size + j] = 1.0 if i == j else np.sqrt(2.0)
        spread[[i * size + j, j * size + i], k] = 1.0
    return pick, spread


def fall(a: Array, h: float, alpha: float) -> Array:
    """The map vec P → vec −(A'P + PA + hA'PA + 2αP), m² by m²; its terms in P one sample later, but for the last."""
    unit = np.eye(len(a))
    now = np.kron(a.T, unit) + np.kron(unit, a.T) + h * np.kron(a.T, a.T)
    return np.asarray(-(now + 2 * alpha * np.eye(len(now))))


def feasible(
    conditions: Sequence[Mapping[int, Array]], count: int, size: int, structure: NDArray[np.bool_] | None = None
) -> list[Array] | None:
    """Matrices P_k with I ≤ P_k ≤ 10⁶ I and Σ L_k(P_k) > 0 for each condition, far from its edge; None if none.

    Args:
        conditions: k → L_k, which maps vec P_k to a vectorised matrix, size² by size²; scaled to entries of about 1.
        count: of the matrices.
        structure: where they may hold other entries than zero; None: everywhere.
    """
    pick, spread = half(size)
    n, unit = len(pick), pick @ np.eye(size).ravel()
    triplets: list[tuple[Array, int, int]] = []  # block, row, column; the last column is the slack's
    right, cones, row = [], [], 0

    def demand(blocks: Mapping[int, Array], slack: float, least: Array) -> None:
        nonlocal row
        triplets.extend((-pick @ block @ spread, row, k * n) for k, block in blocks.items())
        triplets.append((slack * unit[:, None], row, count * n))
        right.append(-least)
        cones.append(clarabel.PSDTriangleConeT(size))
        row += n

    identity = np.eye(size * size)
    for blocks in conditions:
        demand(blocks, SLACK, 0 * unit)
    for k in range(count):
        demand({k: identity}, 0.0, unit)
        demand({k: -identity}, 0.0, -LARGEST * unit)
    triplets.append((np.ones((1, 1)), row, count * n))
    right.append(np.ones(1))
    cones.append(clarabel.NonnegativeConeT(1))
    row += 1
    zeros = [] if structure is None else [*np.flatnonzero(~structure[np.tril_indices(size)])]
    if zeros:
        triplets.extend((np.eye(n)[zeros], row + k * len(zeros), k * n) for k in range(count))
        right.append(np.zeros(count * len(zeros)))
        cones.append(clarabel.ZeroConeT(count * len(zeros)))
        row += count * len(zeros)
    places = [(block[at], at[0] + r, at[1] + c) for block, r, c in triplets for at in [np.nonzero(block)]]
    values, rows, columns = (np.concatenate(parts) for parts in zip(*places, strict=True))
    unknowns = count * n + 1
    matrix = scipy.sparse.csc_matrix((values, (rows, columns)), shape=(row, unknowns))
    target = np.zeros(unknowns)
    target[-1] = -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    empty = scipy.sparse.csc_matrix((unknowns, unknowns))
    found = clarabel.DefaultSolver(empty, target, matrix, np.concatenate(right), cones, settings).solve()
    x = np.array(found.x)
    if not np.isfinite(x).all() or x[-1] <= 0:
        return None
    result = [(spread @ x[k * n : (k + 1) * n]).reshape(size, size) for k in range(count)]
    return [p if structure is None else np.where(structure, p, 0.0) for p in result]
