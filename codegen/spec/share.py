"""A relative tolerance as a spec writes it: 1%, 20 % or 0.2."""

from __future__ import annotations

from codegen.errors import BadInput, Place
from codegen.spec.expression import exact_number

LARGEST = 10


def read_share(text: str, place: Place) -> float:
    """The share that a text says.

    Raises:
        BadInput: for what is no number, is below zero or above 1000 %.
    """
    plain = text.strip()
    number = float(exact_number(plain.removesuffix("%").strip(), place)) / (100 if plain.endswith("%") else 1)
    if not 0 <= number <= LARGEST:
        raise BadInput(place, f"tolerance {text}", "a share such as 1% or 0.01, at most 1000%")
    return number
