"""SI units with prefixes and their products, without pint: the units of most specs.

Loading pint's definitions takes longer than the rest of ``stiction check``, so pint is used for other units only.
"""

from __future__ import annotations

import ast
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

    def __neg__(self) -> Dimension:
        return self

    def __pow__(self, power: Fraction | int) -> Dimension:
        return Dimension({name: exponent * power for name, exponent in self.powers})

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Dimension) and self.powers == other.powers

    def __hash__(self) -> int:
        return hash(self.powers)


@dataclass(frozen=True)
class SiUnit:
    """A unit as an exact multiple of SI base units.

    Attributes:
        factor: value in SI base units = factor · value in this unit.
        dimension: exponents of its base quantities; none for a plane angle.
    """

    factor: Fraction
    dimension: Dimension

    def __mul__(self, other: SiUnit) -> SiUnit:
        return SiUnit(self.factor * other.factor, self.dimension * other.dimension)

    def __pow__(self, power: int) -> SiUnit:
        return SiUnit(self.factor**power, self.dimension**power)


NONE = Dimension({})
"""Dimension of a pure number or an angle."""
ONE = SiUnit(Fraction(1), NONE)


def _coherent(**powers: int) -> SiUnit:
    """A product of powers of base units, with factor 1."""
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
        prefix + name: SiUnit(factor, NONE) * unit
        for name, unit in _NAMED.items()
        for prefix, factor in _PREFIXES.items()
    },
}
"""Name → unit. Other units are read by pint."""


def si_unit(text: str) -> SiUnit | None:
    """The unit of a text normalised by ``unit_text.spelled``; None for a unit that only pint can read.

    The text is a product or quotient of ``UNITS``, with exponents of one digit. It is parsed, never evaluated.
    """
    try:
        return _product(ast.parse(text.strip().replace("^", "**"), mode="eval").body)
    except (SyntaxError, ValueError, LookupError, RecursionError, MemoryError):
        return None


def _product(node: ast.expr) -> SiUnit:
    match node:
        case ast.Constant(value=value) if repr(value) == "1":
            return ONE
        case ast.Name(id=name):
            return UNITS[name]
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _product(left) * _product(right)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _product(left) * _product(right) ** -1
        case ast.BinOp(left=ast.Name(id=name), op=ast.Pow(), right=ast.UnaryOp(op=ast.USub(), operand=right)):
            return UNITS[name] ** -_power(right)
        case ast.BinOp(left=ast.Name(id=name), op=ast.Pow(), right=right):
            return UNITS[name] ** _power(right)
    raise ValueError


def _power(node: ast.expr) -> int:
    match node:
        case ast.Constant(value=int(power)) if 1 <= power <= 9:
            return power
    raise ValueError
