"""Arrays of numbered quantities: x1 … x64 are stored as x[0] … x[63].

Sixteen or more quantities that a spec numbers without a gap become an array, and equal computations on all its elements
a loop.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from codegen.program.naming import Names
from codegen.spec.reserved import reserved

LEAST = 16
"""Smallest number of quantities that become an array."""

NUMBER = re.compile(r"(0|[1-9]\d*)")
_Key = tuple[object, ...]


@dataclass(frozen=True)
class Element:
    """An array element: the array's name, and the index from zero."""

    array: str
    at: int


def elements(names: Sequence[str], taken: Names) -> dict[str, Element]:
    """The array element of every numbered name; names that go into no array are left out.

    ``names`` are those of one struct or block, in order, which an array keeps. ``taken`` provides its name.
    """
    numbered: dict[_Key, list[tuple[int, str]]] = {}
    for name in names:
        for key, number in _keys(name):
            numbered.setdefault(key, []).append((number, name))
    found: dict[str, Element] = {}
    for members in sorted(numbered.values(), key=lambda m: -len(m)):
        run = _longest_run([(number, name) for number, name in members if name not in found])
        if len(run) < LEAST:
            continue
        array = taken.take(_stem(run[0], run[1]))
        found |= {name: Element(array, k) for k, name in enumerate(run)}
    return found


def gathered(names: Sequence[str], places: dict[str, Element]) -> list[str]:
    """The names in their order, except that those of one array follow each other from the first of them on."""
    rank = {name: k for k, name in enumerate(names)}
    first: dict[str, int] = {}
    for name in names:
        if name in places:
            first.setdefault(places[name].array, rank[name])

    def key(name: str) -> tuple[int, int]:
        place = places.get(name)
        return (rank[name], 0) if place is None else (first[place.array], place.at)

    return sorted(names, key=key)


def _keys(name: str) -> Iterable[tuple[_Key, int]]:
    """(key, index) for every way to read the numbers of a name as one index; names with equal keys may form an array.

    Each number alone may be the index: ``L10_9`` is the element 10 of ``L*_9`` and the element 9 of ``L10_*``. All of
    them together may be, too, where they grow in step: ``L10_9`` is the element 10 of L2_1, L3_2, …
    """
    parts = NUMBER.split(name)
    numbers = [int(n) for n in parts[1::2]]
    for k, number in enumerate(numbers):
        yield ("one", *parts[: 2 * k + 1], None, *parts[2 * k + 2 :]), number
    if len(numbers) > 1:
        yield ("all", *parts[::2], *(n - numbers[0] for n in numbers)), numbers[0]


def _longest_run(members: list[tuple[int, str]]) -> list[str]:
    """The names of the longest run of consecutive numbers."""
    runs = groupby(enumerate(sorted(members)), key=lambda member: member[1][0] - member[0])
    return max(([name for _, (_, name) in run] for _, run in runs), key=len, default=[])


def _stem(first: str, second: str) -> str:
    """The name without the running numbers."""
    pairs = zip(NUMBER.split(first), NUMBER.split(second), strict=True)
    stem = re.sub(r"__+|_$", "_", "".join(a if a == b else "" for a, b in pairs)).strip("_")
    return f"{stem}_" if not re.match(r"[A-Za-z]", stem) or reserved(stem) else stem
