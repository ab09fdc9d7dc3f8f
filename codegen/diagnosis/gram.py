"""Least squares on blocks through Gram matrices: every fold's fit and error without the data again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blocks:
    """Samples of one log cut into contiguous blocks of equal weight.

    Attributes:
        index: (N,) block of each sample, −1 where it is not used.
        count: number of blocks.
    """

    index: NDArray[np.int64]
    count: int


def cut_blocks(usable: NDArray[np.bool_], stride: int, count: int) -> Blocks:
    """Every ``stride``-th usable sample, in ``count`` contiguous blocks."""
    index = np.full(len(usable), -1, dtype=np.int64)
    kept = np.flatnonzero(usable)[::stride]
    index[kept] = np.arange(len(kept)) * count // max(len(kept), 1)
    return Blocks(index, count)


@dataclass(frozen=True, eq=False)
class Grams:
    """Per-block products of [target | columns].

    Attributes:
        products: (blocks, 1+p, 1+p).
        ridge: (p,) added to the diagonal of a fit's normal matrix: the prior weight of each column.
        samples: rows that went in.
    """

    products: Array
    ridge: Array
    samples: int

    def fit(self, leave_out: int | None = None) -> Array:
        """(p,) weights from all blocks, or from all but one."""
        total = self.products.sum(axis=0)
        if leave_out is not None:
            total = total - self.products[leave_out]
        return _solve(total, self.ridge)

    def error(self, weights: Array, block: int | None = None) -> float:
        """Sum of squared residuals at these weights, over one block or all."""
        products = self.products.sum(axis=0) if block is None else self.products[block]
        z = np.concatenate([[1.0], -weights])
        return float(max(z @ products @ z, 0.0))

    def held_out(self) -> Array:
        """(blocks,) error on each block of the fit to the others."""
        return np.array([self.error(self.fit(b), b) for b in range(len(self.products))])

    def conditioning(self) -> float:
        """Smallest share of a column that the others do not explain: 0 means a column adds nothing new."""
        normal = self.products.sum(axis=0)[1:, 1:] + np.diag(self.ridge)
        size = np.sqrt(np.diag(normal))
        if not np.all(size > 0):
            return 0.0
        return float(np.linalg.eigvalsh(normal / np.outer(size, size))[0])


def _solve(total: Array, ridge: Array) -> Array:
    normal, right = total[1:, 1:] + np.diag(ridge), total[1:, 0]
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    solution, *_ = np.linalg.lstsq(normal / np.outer(size, size), right / size, rcond=1e-10)
    return np.asarray(solution / size)


def gram(target: Array, columns: Array, ridge: Array, blocks: list[Blocks], scale: Array) -> Grams:
    """Products of target and columns on each block, rows of all coordinates together.

    Args:
        target: (N, n).
        columns: (p, N, n).
        ridge: (p,).
        blocks: one a coordinate, since standstill differs.
        scale: (n,) by which each row is divided.
    """
    p, count = len(columns), blocks[0].count
    products, samples = np.zeros((count, 1 + p, 1 + p)), 0
    for i, cut in enumerate(blocks):
        used = np.flatnonzero(cut.index >= 0)
        data = np.vstack([target[used, i][None, :], columns[:, used, i]]) / scale[i]
        edges = np.searchsorted(cut.index[used], np.arange(count + 1))
        samples += len(used)
        for b in range(count):
            part = data[:, edges[b] : edges[b + 1]]
            products[b] += part @ part.T
    return Grams(products, ridge, samples)
