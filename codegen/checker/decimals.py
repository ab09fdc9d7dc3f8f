"""The exp, sine and cosine of a number, as a decimal of 50 digits: how the kernel evaluates them.

Standard library only; part of the checker (verify.py), which passes ``frame`` in. The kernel's claims are about this
decimal in place of the exact value; rounding.py refuses what multiplies the difference by much.
"""

from decimal import Context
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING or __package__:
    from codegen.checker import frame

DIGITS, LEAST = 50, Fraction(1, 10**25)


@lru_cache(1000)
def decimal(function: str, x: Fraction) -> Fraction:
    """The value of "cos", "exp" or "sin": an exp to 50 significant digits, the others to 50 decimal places.

    Raises ValueError for an exp that no such decimal holds, for an angle beyond 100 rad, and for a sine or cosine below
    10^-25 (but sin(0) = 0), of whose digits not even 25 would be right: sin(1.4e-50) would be 1e-50.
    """
    if function == "exp":
        digits = Context(DIGITS).exp(Context(99).divide(*x.as_integer_ratio()))
        frame.demand(digits, "exp of a number that is too small")
        return Fraction(digits)
    frame.demand(abs(x) <= 100, f"{function} of a number beyond 100")
    size = wave(function, abs(x))
    frame.demand((function == "sin" and not x) or abs(size) >= LEAST, f"{function} of a number is below 10^-25")
    return -size if function == "sin" and x < 0 else size


def wave(function: str, x: Fraction) -> Fraction:
    """The sine or cosine of a number from 0 to 100, by Taylor's series in whole multiples of 10^-110.

    Each term is that before it times -x^2/(n (n - 1)), rounded down. This rounding is off by less than a unit, and so
    are all terms that are left out once a term is 0, if that 0 counts as rounded too. What is off by a unit in one term
    makes the sum of all terms behind it, whose factors are at most those of the series of e^100, off by less than
    e^100 < 10^44 units. There are fewer than 400 terms, and rounding x adds a unit: the sum is off by less than 10^-60.
    """
    unit, n, total = 10**110, int(function == "sin"), 0
    whole = round(x * unit)
    term = whole if n else unit
    while term:
        total, n = total + term, n + 2
        term = -term * whole**2 // (unit**2 * n * (n - 1))
    return round(Fraction(total, unit), DIGITS)
