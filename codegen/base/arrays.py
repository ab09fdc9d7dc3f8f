"""Types of NumPy arrays by the type of their entries (shapes are in the docstrings of users), and runs of flags."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array of doubles."""
Flags = NDArray[np.bool_]
"""Array of truth values."""


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Half-open index ranges [start, stop) of the runs of true values in (N,) flags."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0])))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
