"""Words of a language: how it calls functions and writes numbers; infix + − * / and parentheses are common to all."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codegen.base.errors import BadInput


@dataclass(frozen=True)
class Language:
    """A language at one precision.

    Attributes:
        calls: function → its name; ``quotient`` is a division whose divisor may be zero.
        single: whether numbers are single precision.
        number: format of a literal with {digits}.
        opening, closing: around an expression that takes several lines.
        narrows: whether the language itself rounds a literal to single precision: what is no single is then written as
            the double that it is, which the checker reads in the twin as the certificate's number.
    """

    calls: Mapping[str, str]
    single: bool = False
    number: str = "{digits}"
    opening: str = ""
    closing: str = ""
    narrows: bool = False

    def literal(self, value: float) -> str:
        """The shortest decimal that is this number, with a point or an exponent.

        Raises:
            BadInput: for a number that no literal can express, or that vanishes or overflows in single precision.
        """
        size = "single" if self.single else "double"
        with np.errstate(over="ignore", under="ignore"):
            rounded = np.float32(value) if self.single else np.float64(value)
        if not math.isfinite(rounded) or (value != 0) != (rounded != 0):
            raise BadInput(
                "generated code",
                f"the constant {value}",
                f"parameters and gains whose products are within the range of a {size}",
                code="SPEC028",
            )
        wide = not self.single or (self.narrows and float(rounded) != value)
        digits = repr(float(value)) if wide else str(rounded)
        return self.number.format(digits=digits)
