"""Conversion of an exact number of a spec to the decimal that the generated code contains for it.

The number is rounded once to a double, and the decimal is the shortest one that denotes this double. C and the Python
twin print this decimal, and the checker reads it in the C. So equations, certificate and code use the same number. A
decimal of up to 15 digits is not changed by this: 0.1 remains 1/10.
"""

from __future__ import annotations

import math
from typing import Any

import sympy

from codegen.base.errors import BadInput, Place

RANGE = "a finite number between 1e-300 and 1e300 in size"


def decimal_of(double: float) -> sympy.Rational:
    """The shortest decimal that denotes a finite double, exactly."""
    return sympy.Rational(repr(double))


def in_range(double: float) -> bool:
    """Whether the magnitude of a number other than zero is within the range that a spec may use."""
    return 1e-300 < abs(double) < 1e300


def printed(value: Any, place: Place, found: str) -> sympy.Rational:
    """A rational number rounded once to a double, as the decimal that code prints.

    Args:
        found: the text of the spec that gives the number, for the message.

    Raises:
        BadInput: for a number that is not zero and not between 1e-300 and 1e300 in size.
    """
    try:
        double = int(value.p) / int(value.q)  # Python rounds a quotient of integers correctly
    except OverflowError:
        double = math.inf
    if value != 0 and not in_range(double):
        raise BadInput(place, found, RANGE, code="SPEC007")
    return decimal_of(double)
