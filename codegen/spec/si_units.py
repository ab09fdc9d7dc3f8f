"""Units as multiples of SI base units: a table of names, which may have prefixes, and products of these."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import sympy

M, KG, S, A, K = "[length]", "[mass]", "[time]", "[current]", "[temperature]"
HIGHEST_POWER = 20
"""Highest power of a unit."""
MOST_BITS = 2000
"""Most binary digits of a factor that is raised to a power."""


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
    """A unit as a multiple of SI base units.

    Attributes:
        factor: value in SI base units = factor · value in this unit; exact, or with pi or a root to fifty digits.
        dimension: exponents of its base quantities; none for a plane angle.
        angle: exponent of the radian.
    """

    factor: Fraction
    dimension: Dimension
    angle: Fraction = Fraction(0)

    def __mul__(self, other: SiUnit) -> SiUnit:
        return SiUnit(self.factor * other.factor, self.dimension * other.dimension, self.angle + other.angle)

    def __pow__(self, power: Fraction | int) -> SiUnit:
        return SiUnit(_raised(self.factor, Fraction(power)), self.dimension**power, self.angle * power)


def _raised(factor: Fraction, power: Fraction) -> Fraction:
    """A power of a positive number: exact if it is rational, else to fifty digits."""
    if power.denominator == 1:
        return factor**power.numerator
    value = sympy.Rational(factor.numerator, factor.denominator) ** sympy.Rational(power.numerator, power.denominator)
    return Fraction(str(value if value.is_Rational else value.evalf(50)))


NONE = Dimension({})
"""Dimension of a pure number or an angle."""
_TWO_PI = Fraction("6.28318530717958647692528676655900576839433879875021164")
_BASE = {
    "m": SiUnit(Fraction(1), Dimension({M: 1})),
    "kg": SiUnit(Fraction(1), Dimension({KG: 1})),
    "s": SiUnit(Fraction(1), Dimension({S: 1})),
    "A": SiUnit(Fraction(1), Dimension({A: 1})),
    "K": SiUnit(Fraction(1), Dimension({K: 1})),
    "rad": SiUnit(Fraction(1), NONE, Fraction(1)),
    "rev": SiUnit(_TWO_PI, NONE, Fraction(1)),
}
_DEFINED = tomllib.loads(Path(__file__).with_name("units.toml").read_text("utf-8"))
_SYMBOLS, _NAMES, _OTHERS = (_DEFINED[part] for part in ("symbols", "names", "others"))
"""Name → its definition by other units. Symbols may have a letter as a prefix before them, names a word."""
_LETTERS = {"n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "da": 1, "k": 3, "M": 6, "G": 9}
_WORDS = {"nano": -9, "micro": -6, "milli": -3, "centi": -2, "kilo": 3, "mega": 6, "giga": 9}
_PREFIXED: tuple[tuple[Mapping[str, int], Collection[str]], ...] = (
    (_LETTERS, {*_SYMBOLS, "m", "s", "A", "K", "rad"}),
    (_WORDS, _NAMES),
)
UNITS = frozenset(
    [*_BASE, *_SYMBOLS, *_NAMES, *_OTHERS, *(a + b for first, names in _PREFIXED for a in first for b in names)]
)
"""All names; those of three letters or more may have an s behind them."""


def si_unit(text: str) -> SiUnit | None:
    """The unit of a text normalised by ``unit_text.spelled``; None for a text that is none.

    The text is a product or quotient of units and their powers. It is parsed, never evaluated.
    """
    joined = re.sub(r"(?<=[\w)])\s+(?=[A-Za-z(])", "*", text.strip())
    try:
        return _read(re.sub(r"\bin\b", "inch", joined))  # a word of Python, which no name may be
    except (SyntaxError, ValueError, LookupError, ArithmeticError, RecursionError, MemoryError):
        return None


def _read(text: str) -> SiUnit:
    return _product(ast.parse(text.replace("^", "**"), mode="eval").body)


@cache
def _named(name: str) -> SiUnit:
    """The unit of a name; LookupError for none."""
    if name in _BASE:
        return _BASE[name]
    definition = _SYMBOLS.get(name) or _NAMES.get(name) or _OTHERS.get(name)
    if definition is not None:
        return _read(definition)
    for prefixes, names in _PREFIXED:
        for prefix, power in prefixes.items():
            if name.startswith(prefix) and name.removeprefix(prefix) in names:
                return SiUnit(Fraction(f"1e{power}"), NONE) * _named(name.removeprefix(prefix))
    if len(name) > 3 and name.endswith("s") and name[:-1] in UNITS:
        return _named(name[:-1])
    raise LookupError(name)


def _product(node: ast.expr) -> SiUnit:
    match node:
        case ast.Constant():
            return SiUnit(_number(node), NONE)
        case ast.Name(id=name):
            return _named(name)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _product(left) * _product(right)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _product(left) * _product(right) ** -1
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            base, power = _product(left), _number(right)
            exponents = [Fraction(1), base.angle, *(exponent for _, exponent in base.dimension.powers)]
            digits = base.factor.numerator.bit_length() + base.factor.denominator.bit_length()
            if max(abs(power * exponent) for exponent in exponents) > HIGHEST_POWER or digits > MOST_BITS:
                raise ValueError
            return base**power
    raise ValueError


def _number(node: ast.expr) -> Fraction:
    """A number, or the quotient of two."""
    match node:
        case ast.Constant(value=value):
            return Fraction(repr(value))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_number(operand)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _number(left) / _number(right)
    raise ValueError
