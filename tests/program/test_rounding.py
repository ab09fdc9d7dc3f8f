"""Rounding of a graph: NumPy's single and double precision, operation by operation, against fractions."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from codegen.program.graph import Graph, Node
from codegen.program.rounding import Enclosed, Undecided, enclose


def expression(graph: Graph, dice: random.Random, depth: int) -> Node:
    if depth == 0:
        return dice.choice(
            [graph.symbol("a", False), graph.symbol("b", False), graph.number(dice.choice([0.5, 0.1, 3]))]
        )
    parts = [expression(graph, dice, depth - 1) for _ in range(dice.choice([2, 3]))]
    match dice.randrange(5):
        case 0:
            return graph.product(parts)
        case 1:
            return graph.call("abs", parts[:1])
        case 2:
            return graph.quotient(parts[0], graph.sum([(1, graph.call("abs", parts[1:2])), (1, graph.number(2.0))]))
        case 3:
            return graph.negative(parts[0])
    return graph.sum([(dice.choice([1, -1]), p) for p in parts])


def computed(node: Node, at: dict[str, Any], real: Any) -> Any:
    """By ``real`` numbers, from left to right."""
    if node.kind in ("number", "symbol"):
        return real(node.value) if node.kind == "number" else at[node.name]
    parts = [computed(a, at, real) for a in node.arguments]
    if node.kind == "sum":
        total = parts[0] if node.signs[0] > 0 else -parts[0]
        for sign, part in zip(node.signs[1:], parts[1:], strict=True):
            total = total + part if sign > 0 else total - part
        return total
    if node.kind == "product":
        total = parts[0]
        for part in parts[1:]:
            total = total * part
        return total
    one = {"negative": lambda: -parts[0], "quotient": lambda: parts[0] / parts[-1], "call": lambda: abs(parts[0])}
    return one[node.kind]()


@pytest.mark.parametrize("precision", ["single", "double"])
def test_rounding_is_enclosed_and_not_by_far(precision: str) -> None:
    dice, real = random.Random(precision), {"single": np.float32, "double": np.float64}[precision]
    ratios = []
    for _ in range(200):
        graph = Graph()
        root = expression(graph, dice, 4)
        ranges = {"a": Enclosed(1.0, 2.0), "b": Enclosed(-3.0, 0.5)}
        found = enclose([root], ranges, {}, precision)[0]
        worst = 0.0
        for _ in range(20):
            drawn = {"a": real(dice.uniform(1, 2)), "b": real(dice.uniform(-3, 0.5))}
            exact = computed(root, {k: Fraction(float(v)) for k, v in drawn.items()}, lambda v: Fraction(repr(v)))
            error = abs(Fraction(float(computed(root, drawn, real))) - exact)
            assert found.low <= exact <= found.high and error <= Fraction(found.error)
            worst = max(worst, float(error))
        if found.error > 0:
            ratios.append(worst / found.error)
    assert np.median(ratios) > 0.02


def test_what_is_known_narrows_and_what_is_open_is_told() -> None:
    graph = Graph()
    a = graph.symbol("a", False)
    sign = graph.call("sign", [graph.sum([(1, a), (-1, graph.number(1.0))])])
    with pytest.raises(Undecided, match="sign"):
        enclose([sign], {"a": Enclosed(0.0, 3.0)}, {}, "single")
    with pytest.raises(Undecided, match="sign"):
        enclose([sign], {"a": Enclosed(1.01, 3.0, 0.02)}, {}, "single")
    assert enclose([sign], {"a": Enclosed(0.0, 3.0)}, {a: (1.5, 3.0)}, "single") == [Enclosed(1.0, 1.0)]
    with pytest.raises(Undecided, match="divisor"):
        enclose([graph.quotient(a, a)], {"a": Enclosed(-1.0, 3.0)}, {}, "single")
    with pytest.raises(Undecided, match="sin"):
        enclose([graph.call("sin", [a])], {"a": Enclosed(-1.0, 3.0)}, {}, "single")
