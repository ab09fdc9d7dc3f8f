"""Proof that at every point of a box some of several expressions differs from zero, by branch and bound.

On each part of the box one of the expressions must have an enclosure, in the checker's interval arithmetic, without 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import sympy

from codegen.certify.certificate_text import fraction, to_prefix
from codegen.checker import verify

MOST_BOXES = 4000
"""Most parts of the box that are examined for a proof."""

Box = tuple[tuple[Fraction, Fraction], ...]


def some_is_nonzero(
    expressions: Sequence[Any], variables: Sequence[sympy.Symbol], bounds: Sequence[tuple[float, float]]
) -> bool:
    """Whether it is proven that everywhere within the bounds of the variables some expression is not zero."""
    known = [v.name for v in variables]
    try:
        values = [verify.parse(to_prefix(e), known, "expression")[1] for e in expressions]
    except (TypeError, verify.Refused):  # a function that certificates do not have
        return False
    ends: Box = tuple((fraction(low), fraction(high)) for low, high in bounds)
    boxes = [ends]
    for _ in range(MOST_BOXES):
        if not boxes:
            return True
        box = boxes.pop()
        if not any(_is_away_from_zero(value, dict(zip(known, box, strict=True))) for value in values):
            boxes += _halves(box, ends)
    return False


def _is_away_from_zero(value: Any, box: dict[str, tuple[Fraction, Fraction]]) -> bool:
    """Whether the enclosure of a value on a box excludes zero."""
    try:
        low, high = value(box)
    except verify.Refused:
        return False
    return bool(low > 0 or high < 0)


def _halves(box: Box, ends: Box) -> list[Box]:
    """The box, bisected along the side that is the longest relative to the whole range."""
    widths = [(high - low) / (end[1] - end[0]) for (low, high), end in zip(box, ends, strict=True)]
    k = widths.index(max(widths))
    low, high = box[k]
    middle = (low + high) / 2
    return [(*box[:k], part, *box[k + 1 :]) for part in ((low, middle), (middle, high))]
