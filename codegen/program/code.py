"""The lowered program: assignments in order, constants separate, expressions as nodes of one graph; and as printed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from codegen.program.graph import Node, reachable

LIMITS = ("exp", "tanh", "sign", "pow")
"""Functions that may return a finite value for a non-finite argument."""


@dataclass(frozen=True)
class Assignment:
    """A name and its expression; ``unit`` is empty for a partial result."""

    name: str
    value: Node
    unit: str = ""


@dataclass(frozen=True)
class Group:
    """Assignments under one comment: what they compute, and the equation's number."""

    title: str
    source: str
    assignments: tuple[Assignment, ...]


@dataclass(frozen=True)
class Operations:
    """Operation counts of a step: additions and subtractions, products, divisions, function calls, sign selections."""

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
    """States that are set outside the normal step: ``parts`` first, then ``states``."""

    states: tuple[Assignment, ...]
    parts: tuple[Assignment, ...]

    @property
    def nodes(self) -> list[Node]:
        """All expressions."""
        return [a.value for a in (*self.parts, *self.states)]


@dataclass(frozen=True)
class Line:
    """An assignment; ``target`` is an array element or a local, with ``field`` a field of that struct."""

    target: Node
    value: Node
    unit: str = ""
    field: str = ""


@dataclass(frozen=True)
class Part:
    """Lines under one comment."""

    title: str
    source: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Stretch:
    """Straight-line code, or a loop over i in [first, stop), downwards if ``backward``."""

    parts: tuple[Part, ...]
    first: int = 0
    stop: int = 0
    backward: bool = False

    @property
    def loop(self) -> bool:
        return self.stop > self.first

    @property
    def lines(self) -> tuple[Line, ...]:
        """The lines of all parts."""
        return tuple(line for part in self.parts for line in part.lines)


@dataclass(frozen=True)
class Sum:
    """Terms added up once, or for every i of [first, stop)."""

    terms: tuple[Node, ...]
    first: int = 0
    stop: int = 0
    backward: ClassVar[bool] = False


@dataclass(frozen=True)
class RolledSetting:
    """A Setting with arrays; ``scalars`` and ``arrays`` are its locals, lengths in ``Rolled``."""

    stretches: tuple[Stretch, ...] = ()
    scalars: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rolled:
    """A program in its printed form: the same operations in the same order as the assignments of its Code.

    Attributes:
        storage: array → parameters, state, inputs, outputs or local; ``lengths`` of every array.
        arrays: those that are local to the step.
        constants: derived constant → array element, for those in an array.
        scalars: locals of the whole step.
        prepare, step, outputs, following: bodies of the functions; ``following`` assigns the next state.
        initial, carried, resumed: as in Code.
        check, begun, given: sums that must be finite after a step, at the start, and of the inputs.
    """

    storage: Mapping[str, str] = field(default_factory=dict)
    lengths: Mapping[str, int] = field(default_factory=dict)
    constants: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    scalars: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    prepare: tuple[Stretch, ...] = ()
    step: tuple[Stretch, ...] = ()
    outputs: tuple[Stretch, ...] = ()
    following: tuple[Stretch, ...] = ()
    initial: RolledSetting = RolledSetting()
    carried: RolledSetting = RolledSetting()
    resumed: RolledSetting = RolledSetting()
    check: tuple[Sum, ...] = ()
    begun: tuple[Sum, ...] = ()
    given: tuple[Sum, ...] = ()


@dataclass(frozen=True)
class Code:
    """A lowered program.

    Attributes:
        derived: constants computed from the parameters, in the order of ``prepare``;
            ``derived_values`` are computed by the same operations.
        step: in order; ``next_state`` and ``outputs`` use its assignments.
        initial: the first state, over parameters and inputs.
        carried, resumed: the states that change with an invalid sample, and with the valid one after many; empty
            without fault handling.
        rolled: the same in its printed form, with loops where the program has arrays; ``lower`` adds it last.
    """

    derived: tuple[Assignment, ...]
    derived_values: tuple[float, ...]
    step: tuple[Group, ...]
    next_state: tuple[Assignment, ...]
    outputs: tuple[Assignment, ...]
    initial: Setting
    carried: Setting
    resumed: Setting
    rolled: Rolled = field(default_factory=Rolled)

    def unseen(self, inputs: Iterable[str]) -> tuple[str, ...]:
        """Inputs that may be NaN or infinite while every next state stays finite."""
        seen = {node.name for node in _passing(a.value for a in self.next_state) if node.kind == "symbol"}
        return tuple(name for name in inputs if name not in seen)

    def unseen_outputs(self) -> tuple[Node, ...]:
        """Outputs with a product or quotient that may overflow while every next state stays finite, each node once."""
        carried = _passing([a.value for a in self.next_state])
        found: dict[Node, None] = {}
        for output in self.outputs:
            if any(_may_overflow(node) and node not in carried for node in _passing([output.value])):
                found.setdefault(output.value)
        return tuple(found)

    @property
    def step_nodes(self) -> list[Node]:
        """All expressions of a normal step."""
        return [a.value for a in (*self._assigned, *self.next_state, *self.outputs)]

    @property
    def nodes(self) -> list[Node]:
        """Every node of every expression."""
        settings = [*self.initial.nodes, *self.carried.nodes, *self.resumed.nodes]
        return reachable([*(a.value for a in self.derived), *self.step_nodes, *settings])

    @property
    def functions(self) -> frozenset[str]:
        """Every function that is called anywhere."""
        return frozenset(node.name for node in self.nodes if node.kind == "call")

    @property
    def divides(self) -> bool:
        """Whether there is a division by a variable."""
        return any(node.kind == "quotient" and not node.constant for node in self.nodes)

    @property
    def _assigned(self) -> list[Assignment]:
        return [a for group in self.step for a in group.assignments]

    def operations(self) -> Operations:
        """Operation counts as printed: a named node counts once."""
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
    """Nodes below the roots whose infinite or NaN value makes a root infinite or NaN."""
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
    """Whether finite arguments may give a non-finite result, other than by a sum or a constant factor."""
    varying = [a for a in node.arguments if not a.constant]
    return (node.kind == "quotient" and not node.constant) or (node.kind == "product" and len(varying) > 1)
