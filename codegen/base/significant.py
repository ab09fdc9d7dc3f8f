"""Rounding for print: estimates to the digits that their 95 % interval supports, times, and bounds rounded outwards."""

from collections.abc import Sequence
from decimal import Context, Decimal
from fractions import Fraction
from math import ceil, floor, inf, isfinite, log10, nextafter

OF_WIDTH = 2
"""Number of digits of the half width of an interval to which an estimate is printed."""
MOST = 12
"""Largest number of digits of an estimate."""
OF_TIME, HELD = 6, 15
"""Digits of a time: at least, and those that a double holds."""


def significant_digits(value: float, interval: Sequence[float], most: int = MOST) -> int:
    """Significant digits of ``value`` down to the second digit of the half width of its interval, 1 to ``most``.

    It is ``most`` where the interval is not two finite numbers, low and high.
    """
    half = (interval[1] - interval[0]) / 2 if len(interval) == 2 else 0.0
    if not (isfinite(half) and half > 0 and isfinite(value)) or value == 0:
        return most
    last = floor(log10(half)) - OF_WIDTH + 1
    first = floor(log10(abs(value)))
    return min(max(first - last + 1, 1), most)


def with_deserved_digits(value: float, interval: Sequence[float]) -> str:
    """The value as text with the digits of ``significant_digits``: at most four, if the ends then differ in print.

    Trailing zeros are kept where there is an interval, since they are digits that it supports.
    """
    is_wide = len(interval) == 2 and interval[0] < interval[1]
    alike = is_wide and len({f"{end:.4g}" for end in interval}) == 1
    text = f"{value:{'#' if is_wide else ''}.{significant_digits(value, interval, MOST if alike else 4)}g}"
    return text.replace(".e", "e").removesuffix(".")


def instant(time: float, period: float) -> str:
    """A time in s as text, such as 1770000012.345 at a sample time of 1 ms; ``period``: the sample time, s.

    It has ``OF_TIME`` digits, or more where neighbouring samples would else look the same.
    """
    digits = OF_TIME
    if period > 0 and isfinite(time) and abs(time) >= period:
        digits = floor(log10(abs(time))) + 1 + ceil(-log10(period))
    return f"{time:.{min(max(digits, OF_TIME), HELD)}g}"


def rounded_to(value: float | Fraction | str, digits: int, rounding: str) -> str:
    """A number as text with ``digits`` significant digits, rounded in one direction, so that a printed bound is one.

    Args:
        value: a float is taken as its shortest decimal (``repr``); a text is an exact rational, such as 1/3.
        rounding: a rounding mode of the module ``decimal``, such as ROUND_CEILING or ROUND_FLOOR.
    """
    if isinstance(value, Fraction | str):
        top, bottom = map(Decimal, Fraction(value).as_integer_ratio())
    else:
        top, bottom = Decimal(repr(float(value))), Decimal(1)
    return f"{float(Context(digits, rounding).divide(top, bottom)):.{digits}g}"


def float_above(x: Fraction) -> float:
    """The least float whose shortest decimal (``repr``) is not below x."""
    near = float(x)
    return near if Fraction(repr(near)) >= x else nextafter(near, inf)


def in_percent(share: float, digits: int = 2) -> str:
    """A share in %, without an exponent: 120 % and not 1.2e+02 %."""
    value = 100 * share
    return f"{value:.0f} %" if abs(value) >= 99.5 else f"{value:.{digits}g} %"
