"""Arithmetic of constant nodes: numbers are evaluated, parameters become a product over a product."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.program.graph import Graph, Node


def constant_product(factors: Sequence[Node], graph: Graph) -> Node:
    """One number, then the other factors in the order of their creation, over all their divisors."""
    number = 1.0
    above: list[Node] = []
    below: list[Node] = []
    waiting = list(factors)
    while waiting:
        node = waiting.pop(0)
        if node.is_number():
            number *= node.value
        elif node.kind == "product":
            waiting += node.arguments
        elif node.kind == "negative":
            number, waiting = -number, [*waiting, node.arguments[0]]
        elif node.kind == "quotient":
            waiting.append(node.arguments[0])
            below += node.arguments[1].arguments if node.arguments[1].kind == "product" else [node.arguments[1]]
        else:
            above.append(node)
    for node in list(below):
        if node in above:
            above.remove(node)
            below.remove(node)
    if number == 0:
        return graph.number(0.0)
    negative = number < 0 and bool(above or below)
    result = _product(abs(number) if negative else number, above, graph)
    if below:
        result = graph.quotient(result, _product(1.0, below, graph))
    return graph.negative(result) if negative else result


def constant_sum(terms: Sequence[tuple[int, Node]], graph: Graph) -> Node:
    """The part with parameters first, then the sum of the numbers."""
    number = 0.0
    named: list[tuple[int, Node]] = []
    for sign, node in terms:
        if node.kind == "negative":
            sign, node = -sign, node.arguments[0]
        if node.is_number():
            number += sign * node.value
        elif node.kind == "sum":
            for s, t in zip(node.signs, node.arguments, strict=True):
                if t.is_number():
                    number += sign * s * t.value
                else:
                    named.append((sign * s, t))
        elif (-sign, node) in named:
            named.remove((-sign, node))
        else:
            named.append((sign, node))
    if number or not named:
        named.append((-1 if number < 0 and named else 1, graph.number(abs(number) if named else number)))
    named.sort(key=lambda term: -term[0])
    if named[0][0] < 0:
        return graph.negative(constant_sum([(1, node) for _, node in named], graph))
    return named[0][1] if len(named) == 1 else graph.sum(named)


def constant_reciprocal(node: Node, graph: Graph) -> Node:
    """1 / node."""
    if node.is_number() and node.value:
        return graph.number(1.0 / node.value)
    if node.kind == "negative":
        return graph.negative(constant_reciprocal(node.arguments[0], graph))
    if node.kind == "quotient":
        return constant_product([node.arguments[1], constant_reciprocal(node.arguments[0], graph)], graph)
    return graph.quotient(graph.number(1.0), node)


def _product(number: float, factors: list[Node], graph: Graph) -> Node:
    nodes = sorted(factors, key=lambda f: f.index)
    if number != 1.0 or not nodes:
        nodes = [graph.number(number), *nodes]
    return nodes[0] if len(nodes) == 1 else graph.product(nodes)
