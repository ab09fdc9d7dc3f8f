"""Weighted least squares for the cancelling input at one operating point: min r'W r, r = B ū − U F̄."""

from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.mechanics.system import Matrix

SINGULAR = 1e-9
"""Ratio to the largest singular value below which one counts as zero."""


def weighted_rank_form(weight: str, mass: Any, left: Any, right: Any) -> tuple[Any, int]:
    """A block matrix without M⁻¹ whose rank is rank(left' W right) + constant (Schur complement), and the constant.

    Args:
        weight: W as ``mass_inverse`` (M⁻¹), ``acceleration`` (M⁻²) or ``identity``.
        left, right: matrices of n rows.
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
    """A square root of the weight, V with V'V = W, so that r'W r = |V r|²; n by n."""
    if weight == "identity":
        return np.eye(len(mass))
    if weight == "acceleration":
        return np.asarray(np.linalg.inv(mass))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(mass)))


def best_inputs(
    input_matrix: Array, mass: Array, forces: Array, weight: str, pivots: tuple[int, ...] | None = None
) -> Array:
    """The ū, inputs by m, that minimises r'W r, r = B ū − force, for each column of ``forces``, n by m, such as U.

    Args:
        input_matrix, mass: B, n by inputs, and M, n by n.
        weight: W, as in ``weighted_rank_form``.
        pivots: the inputs used (Appendix B); the others are 0. None: all, and the solution of least norm.
    """
    V = whitener(weight, mass)
    if pivots is None:
        return np.asarray(np.linalg.pinv(V @ input_matrix, rcond=SINGULAR) @ V @ forces)
    result = np.zeros((input_matrix.shape[1], forces.shape[1]))
    chosen = list(pivots)
    result[chosen] = np.linalg.lstsq(V @ input_matrix[:, chosen], V @ forces, rcond=None)[0]
    return result


def removed_share(input_matrix: Array, mass: Array, forces: Array, weight: str) -> Array:
    """1 − min r'W r / force'W force for each column of ``forces``: the share, 0 to 1, that the best input removes.

    1 for a force that is zero at this point. The arguments are those of ``best_inputs``.
    """
    V = whitener(weight, mass)
    left = V @ (input_matrix @ best_inputs(input_matrix, mass, forces, weight) - forces)
    whole = np.sum((V @ forces) ** 2, axis=0)
    return np.asarray(1 - np.sum(left**2, axis=0) / np.where(whole == 0, 1, whole))
