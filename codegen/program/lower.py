"""Lowering, Program → Code: one expression graph over all blocks, simplified, with common subexpressions and constants.

Derived constants are evaluated by the operations of the generated code, in its order.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import casadi
import numpy as np

from codegen.base.errors import BadInput
from codegen.program.code import Assignment, Code, Setting
from codegen.program.graph import Graph, Node, out_of_range, reachable, to_graph
from codegen.program.model import HELD, Program
from codegen.program.naming import RESERVED, Names, constant_name, partial_name
from codegen.program.roll import roll
from codegen.program.simplify import normalise


@lru_cache(maxsize=8)
def lower(program: Program) -> Code:
    """The Code of a program: of its forms with and without factored sums, that with fewer operations. Cached.

    Raises BadInput if a constant is not finite, or a name cannot be used in the generated code.
    """
    # With arrays, sums are not factored: a factored sum differs from the others that could be in one loop with it.
    lowerings = [_Lowering(program, factoring) for factoring in ((False,) if program.arrays else (False, True))]
    forms = [(lowering.code(), lowering.names) for lowering in lowerings]
    code, names = min(forms, key=lambda form: sum(form[0].operations()))
    return replace(code, rolled=roll(program, code, names))


class _Lowering:
    """Lowering of one program, with or without factored sums."""

    def __init__(self, program: Program, factoring: bool) -> None:
        self.program, self.factoring = program, factoring
        self.graph = Graph()
        varying = [f.name for f in (*program.states, *program.inputs)] + [HELD + name for name, _, _ in program.outputs]
        self.symbols = {
            name: self.graph.symbol(name, True) for name in ("sample_time", *(f.name for f in program.parameters))
        }
        self.symbols |= {name: self.graph.symbol(name, False) for name in varying}
        elements = {e for b in program.blocks for e in b.elements}
        following = {f"{f.name}_next" for f in program.states}
        self.names = Names(elements | following | {f.name for f in program.inputs} | RESERVED)

    def code(self) -> Code:
        raw: dict[str, Node] = {}
        for block in self.program.blocks:
            raw |= zip(block.elements, self._nodes([block.expression], raw), strict=True)
        named = [raw[e] for b in self.program.blocks if not b.inner for e in b.elements]
        following = self._nodes(self.program.next_state, raw)
        short = normalise([*named, *following], named, self.graph, self.factoring, self.program.arrays)
        value = {element: short[node] for element, node in raw.items() if node in short}
        final = [short[node] for node in following]
        derived = self._derived([*final, *(value[name] for name, _, _ in self.program.outputs)], value)
        states = self.program.states
        parameters = {f.name: f.value for f in self.program.parameters if f.value is not None}
        return Code(
            derived=derived,
            derived_values=constant_values([a.value for a in derived], parameters, self.program.precision == "single"),
            step=self._step(value, final),
            next_state=tuple(Assignment(f.name, n, f.unit) for f, n in zip(states, final, strict=True)),
            outputs=tuple(Assignment(name, value[name], unit) for name, unit, _ in self.program.outputs),
            initial=self._setting(self.program.initial_state, "initial"),
            predicted=self._setting(self.program.predicted_state if self.program.holds else (), "predicted"),
            resumed=self._setting(self.program.resumed_state if self.program.holds else (), "resumed"),
        )

    def _nodes(self, values: Sequence[Any], raw: dict[str, Node]) -> list[Node]:
        return to_graph(casadi.vertcat(*values), {**self.symbols, **raw}, self.graph) if values else []

    def _derived(self, roots: list[Node], value: dict[str, Node]) -> tuple[Assignment, ...]:
        """The derived constants that a step uses; with arrays also those from which several of these are computed."""
        needed = {a for n in reachable(roots) if not n.constant for a in n.arguments if a.constant}
        needed |= {n for n in roots if n.constant}
        wishes: dict[Node, str] = {}
        if self.program.arrays:
            below = reachable(needed)
            uses = Counter(a for n in below for a in n.arguments)
            needed |= {n for n in below if uses[n] > 1}
            wishes = {node: element for element, node in value.items() if node in needed}
        names = Names({f.name for f in self.program.parameters})
        result = []
        for node in sorted((n for n in needed if not n.leaf), key=lambda n: n.index):
            wish = wishes.get(node) or constant_name(node)
            result.append(Assignment(names.take(wish) if wish else names.numbered("constant"), node))
        return tuple(result)

    def _step(self, value: dict[str, Node], final: list[Node]) -> tuple[Assignment, ...]:
        """Assignments block by block: intermediate results where they are first used, then the elements."""
        blocks = self.program.blocks
        wishes = {node: element for element, node in reversed(value.items())}  # the first element of a node
        roots = [*final, *(value[name] for name, _, _ in self.program.outputs)]
        live = set(reachable(roots))
        uses = Counter(a for n in live if not n.constant for a in n.arguments)
        uses.update(roots)
        for node in sorted(live, key=lambda n: -n.index):
            if node.kind == "negative":
                uses[node.arguments[0]] += uses[node] - 1
        whole = {value[e] for b in blocks if not b.inner for e in b.elements}
        known: dict[Node, str] = {}
        step: list[Assignment] = []

        def assign(node: Node, name: str, unit: str, *comment: str) -> None:
            known[node] = name
            step.append(Assignment(name, node, unit, *comment))

        def assign_below(roots: list[Node], stem: str, *comment: str) -> None:
            """Assign the nodes below the roots that are used more than once."""
            for node in reachable(roots):
                shared = uses[node] > 1 and node.kind != "negative"
                if node.constant or node.leaf or node in known or not (shared or node in whole) or node in roots:
                    continue
                assign(node, wishes.get(node) or self._partial(partial_name(node, known), stem), "", *comment)

        for block in (b for b in blocks if not b.inner):
            comment = block.name.replace("_", " "), block.source
            for element, unit in zip(block.elements, block.units, strict=True):
                node = value[element]
                if node in known or node.leaf or node.constant or node not in live:
                    continue
                assign_below([node], block.name, *comment)
                assign(node, element, unit, *comment)
        shared = [n for n in final if uses[n] > 1]
        assign_below([n for n in final if n not in shared], "step", "shared by the states")
        for node in shared:
            if node not in known and not node.leaf and not node.constant:
                assign_below([node], "step", "shared by the states")
                assign(node, self._partial(partial_name(node, known), "step"), "", "shared by the states")
        return tuple(step)

    def _partial(self, wish: str | None, stem: str) -> str:
        return self.names.take(wish) if wish and wish.isidentifier() and len(wish) <= 40 else self.names.numbered(stem)

    def _setting(self, expressions: Sequence[Any], stem: str) -> Setting:
        """The assignments of states outside the normal step; those that keep their value are left out."""
        nodes = self._nodes(expressions, {})
        short = normalise(nodes, [], self.graph, factoring=False)
        final = [short[node] for node in nodes]
        used = reachable(final)
        uses = Counter(a for n in used for a in n.arguments)
        known: dict[Node, str] = {}
        parts = []
        for node in used:
            if uses[node] > 1 and not node.leaf and node.kind != "negative" and not node.constant:
                known[node] = self._partial(partial_name(node, known), stem)
                parts.append(Assignment(known[node], node))
        set_to = zip(self.program.states, final, strict=True) if final else ()
        states = tuple(Assignment(f.name, n, f.unit) for f, n in set_to if n is not self.symbols[f.name])
        return Setting(states, tuple(parts))


_CALLS: dict[str, Callable[..., float]] = {
    **{name: getattr(math, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pow")},
    "abs": abs,
    "sign": lambda u: float((u > 0) - (u < 0)),
}


def constant_values(nodes: Sequence[Node], parameters: Mapping[str, float], single: bool) -> tuple[float, ...]:
    """The values of constant nodes in double or in single precision; BadInput if one is not a finite number.

    A function in single precision is the rounded double result: its last bit may differ from ``sinf``.
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
    """The error for a constant that is not finite, located at the parameter in it whose |log| is the largest."""
    names = [n.name for n in reachable([node]) if n.kind == "symbol"]
    size = {name: abs(math.log(abs(given[name]) or 5e-324)) for name in names}
    about = max(names, key=size.__getitem__) if names else None
    return out_of_range(f"a constant of {', '.join(names)} that is not finite", about=about)
