"""Linear least squares in scaled unknowns, whose units may differ by many powers of ten, and measures of a residual."""

import numpy as np

from codegen.base.arrays import Array


def scales(matrix: Array) -> Array:
    """(p,) roots of the diagonal of a normal matrix; 1 for an unknown without influence, which then does not move."""
    diagonal = np.diag(matrix)
    return np.where(diagonal > 0, np.sqrt(np.maximum(diagonal, 0.0)), 1.0)


def solved(matrix: Array, right: Array, rcond: float = 1e-10) -> Array:
    """(p,) least-norm solution of normal equations."""
    size = scales(matrix)
    return np.asarray(np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=rcond)[0] / size)


def inverse(matrix: Array) -> Array:
    """(p, p) pseudo-inverse of a normal matrix."""
    size = scales(matrix)
    return np.asarray(np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-12) / np.outer(size, size))


def fitted(columns: Array, values: Array) -> Array:
    """(p,) least-squares weights of columns (N, p) for values (N,); about zero for a column of zeros."""
    norm = np.linalg.norm(columns, axis=0)
    size = np.where(norm > 0, norm, 1.0)
    return np.asarray(np.linalg.lstsq(columns / size, values, rcond=1e-9)[0] / size)


def regressed(values: Array, columns: Array) -> tuple[Array, Array]:
    """Least-squares weights of columns (N, p) for values (N,), and what they leave, (N,)."""
    weights = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=np.float64)
    return weights, values - columns @ weights


def rms(values: Array) -> float:
    """The root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def correlation(values: Array) -> float:
    """Autocorrelation φ at lag 1 of values (N,), limited to [0, 0.99]."""
    power = float(values @ values)
    return limited(float(values[1:] @ values[:-1]) / power) if power > 0 else 0.0


def limited(phi: float) -> float:
    """A correlation limited to [0, 0.99]."""
    return min(max(phi, 0.0), 0.99)


def independent(phi: float) -> float:
    """Share of independent values at this correlation of neighbours."""
    return (1 - phi) / (1 + phi)
