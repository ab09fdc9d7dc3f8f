"""Proof that at every point of a box some of several expressions differs from zero, on cells that cover the box.

On each cell one of the expressions must have an enclosure, in the checker's interval arithmetic, without 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from codegen.certify.certificate_text import fraction, to_prefix
from codegen.certify.cover import Cell, covering
from codegen.checker import verify

DEEPEST = 12
"""Largest number of bisections of the box one after another."""


def some_is_nonzero(
    expressions: Sequence[Any], variables: Sequence[sympy.Symbol], bounds: Sequence[tuple[float, float]]
) -> bool:
    """Whether it is proven that everywhere within the bounds of the variables some expression is not zero."""
    whole = {v.name: (fraction(low), fraction(high)) for v, (low, high) in zip(variables, bounds, strict=True)}
    try:
        values = [verify.parse(to_prefix(e), [*whole], "expression")[1] for e in expressions]
    except (TypeError, verify.Refused):  # a function that certificates do not have
        return False

    def away_from_zero(value: Any, cell: Cell) -> bool:
        try:
            low, high = value(cell)
        except verify.Refused:
            return False
        return bool(low > 0 or high < 0)

    return covering(lambda cell: any(away_from_zero(value, cell) for value in values), whole, DEEPEST) is not None
