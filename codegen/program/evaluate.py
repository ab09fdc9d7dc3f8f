"""Values of constants, with the operations and in the order of the generated code."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from codegen.base.errors import BadInput
from codegen.program.graph import Node, reachable

_CALLS: dict[str, Callable[..., float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "tanh": math.tanh,
    "pow": math.pow,
    "abs": abs,
    "sign": lambda u: float((u > 0) - (u < 0)),
}


class Evaluator:
    """Evaluates constant nodes in double or in single precision.

    A function in single precision is the rounded double result: its last bit may differ from ``sinf``.
    """

    def __init__(self, parameters: Mapping[str, float], single: bool) -> None:
        self._round: Callable[[float], float] = (lambda v: float(np.float32(v))) if single else float
        self._parameters = {name: self._round(value) for name, value in parameters.items()}
        self._known: dict[Node, float] = {}

    def values(self, nodes: Iterable[Node]) -> tuple[float, ...]:
        """The values of constant nodes, as by ``value``."""
        nodes = list(nodes)
        for node in reachable(nodes):
            self.value(node)
        return tuple(self.value(node) for node in nodes)

    def value(self, node: Node) -> float:
        """The value of a constant node.

        Raises:
            BadInput: if it is not a finite number.
        """
        if node not in self._known:
            try:
                found = self._computed(node)
            except (ZeroDivisionError, OverflowError, ValueError):
                found = math.nan
            if not math.isfinite(found):
                raise self._not_finite(node)
            self._known[node] = found
        return self._known[node]

    def _not_finite(self, node: Node) -> BadInput:
        """The error; it names the parameter in the constant that is farthest from 1."""
        names = [n.name for n in reachable([node]) if n.kind == "symbol"]
        size = {name: abs(math.log(abs(self._parameters[name]) or 5e-324)) for name in names}
        found = f"a constant of {', '.join(names)} that is not finite"
        about = max(names, key=size.__getitem__) if names else None
        return BadInput(
            "generated code",
            found,
            "parameters and gains whose products are within the range of a double",
            about=about,
            code="SPEC028",
        )

    def _computed(self, node: Node) -> float:
        if node.kind == "number":
            return self._round(node.value)
        if node.kind == "symbol":
            return self._parameters[node.name]
        values = [self.value(a) for a in node.arguments]
        match node.kind:
            case "sum":
                return self._from_left(list(node.signs), values, lambda total, sign, v: total + sign * v)
            case "product":
                return self._from_left([1] * len(values), values, lambda total, _, v: total * v)
            case "quotient":
                return self._round(values[0] / values[1])
            case "negative":
                return -values[0]
        return self._round(_CALLS[node.name](*values))

    def _from_left(self, signs: list[int], values: list[float], operation: Any) -> float:
        total = signs[0] * values[0]
        for sign, value in zip(signs[1:], values[1:], strict=True):
            total = self._round(operation(total, sign, value))
        return total
