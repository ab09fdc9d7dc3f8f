"""The program as it is printed: assignments in order, constants apart, every expression a node of one graph."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from codegen.program.graph import Node, reachable
from codegen.program.stretch import Rolled

LIMITS = ("exp", "tanh", "sign", "pow")
"""Functions that may be finite where their argument is not."""


@dataclass(frozen=True)
class Assignment:
    """A name and what it holds; ``unit`` is empty for a partial result."""

    name: str
    value: Node
    unit: str = ""


@dataclass(frozen=True)
class Group:
    """Assignments under one comment: what they are and the equation's number."""

    title: str
    source: str
    assignments: tuple[Assignment, ...]


@dataclass(frozen=True)
class Operations:
    """What a step costs: additions and subtractions, products, divisions, calls of functions, selections of a sign."""

    additions: int
    products: int
    divisions: int
    calls: int
    selections: int

    @property
    def total(self) -> int:
        return self.additions + self.products + self.divisions + self.calls + self.selections


@dataclass(frozen=True)
class Setting:
    """States that are set beside the step: ``parts`` first, then ``states``; ``names`` of the parts' nodes."""

    states: tuple[Assignment, ...]
    parts: tuple[Assignment, ...]
    names: dict[Node, str]

    @property
    def nodes(self) -> list[Node]:
        """Every value."""
        return [a.value for a in (*self.parts, *self.states)]


@dataclass(frozen=True)
class Code:
    """A lowered program.

    Attributes:
        derived: constants that follow from the parameters, in the order in which ``prepare`` computes them;
            ``derived_values`` are theirs, by the same operations.
        step: in order; ``next_state`` and ``outputs`` are over what it assigns.
        initial: the first state, over parameters and inputs.
        carried, resumed: the states that change with a sample that is lost, and with the good one after many; empty
            where no sample is held.
        rolled: the same over arrays and in loops, where the program has arrays; this is then what is printed.
        names: node → how later expressions call it, where it has a name.
    """

    derived: tuple[Assignment, ...]
    derived_values: tuple[float, ...]
    step: tuple[Group, ...]
    next_state: tuple[Assignment, ...]
    outputs: tuple[Assignment, ...]
    names: dict[Node, str]
    initial: Setting
    carried: Setting
    resumed: Setting
    rolled: Rolled | None = None

    def unseen(self, inputs: Iterable[str]) -> tuple[str, ...]:
        """The inputs that may be NaN or infinite without a next state being so."""
        bits = {name: 1 << k for k, name in enumerate(inputs)}
        through: dict[Node, int] = {}
        for node in reachable(a.value for a in self.next_state):
            through[node] = bits.get(node.name, 0) if node.kind == "symbol" else 0
            if node.name in LIMITS:
                continue
            for argument in node.arguments[:1] if node.kind == "quotient" else node.arguments:
                through[node] |= through[argument]
        seen = 0
        for following in self.next_state:
            seen |= through[following.value]
        return tuple(name for name, bit in bits.items() if not seen & bit)

    def unseen_outputs(self) -> tuple[Node, ...]:
        """Outputs with a product or quotient that may overflow while every next state stays finite, each node once."""
        carried = _passing([a.value for a in self.next_state])
        found: dict[Node, None] = {}
        for output in self.outputs:
            if any(_may_overflow(node) and node not in carried for node in _passing([output.value])):
                found.setdefault(output.value)
        return tuple(found)

    @property
    def constants(self) -> dict[Node, str]:
        """The node of each derived constant → its name."""
        return {a.value: a.name for a in self.derived}

    @property
    def functions(self) -> frozenset[str]:
        """Every function that is called anywhere."""
        values = [a.value for a in (*self.derived, *self._assigned, *self.next_state, *self.outputs)]
        return frozenset(node.name for node in reachable([*values, *self._set]) if node.kind == "call")

    @property
    def divides(self) -> bool:
        """Whether anything is divided by what is not constant."""
        values = [a.value for a in (*self._assigned, *self.next_state, *self.outputs)]
        return any(node.kind == "quotient" and not node.constant for node in reachable([*values, *self._set]))

    @property
    def _set(self) -> list[Node]:
        return [*self.initial.nodes, *self.carried.nodes, *self.resumed.nodes]

    @property
    def _assigned(self) -> list[Assignment]:
        return [a for group in self.step for a in group.assignments]

    def operations(self) -> Operations:
        """Counted as they are printed: a node with a name once."""
        nodes = [n for n in reachable(a.value for a in (*self._assigned, *self.next_state)) if not n.constant]
        calls = [n.name for n in nodes if n.kind == "call"]
        return Operations(
            additions=sum(len(n.arguments) - 1 for n in nodes if n.kind == "sum"),
            products=sum(len(n.arguments) - 1 for n in nodes if n.kind == "product"),
            divisions=sum(n.kind == "quotient" for n in nodes),
            calls=len(calls) - calls.count("sign") - calls.count("abs"),
            selections=calls.count("sign") + calls.count("abs"),
        )


def _passing(roots: Iterable[Node]) -> set[Node]:
    """The nodes below the roots which, infinite or NaN, make a root so."""
    found: set[Node] = set()
    waiting = list(roots)
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            if node.name not in LIMITS:
                waiting.extend(node.arguments[:1] if node.kind == "quotient" else node.arguments)
    return found


def _may_overflow(node: Node) -> bool:
    """Whether finite arguments can give what is not finite, other than by a sum or a constant factor."""
    varying = [a for a in node.arguments if not a.constant]
    return (node.kind == "quotient" and not node.constant) or (node.kind == "product" and len(varying) > 1)
