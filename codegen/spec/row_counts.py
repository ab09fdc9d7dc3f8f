"""Check of the shape of matrices in a spec."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from codegen.base.errors import BadInput, PlaceOf


def refuse_other_shape(
    rows: Sequence[Sequence[Any]], shape: tuple[int, int], key: str, place: PlaceOf, what: str = "", meaning: str = ""
) -> None:
    """Raise BadInput if a matrix does not have ``shape``, at the first row that is too short or too long.

    Args:
        what: text of the message before the rows, such as ``K_F of ``.
        meaning: text after the shape.
    """
    odd = [i for i, row in enumerate(rows) if len(row) != shape[1]]
    if len(rows) == shape[0] and not odd:
        return
    at = place(key)
    if len({len(row) for row in rows}) > 1:
        found = f"{len(rows)} rows, of which " + ", ".join(f"row {i + 1} has {len(rows[i])} entries" for i in odd)
        at = replace(at, line=place(f"{key}[{odd[0]}]").line)
    else:
        found = f"{len(rows)} row{'s' * (len(rows) != 1)} of {len(rows[0]) if rows else 0}"
    expected = f"{shape[0]} by {shape[1]}{meaning}"
    raise BadInput(at, what + found.replace(" 1 entries", " 1 entry"), expected, code="SPEC015")
