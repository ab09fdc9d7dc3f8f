"""Detection of decimal commas, ``0,05`` for ``0.05``: in a value, in an expression, or split into two list entries."""

from __future__ import annotations

import re
from collections.abc import Sequence

DECIMAL_COMMA = "a decimal comma"
QUESTION = "or are these decimal commas? A number is written with a decimal point"
"""Added to the message on a list with too many entries, if decimal commas may be the cause."""
_NUMBER = r"\d+,\d+(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"\s*[-+]?{_NUMBER}(?:\s*(?:%|[^\W\d_].*|1/.*))?\s*")
_INSIDE = re.compile(rf"(?<![\w.,]){_NUMBER}(?!,)")
_CALL = re.compile(r"([A-Za-z]\w*)\([^()]*$")
_ENDS_WHOLE, _BEGINS_WITH_DIGIT = re.compile(r"(?:.*[^\w.,])?\d+", re.DOTALL), re.compile(r"\d(?!\d*\.)")


def comma_in_value(text: str) -> bool:
    """Whether a value is a number with a decimal comma, possibly followed by a unit or a per cent sign."""
    return _VALUE.fullmatch(text) is not None


def comma_in_expression(text: str, functions: Sequence[str]) -> str | None:
    """The first number with a decimal comma in an expression; None if there is none.

    The comma of ``max(1,5)`` separates arguments. All of ``functions`` have one argument.
    """
    for found in _INSIDE.finditer(text):
        call = _CALL.search(text[: found.start()])
        if call is None or call[1] in functions:
            return found[0]
    return None


def comma_at_joint(before: object, after: object) -> bool:
    """Whether two neighbouring entries may be one number split by YAML at a decimal comma, as 3 and 2 of ``3,2``."""
    if isinstance(before, (bool, float)) or isinstance(after, (bool, float)):
        return False
    return bool(_ENDS_WHOLE.fullmatch(str(before)) and _BEGINS_WITH_DIGIT.match(str(after)))


def maybe_commas(entries: Sequence[object], wanted: int) -> bool:
    """Whether a list that is too long would have ``wanted`` entries if some of its commas were decimal commas."""
    joints, k = 0, 0
    while k + 1 < len(entries):
        joined = comma_at_joint(entries[k], entries[k + 1])
        joints, k = joints + joined, k + 1 + joined
    return 0 < len(entries) - wanted <= joints


def with_point(text: str) -> str:
    """The number with a point, ``0.05``; for ``1,000``, where the comma may separate thousands, both forms."""
    point = text.strip().replace(",", ".", 1)
    grouped = re.match(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)", text.strip())
    return f"`{point}`, or `{text.strip().replace(',', '', 1)}` without a separator" if grouped else f"`{point}`"
