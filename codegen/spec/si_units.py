"""The units that most specs are written in, known without pint: SI units, their prefixes, and products of them.

pint reads its thousand definitions first, which takes longer than all else that ``stiction check`` does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

M, KG, S, A, K = "[length]", "[mass]", "[time]", "[current]", "[temperature]"


class Dimension:
    """Exponents of the base quantities, such as length¹ time⁻¹; hashable, with * / and **."""

    def __init__(self, powers: Mapping[str, Fraction | int]) -> None:
        self.powers = frozenset((name, Fraction(power)) for name, power in powers.items() if power)

    def __mul__(self, other: Dimension) -> Dimension:
        total = dict(self.powers)
        for name, power in other.powers:
            total[name] = total.get(name, Fraction(0)) + power
        return Dimension(total)

    def __truediv__(self, other: Dimension) -> Dimension:
        return self * other**-1

    def __pow__(self, power: Fraction | int) -> Dimension:
        return Dimension({name: own * power for name, own in self.powers})

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Dimension) and self.powers == other.powers

    def __hash__(self) -> int:
        return hash(self.powers)


@dataclass(frozen=True)
class SiUnit:
    """A unit with an exact factor.

    Attributes:
        factor: what a value in it is multiplied by to be in SI base units.
        dimension: of it; a plane angle has none.
    """

    factor: Fraction
    dimension: Dimension

    def __mul__(self, other: SiUnit) -> SiUnit:
        return SiUnit(self.factor * other.factor, self.dimension * other.dimension)

    def __pow__(self, power: int) -> SiUnit:
        return SiUnit(self.factor**power, self.dimension**power)


ONE = SiUnit(Fraction(1), Dimension({}))


def _coherent(**powers: int) -> SiUnit:
    names = {"m": M, "kg": KG, "s": S, "A": A, "K": K}
    return SiUnit(Fraction(1), Dimension({names[name]: power for name, power in powers.items()}))


_NAMED = {
    "rad": ONE,
    "m": _coherent(m=1),
    "s": _coherent(s=1),
    "A": _coherent(A=1),
    "N": _coherent(kg=1, m=1, s=-2),
    "V": _coherent(kg=1, m=2, s=-3, A=-1),
    "Pa": _coherent(kg=1, m=-1, s=-2),
    "J": _coherent(kg=1, m=2, s=-2),
    "W": _coherent(kg=1, m=2, s=-3),
    "H": _coherent(kg=1, m=2, s=-2, A=-2),
    "ohm": _coherent(kg=1, m=2, s=-3, A=-2),
    "g": SiUnit(Fraction(1, 1000), Dimension({KG: 1})),
}
_PREFIXES = {"": Fraction(1), "u": Fraction(1, 10**6), "m": Fraction(1, 1000), "k": Fraction(1000)}
UNITS: Mapping[str, SiUnit] = {
    "1": ONE,
    "K": _coherent(K=1),
    "cm": SiUnit(Fraction(1, 100), Dimension({M: 1})),
    **{
        prefix + name: SiUnit(factor, Dimension({})) * unit
        for name, unit in _NAMED.items()
        for prefix, factor in _PREFIXES.items()
    },
}
"""Name → unit. What is not here is read by pint."""
_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z]+|1)(?:\s*(?:\^|\*\*)\s*(?P<power>-?[1-9]))?(?![\w^])|(?P<sign>[*/()]))")


def si_unit(text: str) -> SiUnit | None:
    """The unit that a text as ``unit_text.spelled`` gives it is, or None where pint is to say.

    Grammar: units of UNITS, each with a power of one digit, joined by * and / from the left, and one level of
    parentheses behind a / or at the start.
    """
    total, group, below, inside = ONE, ONE, False, False
    divides, wanted = False, "unit"
    position = 0
    text = text.strip()
    while position < len(text):
        found = _TOKEN.match(text, position)
        if found is None:
            return None
        position = found.end()
        name, sign = found["name"], found["sign"]
        if name is not None and wanted == "unit" and name in UNITS:
            unit = UNITS[name] ** int(found["power"] or 1)
            group = group * (unit**-1 if divides else unit)
            wanted = "sign"
        elif sign == "(" and wanted == "unit" and not inside:
            total, group, below, inside, divides = total * group, ONE, divides, True, False
        elif sign == ")" and wanted == "sign" and inside:
            total, group, inside = total * (group**-1 if below else group), ONE, False
        elif sign in ("*", "/") and sign is not None and wanted == "sign":
            divides, wanted = sign == "/", "unit"
        else:
            return None
    return None if inside or wanted == "unit" else total * group
