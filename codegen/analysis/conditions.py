"""Simplified gain conditions: positive factors and repeated factors removed."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

WRITABLE = 40


@dataclass(frozen=True)
class Condition:
    """One inequality ``expression`` > 0.

    Attributes:
        name: of the coefficient or determinant that must be positive.
        expression: without factors that are known to be positive.
        value: at the spec's numbers and the operating point where it is smallest.
        readable: whether the expression is short enough to print; otherwise only the name is printed.
    """

    name: str
    expression: Any
    value: float

    @property
    def readable(self) -> bool:
        return int(sympy.count_ops(self.expression)) <= WRITABLE

    @property
    def holds(self) -> bool:
        return self.value > 0


def reduce_conditions(raw: Sequence[tuple[str, Any]], positive: Collection[sympy.Symbol]) -> list[tuple[str, Any]]:
    """Remove positive factors from each condition: given symbols, earlier conditions, squares of denominators.

    A square in a numerator stays unless it is known to be nonzero: a slip speed or a friction state may pass zero.

    Args:
        raw: (name, expression) pairs, each expression > 0.
        positive: symbols with a positive value, such as masses.
    """
    known: list[Any] = [*positive]
    result: list[tuple[str, Any]] = []
    for name, expression in raw:
        reduced = sympy.S.Zero if expression == 0 else _without(expression, known)  # 0 > 0 is never satisfied
        if reduced.is_number and reduced > 0:
            continue
        known.append(reduced)
        result.append((name, reduced))
    return result


def _without(expression: Any, known: Sequence[Any]) -> Any:
    if int(sympy.count_ops(expression)) > 400:
        return expression  # too expensive to factor
    numerator, denominator = sympy.fraction(sympy.together(expression))
    sign = 1
    kept: list[Any] = []
    squares: list[Any] = []
    factors = [(part, power, True) for part, power in _factors(numerator)]
    factors += [(part, power, False) for part, power in _factors(denominator)]
    for part, power, above in factors:
        odd = power % 2 == 1
        if part.is_number:
            sign *= -1 if odd and part < 0 else 1
        elif any(sympy.expand(part - k) == 0 for k in known):
            continue
        elif any(sympy.expand(part + k) == 0 for k in known):
            sign *= -1 if odd else 1
        elif odd:
            kept.append(part)
        elif above:
            squares.append(part**2)
    if not kept and sign < 0:
        return sympy.Integer(-1)  # negative for any values of the squares
    reduced = sympy.Mul(sign, *kept, *squares)
    return sympy.expand(reduced) if len(kept) + len(squares) <= 1 else reduced


def _factors(expression: Any) -> list[tuple[Any, int]]:
    try:
        constant, factors = sympy.factor_list(expression)
    except sympy.PolynomialError:  # a power with a real exponent
        return [(expression, 1)]
    return [(constant, 1), *[(f, int(p)) for f, p in factors]]


def positive_parameters(values: Mapping[sympy.Symbol, Any]) -> set[sympy.Symbol]:
    """Model parameters whose declared value is positive."""
    return {s for s, value in values.items() if value > 0}
