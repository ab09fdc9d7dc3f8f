"""Expression graph (DAG) with hash consing: equal expressions are one node; conversion from CasADi SX."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi

from codegen.base.errors import BadInput


@dataclass(frozen=True, eq=False)
class Node:
    """A node of an expression graph; equal expressions are one node, so that nodes are compared by identity.

    Attributes:
        kind: number, symbol, sum, product, quotient, negative or call; in rolled code also element (of an array) and
            local.
        arguments: terms, factors, (numerator, denominator), the negated node, or the arguments of a call.
        signs: of a sum's terms, 1 or -1; of an element or a local (1,) if it ``varies_in_loop``, else empty.
        value: of a number; of an element, its index in the array.
        name: of a symbol, function, array or local.
        constant: whether it depends on parameters and numbers only.
        index: order of creation; arguments come before the nodes that use them.
    """

    kind: str
    arguments: tuple[Node, ...] = ()
    signs: tuple[int, ...] = ()
    value: float = 0.0
    name: str = ""
    constant: bool = False
    index: int = 0

    @property
    def leaf(self) -> bool:
        """Whether it has no arguments: a number, symbol, element or local."""
        return not self.arguments

    @property
    def varies_in_loop(self) -> bool:
        """Of an element or a local: whether it is another one in each iteration of a loop."""
        return self.kind in ("element", "local") and bool(self.signs)

    def is_number(self, value: float | None = None) -> bool:
        """Whether it is a number, or this number."""
        return self.kind == "number" and (value is None or self.value == value)


class Graph:
    """Factory of nodes that returns the existing node of an equal expression (hash consing)."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], Node] = {}

    def number(self, value: float) -> Node:
        return self._node("number", value=float(value), constant=True)

    def symbol(self, name: str, constant: bool) -> Node:
        return self._node("symbol", name=name, constant=constant)

    def sum(self, terms: Sequence[tuple[int, Node]]) -> Node:
        """Terms with their signs, added from left to right."""
        return self._node("sum", [node for _, node in terms], signs=tuple(sign for sign, _ in terms))

    def product(self, factors: Sequence[Node]) -> Node:
        """Factors, multiplied from left to right."""
        return self._node("product", factors)

    def quotient(self, above: Node, below: Node) -> Node:
        """above/below."""
        return self._node("quotient", (above, below))

    def negative(self, node: Node) -> Node:
        return self._node("negative", (node,))

    def call(self, name: str, arguments: Sequence[Node]) -> Node:
        return self._node("call", arguments, name=name)

    def element(self, array: str, at: int, moving: bool, constant: bool = False) -> Node:
        """array[at], or with ``moving`` array[i + at] in a loop over i."""
        return self._node("element", name=array, value=float(at), signs=(1,) if moving else (), constant=constant)

    def local(self, name: str, inner: bool) -> Node:
        """A local variable of the function, or with ``inner`` of a loop's body."""
        return self._node("local", name=name, signs=(1,) if inner else (), constant=False)

    def like(self, node: Node, arguments: Sequence[Node]) -> Node:
        """A node with other arguments, or copied from another graph."""
        return self._node(node.kind, arguments, node.signs, node.value, node.name, node.constant)

    def _node(
        self,
        kind: str,
        arguments: Iterable[Node] = (),
        signs: tuple[int, ...] = (),
        value: float = 0.0,
        name: str = "",
        constant: bool | None = None,
    ) -> Node:
        arguments = tuple(arguments)
        # As hexadecimal text 0.0 and -0.0 differ, which are equal as numbers.
        key = (kind, *(a.index for a in arguments), signs, value.hex(), name)
        node = self._known.get(key)
        if node is None:
            if constant is None:
                constant = all(a.constant for a in arguments)
            node = Node(kind, arguments, signs, value, name, constant, len(self._known))
            self._known[key] = node
        return node


def reachable(roots: Iterable[Node]) -> list[Node]:
    """The roots and every node below them in topological order: arguments first, which is the order of creation."""
    visited: dict[int, Node] = {}
    waiting = list(roots)
    while waiting:
        node = waiting.pop()
        if node.index not in visited:
            visited[node.index] = node
            waiting.extend(node.arguments)
    return [visited[index] for index in sorted(visited)]


_CALLS = {
    casadi.OP_SIN: "sin",
    casadi.OP_COS: "cos",
    casadi.OP_TAN: "tan",
    casadi.OP_EXP: "exp",
    casadi.OP_LOG: "log",
    casadi.OP_SQRT: "sqrt",
    casadi.OP_TANH: "tanh",
    casadi.OP_POW: "pow",
    casadi.OP_CONSTPOW: "pow",
    casadi.OP_FABS: "abs",
    casadi.OP_SIGN: "sign",
}


def to_graph(expression: Any, names: Mapping[str, Node], graph: Graph) -> list[Node]:
    """The nodes of an SX column, k by 1, in ``graph``; ``names``: SX symbol in the column → its node.

    CasADi gives a function as instructions over numbered registers (its work vector), which are executed on nodes here.

    Raises:
        TypeError: for a CasADi operation that no output language has.
        BadInput: for a constant that is not finite.
    """
    symbols = casadi.symvar(casadi.SX(expression))
    function = casadi.Function("block", symbols, [casadi.densify(casadi.SX(expression))], {"allow_free": False})
    register: dict[int, Node] = {}
    results: dict[int, Node] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        target, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            results[target[1]] = register[source[0]]
        elif operation == casadi.OP_INPUT:
            register[target[0]] = names[symbols[source[0]].name()]
        elif operation == casadi.OP_CONST:
            register[target[0]] = graph.number(_finite(function.instruction_constant(k)))
        else:
            register[target[0]] = _operation(operation, [register[r] for r in source], graph)
    return [results[k] for k in range(len(results))]


def _operation(operation: int, arguments: list[Node], graph: Graph) -> Node:
    """The node of one CasADi operation on one or two arguments."""
    a, b = arguments[0], arguments[-1]
    match operation:
        case casadi.OP_ADD:
            return graph.sum([(1, a), (1, b)])
        case casadi.OP_SUB:
            return graph.sum([(1, a), (-1, b)])
        case casadi.OP_MUL:
            return graph.product([a, b])
        case casadi.OP_DIV:
            return graph.quotient(a, b)
        case casadi.OP_NEG:
            return graph.negative(a)
        case casadi.OP_SQ:
            return graph.product([a, a])
        case casadi.OP_TWICE:
            return graph.product([graph.number(2.0), a])
        case casadi.OP_INV:
            return graph.quotient(graph.number(1.0), a)
        case operation if operation in _CALLS:
            return graph.call(_CALLS[operation], arguments)
    raise TypeError(f"no output language has CasADi operation {operation}")


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise out_of_range(f"the constant {value}")
    return value


def out_of_range(found: str, number_type: str = "double", about: str | None = None) -> BadInput:
    """The error for a constant that generated code cannot have: not finite, or too large for its type of number."""
    expected = f"parameters and gains whose products are within the range of a {number_type}"
    return BadInput("generated code", found, expected, about=about, code="SPEC028")
