"""Detection of decimal commas, ``0,05`` for ``0.05``, in a value or an expression."""

from __future__ import annotations

import re
from collections.abc import Sequence

DECIMAL_COMMA = "a decimal comma"
_NUMBER = r"\d+,\d+(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"\s*[-+]?{_NUMBER}(?:\s*(?:%|[^\W\d_].*|1/.*))?\s*")
_INSIDE = re.compile(rf"(?<![\w.,]){_NUMBER}(?!,)")
_CALL = re.compile(r"([A-Za-z]\w*)\([^()]*$")


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


def with_point(text: str) -> str:
    """The number with a point, ``0.05``; for ``1,000``, where the comma may separate thousands, both forms."""
    point = text.strip().replace(",", ".", 1)
    grouped = re.match(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)", text.strip())
    return f"`{point}`, or `{text.strip().replace(',', '', 1)}` without a separator" if grouped else f"`{point}`"
