"""A share as a spec or an option writes it: 1%, 20 % or 0.2."""

from __future__ import annotations

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import exact_number

LARGEST = 10


def read_share(text: str, place: Place) -> float:
    """The relative tolerance that a text says.

    Raises:
        BadInput: for what is no number, is below zero or above 1000 %.
    """
    number = _share(text, place)
    if not 0 <= number <= LARGEST:
        raise BadInput(place, f"tolerance {text}", "a share such as 1% or 0.01, at most 1000%", code="SPEC007")
    return number


def read_part(text: str, place: Place) -> float:
    """The part of a whole that a text says.

    Raises:
        BadInput: for what is no number, or not above zero and below 100 %.
    """
    try:
        number = _share(text, place)
    except BadInput:
        number = 0.0
    if not 0 < number < 1:
        raise BadInput(place, f"`{text}`", "a share above 0 and below 100 %, such as 2% or 0.02", code="SPEC007")
    return number


def _share(text: str, place: Place) -> float:
    plain = text.strip()
    return float(exact_number(plain.removesuffix("%").strip(), place)) / (100 if plain.endswith("%") else 1)
