"""Types of NumPy arrays by what they hold; shapes are in the docstrings of those who use them."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
