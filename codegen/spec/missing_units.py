"""Identification of parameters without a unit, if the units of an equation do not match.

Each condition on units is linear in the exponents of the base units. With the units of some parameters as unknowns, the
conditions are solved one after another (Gaussian elimination); a violated condition without unknowns is a
contradiction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import chain, combinations, islice

from codegen.base.errors import BadInput, Place
from codegen.spec.si_units import NONE, Dimension
from codegen.spec.units import UnitMismatch, describe, is_called

MOST_AT_ONCE, MOST_TRIED = 3, 60
Needed = tuple[Dimension, Place]
"""The dimension that a parameter must have, and the place in the spec that requires it."""
Read = Callable[[Mapping[str, Dimension]], object]


def refuse_missing_units(read: Read, unwritten: Sequence[str], place: Callable[[str], Place]) -> None:
    """Raise BadInput at parameters without a unit, if this is the only reason why units do not match.

    Args:
        read: function of parameter → dimension that replaces the spec's; raises UnitMismatch if units do not match.
        unwritten: names of the parameters without a unit.
        place: key → its file and line.
    """
    all_sets = chain.from_iterable(combinations(unwritten, k) for k in range(1, MOST_AT_ONCE + 1))
    found: list[dict[str, Needed]] = []
    for names in islice(all_sets, MOST_TRIED):
        if found and len(names) > len(found[0]):
            break
        solved = _solved(read, names)
        if solved is not None:
            found.append(solved)
    usual = [one for one in found if all(is_called(of) for of, _ in one.values())]
    chosen = found if len(found) == 1 else usual
    if len(chosen) != 1:
        return
    faults = []
    for name, (of, where) in chosen[0].items():
        words = f"parameter `{name}` without a unit, and without it the terms of {where} do not fit"
        expected = f"`unit: {describe(of)}`, or another of that kind"
        faults.append(BadInput(place(f"parameters.{name}.unit"), words, expected, code="SPEC014"))
    first, *others = faults
    first.others = tuple(others)
    raise first


def _solved(read: Read, names: Sequence[str]) -> dict[str, Needed] | None:
    """The dimensions of the parameters ``names`` that satisfy all conditions; None if there are none, or several."""
    of = {name: Dimension({_unknown(name): 1}) for name in names}
    where: dict[str, Place] = {}
    for _ in range(len(names) + 1):
        try:
            read(of)
        except UnitMismatch as fault:
            powers = dict(fault.ratio.powers)
            solved = next((name for name in names if _unknown(name) in powers), None)
            if solved is None:
                return None
            unknown, where[solved] = _unknown(solved), fault.place
            power = powers[unknown]
            value = (fault.ratio / Dimension({unknown: power})) ** (-1 / power)
            of = {name: _with(one, unknown, value) for name, one in of.items()}
        except BadInput:
            return None
        else:
            known = all(not power.startswith("?") for one in of.values() for power, _ in one.powers)
            return {n: (of[n], where[n]) for n in names} if known and NONE not in of.values() else None
    return None


def _unknown(name: str) -> str:
    return f"?{name}"


def _with(one: Dimension, unknown: str, value: Dimension) -> Dimension:
    """A dimension with an unknown replaced by its value."""
    power = dict(one.powers).get(unknown, Fraction(0))
    return one / Dimension({unknown: power}) * value**power
