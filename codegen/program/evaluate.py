"""Values of constants, with the operations and in the order of the generated code."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from codegen.base.errors import BadInput
from codegen.program.graph import Node, out_of_range, reachable

_CALLS: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pow")},
    "abs": abs,
    "sign": lambda u: float((u > 0) - (u < 0)),
}


def constant_values(nodes: Sequence[Node], parameters: Mapping[str, float], single: bool) -> tuple[float, ...]:
    """The values of constant nodes in double or in single precision.

    A function in single precision is the rounded double result: its last bit may differ from ``sinf``.

    Raises:
        BadInput: if one is not a finite number.
    """
    rounded: Callable[[float], float] = (lambda v: float(np.float32(v))) if single else float
    given = {name: rounded(value) for name, value in parameters.items()}
    found: dict[Node, float] = {}
    for node in reachable(nodes):
        try:
            value = _value(node, [found[a] for a in node.arguments], given, rounded)
        except (ZeroDivisionError, OverflowError, ValueError):
            value = math.nan
        if not math.isfinite(value):
            raise _not_finite(node, given)
        found[node] = value
    return tuple(found[node] for node in nodes)


def _value(node: Node, values: list[float], given: Mapping[str, float], rounded: Callable[[float], float]) -> float:
    match node.kind:
        case "number":
            return rounded(node.value)
        case "symbol":
            return given[node.name]
        case "negative":
            return -values[0]
        case "quotient":
            return rounded(values[0] / values[1])
        case "sum":
            total = node.signs[0] * values[0]
            for sign, value in zip(node.signs[1:], values[1:], strict=True):
                total = rounded(total + sign * value)
            return total
        case "product":
            total = values[0]
            for value in values[1:]:
                total = rounded(total * value)
            return total
    return rounded(_CALLS[node.name](*values))


def _not_finite(node: Node, given: Mapping[str, float]) -> BadInput:
    """The error; it names the parameter in the constant that is farthest from 1."""
    names = [n.name for n in reachable([node]) if n.kind == "symbol"]
    size = {name: abs(math.log(abs(given[name]) or 5e-324)) for name in names}
    about = max(names, key=size.__getitem__) if names else None
    return out_of_range(f"a constant of {', '.join(names)} that is not finite", about=about)
