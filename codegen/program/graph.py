"""Expressions as a graph with shared nodes: sums and products of several terms, quotients, calls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Node:
    """One expression; equal expressions of a graph are one node.

    Attributes:
        kind: number, symbol, sum, product, quotient, negative or call; in rolled code also element (of an array) and
            local.
        arguments: terms, factors, (numerator, denominator), the negated node, or the arguments of a call.
        signs: of a sum's terms, 1 or -1.
        value: of a number.
        name: of a symbol or a function.
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
        return not self.arguments

    def is_number(self, value: float | None = None) -> bool:
        return self.kind == "number" and (value is None or self.value == value)


class Graph:
    """Factory of nodes, one for each expression."""

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
        return self._node("quotient", (above, below))

    def negative(self, node: Node) -> Node:
        return self._node("negative", (node,))

    def call(self, name: str, arguments: Sequence[Node]) -> Node:
        return self._node("call", arguments, name=name)

    def element(self, array: str, at: int, moving: bool, constant: bool = False) -> Node:
        """array[at], or in a loop over i array[i + at]."""
        return self._node("element", name=array, value=float(at), signs=(1,) if moving else (), constant=constant)

    def local(self, name: str, inner: bool) -> Node:
        """A local of the function, or of a loop's body."""
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
        key = (kind, *(a.index for a in arguments), signs, value.hex(), name)
        node = self._known.get(key)
        if node is None:
            if constant is None:
                constant = all(a.constant for a in arguments)
            node = Node(kind, arguments, signs, value, name, constant, len(self._known))
            self._known[key] = node
        return node


def reachable(roots: Iterable[Node]) -> list[Node]:
    """Every node below the roots, arguments first."""
    found: dict[int, Node] = {}
    waiting = list(roots)
    while waiting:
        node = waiting.pop()
        if node.index not in found:
            found[node.index] = node
            waiting.extend(node.arguments)
    return [found[index] for index in sorted(found)]
