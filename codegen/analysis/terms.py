"""Expansion of sums of products that leaves the arguments of exp, sin, |·| and other functions unchanged."""

from __future__ import annotations

from typing import Any

import sympy


def expand_products(expression: Any) -> Any:
    """Multiply out sums, but never inside a function: exp(−(u/v)²) must not become a product of exponentials."""
    outermost = _outermost_functions(expression)
    mask = {f: sympy.Dummy(f"f{k}", real=True) for k, f in enumerate(outermost)}
    expanded = sympy.expand(expression.xreplace(mask))
    return expanded.xreplace({dummy: f for f, dummy in mask.items()})


def _outermost_functions(expression: Any) -> list[Any]:
    if isinstance(expression, sympy.Function):
        return [expression]
    found: list[Any] = []
    for argument in getattr(expression, "args", ()):
        found += [f for f in _outermost_functions(argument) if f not in found]
    return found
