"""An exact number → the number that generated code has for it: rounded once to a double, and what that prints as.

C and the Python twin print the shortest decimal that denotes a double, and the checker reads that decimal in the twin.
So a number of a spec is this decimal from the start, and equations, certificate and code use the same number. A
decimal of up to 15 digits is its own shortest one: 0.1 is 1/10.
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
    """Whether a number other than zero has a size that a spec may have."""
    return 1e-300 < abs(double) < 1e300


def printed(value: Any, place: Place, found: str) -> sympy.Rational:
    """A rational number rounded once to a double, as the decimal that code prints.

    Args:
        found: what was read there, for the message.

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
