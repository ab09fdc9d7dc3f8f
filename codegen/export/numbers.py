"""Formatting of numbers in exported files."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def number(value: float) -> str:
    """The shortest decimal of a double; whole numbers without a point."""
    value = float(value) + 0.0
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def numbers(values: ArrayLike) -> str:
    """A number, or several with spaces between."""
    return " ".join(number(v) for v in np.ravel(values))


def polynomial(values: list[float] | tuple[float, ...]) -> str:
    """The coefficients up to the last nonzero one, in MuJoCo's form."""
    last = max((k for k, v in enumerate(values) if v), default=0)
    return numbers(values[: last + 1])
