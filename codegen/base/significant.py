"""Significant digits of an estimate by its 95 % interval: down to the second digit of the interval's half width."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, isfinite, log10

OF_WIDTH = 2
MOST = 12


def significant_digits(value: float, interval: Sequence[float], most: int = MOST) -> int:
    """Significant digits of ``value`` down to the second digit of the half width of its interval, 1 to ``most``.

    Args:
        interval: low and high end; where they are not finite or no two numbers, ``most`` digits are kept.
    """
    half = (interval[1] - interval[0]) / 2 if len(interval) == 2 else 0.0
    if not (isfinite(half) and half > 0 and isfinite(value)) or value == 0:
        return most
    last = floor(log10(half)) - OF_WIDTH + 1
    first = floor(log10(abs(value)))
    return min(max(first - last + 1, 1), most)


def with_deserved_digits(value: float, interval: Sequence[float], most: int = 4) -> str:
    """The value with at most so many digits, and no more than its interval lets it have."""
    return f"{value:.{significant_digits(value, interval, most)}g}"
