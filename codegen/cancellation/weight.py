"""Weights W in the cost r'W r of a remaining force, r = B ū − U F̄."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.mechanics.system import Matrix

Array = NDArray[np.float64]


def weighted_rank_form(weight: str, mass: Any, left: Any, right: Any) -> tuple[Any, int]:
    """A matrix without inverses whose rank is that of left' W right plus a known number.

    Args:
        weight: ``mass_inverse``, ``acceleration`` or ``identity``.
        mass: M, n by n.
        left, right: n by anything.

    Returns:
        the matrix, and its rank where left' W right = 0.
    """
    n, zeros, eye = mass.rows, sympy.zeros, sympy.eye
    if weight == "identity":
        return Matrix(left.T * right), 0
    if weight == "mass_inverse":
        rows = [[mass, right], [left.T, zeros(left.cols, right.cols)]]
        return Matrix(sympy.BlockMatrix(rows)), n
    rows = [
        [mass, zeros(n, n), right],
        [-eye(n), mass, zeros(n, right.cols)],
        [zeros(left.cols, n), left.T, zeros(left.cols, right.cols)],
    ]
    return Matrix(sympy.BlockMatrix(rows)), 2 * n


def whitener(weight: str, mass: Array) -> Array:
    """V with V'V = W, so that |V r|² is the cost of r; n by n."""
    if weight == "identity":
        return np.eye(len(mass))
    if weight == "acceleration":
        return np.asarray(np.linalg.inv(mass))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(mass)))
