"""Random rational points: where formulas are compared and counterexamples are searched for."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.world import World

DENOMINATORS = (1, 1, 2, 5, 10, 20, 100)  # decimals with few digits, so that a point can be printed as it is
PATIENCE = 200


def order(symbols: Iterable[Any]) -> list[Any]:
    """Symbols by name, so that a seed gives the same point in every process."""
    return sorted(symbols, key=lambda s: s.name)


def draw(symbols: Sequence[Any], world: World, generator: random.Random) -> dict[Any, Any]:
    """One point: a nonzero rational for each symbol, within what the symbol can be."""
    point = {}
    for s in symbols:
        if s in world.ranges:
            point[s] = sympy.sympify(generator.choice(world.ranges[s]))
            continue
        value = sympy.Rational(generator.randint(1, 50), generator.choice(DENOMINATORS))
        point[s] = value if s in world.positive or generator.random() < 0.5 else -value
    return point


def points(
    symbols: Iterable[Any], world: World, given: Sequence[tuple[Any, bool]], seed: int, count: int
) -> Iterator[dict[Any, Any]]:
    """Up to ``count`` points at which every expression of ``given`` is positive (or not negative, where not strict)."""
    ordered, generator, found = order(symbols), random.Random(seed), 0
    tests = [(numeric(expression, ordered), strict) for expression, strict in given]
    for _ in range(count * PATIENCE):
        point = draw(ordered, world, generator)
        values = [float(x) for x in point.values()]
        if all(test(*values) > 0 or (not strict and test(*values) == 0) for test, strict in tests):
            found += 1
            yield point
            if found == count:
                return


def numeric(expression: Any, symbols: Sequence[Any]) -> Any:
    """A fast float function of an expression or matrix."""
    return sympy.lambdify(list(symbols), expression, modules=[{"Sgn": _sgn, "Magnitude": abs}, "numpy"])


def exactly(expression: Any, point: Mapping[Any, Any]) -> Any:
    """The value at a point: a rational where the expression is rational, else 50 digits."""
    value = expression.xreplace(dict(point))
    if value.is_Rational:
        return value
    return sympy.N(value.replace(Magnitude, sympy.Abs).replace(Sgn, sympy.sign), 50)


def _sgn(x: float) -> float:
    return (x > 0) - (x < 0)
