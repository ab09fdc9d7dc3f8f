"""Types of NumPy arrays by the type of their entries; shapes are in the docstrings of their users."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array of doubles."""
Flags = NDArray[np.bool_]
"""Array of truth values."""
